"""The section of a particle: every particle is a ring, of mass ``2 pi r rho dA``."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case.shapes.section import INNERMOST, ring_shift
from mpisph.core.particles import FloatArray

_NEAREST = 0.5 + float(ring_shift(np.array(0.5), 1.0))
"""Radius of a lattice's innermost ring over its side."""


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

    A ring stands `ring_shift` beyond the mean radius r_m of its section, as at the
    start of a run (R1), and the side is ``sqrt(m/(2 pi r_m rho))``. A ring nearer to
    the axis than the innermost one of a lattice is a full disc as high as its radius,
    ``(m/(pi rho))^(1/3)``. The volume is ``m/rho`` either way, and both agree where
    they meet.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        ``m`` [kg], ``r`` [m] and ``rho`` [kg/m3], each of shape (n,), as in
        `Snapshot.arrays`.

    Returns
    -------
    RingSections
    """
    r = arrays["r"]
    half = arrays["m"] / (2.0 * np.pi * arrays["rho"])  # side^2 r_m
    disc = np.cbrt(2.0 * half)
    reached = np.maximum(r, _NEAREST * disc)
    mean = reached
    for _ in range(6):  # Newton's method for r_m; to rounding
        excess = mean + ring_shift(mean, np.sqrt(half / mean)) - reached
        ratio = half / mean**3
        mean = mean - excess / (1.0 - ratio / 12.0 * (1.0 + 4.0 * INNERMOST * ratio**2))
    side = np.minimum(np.sqrt(half / mean), disc)
    inner = np.where(r > _NEAREST * disc, np.maximum(mean - 0.5 * side, 0.0), 0.0)
    return RingSections(inner, inner + side, side)
