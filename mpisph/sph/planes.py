"""Rigid, frictionless planes across the axis: mirror images of the matter.

An image has the state of its original, mirrored: z, u_z, S_rz and B_rz change sign
about the plane. Matter and its images are then a symmetric system of twice the mass, so
energy is conserved as it is without a plane, and no force but pressure crosses the
plane. An image is never nearer to a particle than its original is, so a rank that has
received its ghosts can make all images that its particles reach.
"""

import math
from typing import NamedTuple

import numpy as np

from mpisph.core.particles import FloatArray
from mpisph.parallel.halo import reach
from mpisph.sph.sources import EXCHANGED

_ID, _Z, _H = (EXCHANGED.index(name) for name in ("id", "z", "h"))
_ODD = [EXCHANGED.index(name) for name in ("u_z", "S_rz", "B_rz")]


class Planes(NamedTuple):
    """Axial positions of the planes [m], infinite where there is none.

    Attributes
    ----------
    low, high : float
        The matter lies between them.
    """

    low: float = -np.inf
    high: float = np.inf

    @property
    def exist(self) -> bool:
        """Whether there is any."""
        return math.isfinite(self.low) or math.isfinite(self.high)


def with_images(
    fields: FloatArray, owned: int, planes: Planes, kappa: float, n_total: int
) -> FloatArray:
    """Return exchanged fields with the images that owned particles reach (R11).

    Parameters
    ----------
    fields : ndarray, shape (len(EXCHANGED), n)
        Of owned particles, then of ghosts.
    owned : int
    planes : Planes
    kappa : float
        Cut of the kernel.
    n_total : int
        Number of particles on all ranks; ids of images begin there.

    Returns
    -------
    ndarray, shape (len(EXCHANGED), n + images)
    """
    if not planes.exist:
        return fields
    z, half = fields[_Z], reach(fields[_H], kappa)
    parts = [fields]
    for number, plane in enumerate(planes, start=1):
        if math.isinf(plane):
            continue
        beyond = half - np.abs(z - plane)  # how far particles reach behind the plane
        farthest = beyond[:owned].max(initial=-np.inf)
        image = fields[:, beyond + farthest > 0.0]
        image[_Z] = 2.0 * plane - image[_Z]
        image[_ODD] *= -1.0
        image[_ID].view(np.int64)[:] += number * n_total
        parts.append(image)
    return np.concatenate(parts, axis=1)
