"""Artificial stress: neighbours in tension do not clump (R21).

Of the traction of a pair along which there is tension, a share ``strength (f - g)`` is
taken back. f falls steeply with the distance, from one at the spacing of the particles;
g is what makes the sum over an even lattice vanish. So the stress of an even lattice is
unchanged, and only what comes nearer than its neighbours is held back.

References
----------
Monaghan (2000), J. Comp. Phys. 159, 290; Gray, Monaghan, Swift (2001), Comput. Methods
Appl. Mech. Engrg. 190, 6641: the idea, with f as a power of the kernel and without g.
"""

from typing import NamedTuple

import numpy as np

from mpisph.core.jit import INLINE
from mpisph.core.jitted import jitted

REACH = 2.25
"""Square of the distance in spacings at which f ends: beyond a cell's diagonal."""

TINY = 1e-200
"""Keeps a ratio finite where there is no stress [Pa2 m4]."""


class ArtificialStress(NamedTuple):
    """Constants of R21.

    Attributes
    ----------
    strength : float
    per_spacing : float
        Square of the smoothing length over the spacing.
    g : float
        See the module.
    """

    strength: float
    per_spacing: float
    g: float


def artificial_stress(strength: float, nph: float, kappa: float) -> ArtificialStress:
    """Return the constants for a lattice (R21).

    Tension along an axis of a square lattice then adds no stress.

    Parameters
    ----------
    strength : float
    nph : float
        Smoothing length over the spacing.
    kappa : float
        Cut of the kernel over the smoothing length.
    """
    n = int(kappa * nph)
    x, z = np.meshgrid(np.arange(-n, n + 1.0), np.arange(-n, n + 1.0))
    s = x * x + z * z
    inside = (s > 0.0) & (s < (kappa * nph) ** 2)
    x, z, s = x[inside], z[inside], s[inside]
    F = np.exp(-s / nph**2)
    f = np.maximum(REACH - s, 0.0) ** 2 / (REACH - 1.0) ** 2
    along = F * z**4 / s
    # Without a neighbour within the kernel there is nothing to balance.
    g = float((along * f).sum() / along.sum()) if along.size else 0.0
    return ArtificialStress(strength, nph**2, g)


@jitted(**INLINE)
def repulsion(q2, dr, dz, d2, t_r, t_z, constants):
    """Return the share of a pair's traction that is taken back (R21).

    Parameters
    ----------
    q2 : float
        Square of the distance over h.
    dr, dz, d2 : float
        Differences of place [m] and their squares' sum [m2].
    t_r, t_z : float
        Stress of both, compression positive, times these [Pa m].
    constants : ArtificialStress
    """
    near = max(REACH - q2 * constants.per_spacing, 0.0) * (1.0 / (REACH - 1.0))
    along = min(dr * t_r + dz * t_z, 0.0)
    cosine2 = along * along / (d2 * (t_r * t_r + t_z * t_z) + TINY)
    return constants.strength * (constants.g - near * near) * cosine2
