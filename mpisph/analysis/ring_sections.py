"""The section of a particle: every particle is a ring, of mass ``2 pi r rho dA``."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.core.particles import FloatArray


class RingSections(NamedTuple):
    """Square sections in the r-z plane, which turned about the axis hold the mass.

    Attributes
    ----------
    inner, outer : ndarray, shape (n,)
        Between these radii [m].
    side : ndarray, shape (n,)
        Their difference, and the height along z, centred on the particle [m].
    """

    inner: FloatArray
    outer: FloatArray
    side: FloatArray


def ring_sections(arrays: Mapping[str, npt.NDArray[Any]]) -> RingSections:
    """Return the sections of particles.

    The side is ``sqrt(m/(2 pi r rho))``. A ring nearer to the axis than half of its
    side is a full disc as high as its radius, ``(m/(pi rho))^(1/3)``: there the
    smaller of the two holds, and both agree where they meet. The volume is ``m/rho``
    either way.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        ``m`` [kg], ``r`` [m] and ``rho`` [kg/m3], each of shape (n,), as in
        `Snapshot.arrays`.

    Returns
    -------
    RingSections
    """
    m, r, rho = arrays["m"], arrays["r"], arrays["rho"]
    with np.errstate(divide="ignore"):  # on the axis itself the disc holds
        square = np.sqrt(m / (2.0 * np.pi * r * rho))
    side = np.minimum(square, np.cbrt(m / (np.pi * rho)))
    inner = np.maximum(r - 0.5 * side, 0.0)
    return RingSections(inner, inner + side, side)
