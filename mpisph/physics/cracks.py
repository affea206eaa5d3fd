"""How damage spreads once it has begun: common to all failure models (R16).

References
----------
Benz, Asphaug (1995), Computer Physics Communications 87, 253: the speed of cracks.
"""

import math

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted

CRACK_SPEED = 0.4
"""Speed of a crack over that of longitudinal waves."""

BAND = (2.0 - math.sqrt(0.5)) * math.sqrt(math.pi)
"""Width of the band that an open crack stretches, in smoothing lengths (R16)."""


@jitted(**EXACT)
def crack_growth(c, G, rho, size, dt):
    """Return the damage that a crack does in a time [s] as it crosses a particle (R16).

    Parameters
    ----------
    c : float
        Bulk sound speed [m/s].
    G : float
        Shear modulus [Pa].
    rho : float
        Density [kg/m3].
    size : float
        Of the particle [m].
    """
    return CRACK_SPEED * math.sqrt(c * c + 4.0 * G / (3.0 * rho)) * dt / size


@jitted(**EXACT)
def largest_deviatoric_stress(S_rr, S_zz, S_rz):
    """Return the largest principal stress of a deviator (R16), tension positive."""
    middle, half = 0.5 * (S_rr + S_zz), 0.5 * (S_rr - S_zz)
    in_plane = middle + math.sqrt(half * half + S_rz * S_rz)
    return max(in_plane, -(S_rr + S_zz))


@jitted(**EXACT)
def borne(P, share):
    """Return the pressure of matter of which a share bears tension (R16) [Pa]."""
    return share * P if P < 0.0 else P


@jitted(**EXACT)
def bulk_modulus(mat):
    """Return the bulk modulus of a material at rest [Pa]."""
    return mat.rho0 * mat.bulk_sound_speed * mat.bulk_sound_speed


@jitted(**EXACT)
def ring_size(m, r, rho):
    """Return the side of a ring's section [m]."""
    return math.sqrt(m / (2.0 * math.pi * r * rho))
