"""The velocity gradient corrected for missing and uneven neighbours (R7)."""

from numba import njit

from mpisph.core.jit import EXACT

SOUND = 0.1
"""Determinant of the moments in the r-z plane, and hoop moment, up to which a particle
has too few neighbours for a gradient. It is 1 inside, 1/2 at a plane surface, 1/4 at an
edge, and 0 for a particle alone."""


@njit(**EXACT)
def corrected_gradient(s):
    """Return L_rr, L_tt, L_rz, L_zr, L_zz (R7), exact for linear velocities [1/s].

    The sums of R2 are ``L = G K``, where G is the gradient and K the same sums over
    positions. Where K is singular, L itself is returned.

    Parameters
    ----------
    s : PairSums
    """
    det = s.K_rr * s.K_zz - s.K_rz * s.K_rz
    if not (det > SOUND and s.K_tt > SOUND):
        return s.L_rr, s.L_tt, s.L_rz, s.L_zr, s.L_zz
    rr, zz, rz = s.K_zz / det, s.K_rr / det, -s.K_rz / det
    return (
        s.L_rr * rr + s.L_rz * rz,
        s.L_tt / s.K_tt,
        s.L_rr * rz + s.L_rz * zz,
        s.L_zr * rr + s.L_zz * rz,
        s.L_zr * rz + s.L_zz * zz,
    )
