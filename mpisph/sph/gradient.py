"""The velocity gradient: sums over neighbours, and what they make (R2, R7)."""

from typing import NamedTuple

from mpisph.core.jit import EXACT, INLINE
from mpisph.core.jitted import jitted


class GradientSums(NamedTuple):
    """Sums over neighbours with one weight, each a multiple of V_b F (R2).

    Attributes
    ----------
    u_y, u_s : float
        Sums of u_r,b times y [1/s] and A1 h2, which is 2 r_a r_b s2 [m/s].
    u_z : float
        Sum of u_r,b z A1 - u_r,a z A0 [1/s].
    v_x, v_z : float
        Sums of u_z,b - u_z,a times x and z A0 [1/s].
    r_y, r_s, z_x, z_z : float
        The same of positions: r_b times y and A1 h2 [m]; z_b - z_a times x and z A0.
    x, z : float
        Sums of x and z A0 [1/m].
    """

    u_y: float
    u_s: float
    u_z: float
    v_x: float
    v_z: float
    r_y: float
    r_s: float
    z_x: float
    z_z: float
    x: float
    z: float


NO_SUMS = GradientSums(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


@jitted(**INLINE)
def gradient_terms(a, b, w, averages, dz):
    """Return what ring b adds to the sums of ring a with weight `w` (R2).

    `averages` holds x, y, A1 h2 and z A0, each times V_b F, and q.
    """
    x, y, s, z_A0, q = averages
    x, y, s, z_A0 = w * x, w * y, w * s, w * z_A0
    du_r, du_z = b.u_r - a.u_r, b.u_z - a.u_z
    return GradientSums(
        b.u_r * y, b.u_r * s, (du_r - b.u_r * q) * z_A0, du_z * x, du_z * z_A0,
        b.r * y, b.r * s, -dz * x, -dz * z_A0, x, z_A0,
    )  # fmt: skip


@jitted(**INLINE)
def added(s, t):
    """Return the sums `s` with the terms `t`."""
    return GradientSums(
        s.u_y + t.u_y, s.u_s + t.u_s, s.u_z + t.u_z, s.v_x + t.v_x, s.v_z + t.v_z,
        s.r_y + t.r_y, s.r_s + t.r_s, s.z_x + t.z_x, s.z_z + t.z_z,
        s.x + t.x, s.z + t.z,
    )  # fmt: skip


@jitted(**EXACT)
def velocity_gradient(s, a):
    """Return L_rr, L_tt, L_rz, L_zr, L_zz of ring a (R2) [1/s]."""
    hoop = 0.5 / a.r * s.u_s
    return s.u_y + hoop - a.u_r * s.x, -hoop, s.u_z, s.v_x, s.v_z


@jitted(**EXACT)
def moments(s, a):
    """Return K_rr, K_tt, K_rz, K_zz of ring a: R2 of positions, for velocities (R7)."""
    hoop = 0.5 / a.r * s.r_s
    return s.r_y + hoop - a.r * s.x, -hoop, s.z_x, s.z_z


UNITY = (1.0, 1.0, 0.0, 1.0)
"""B of a gradient that is left as it is."""

ENOUGH = 0.1
"""Determinant of the moments in the r-z plane, and moments, from which on a particle
has enough neighbours for a gradient. The determinant is 1 inside, 1/2 at a plane
surface, 1/4 at an edge, and 0 for a particle alone."""


@jitted(**EXACT)
def inverse_moments(K):
    """Return B_rr, B_tt, B_rz, B_zz of ``B = K^-1``, or unity with few neighbours (R7).

    The sums of R2 are ``L = G K``, where G is the gradient of linear velocities and K
    the same sums over positions. So ``G = L B``.
    """
    K_rr, K_tt, K_rz, K_zz = K
    det = K_rr * K_zz - K_rz * K_rz
    if not (det > ENOUGH and K_tt > ENOUGH and K_rr > ENOUGH and K_zz > ENOUGH):
        return UNITY
    return K_zz / det, 1.0 / K_tt, -K_rz / det, K_rr / det


@jitted(**EXACT)
def solid_share(P, G):
    """Return the part of B - 1 that forces take (R3): none once P exceeds G/10."""
    return max(0.0, 1.0 - 10.0 * abs(P) / G) if G > 0.0 else 0.0


@jitted(**EXACT)
def corrected(A, B):
    """Return ``A B`` of a tensor A with the components rr, tt, rz, zr, zz (R2, R7)."""
    A_rr, A_tt, A_rz, A_zr, A_zz = A
    B_rr, B_tt, B_rz, B_zz = B
    return (
        A_rr * B_rr + A_rz * B_rz,
        A_tt * B_tt,
        A_rr * B_rz + A_rz * B_zz,
        A_zr * B_rr + A_zz * B_rz,
        A_zr * B_rz + A_zz * B_zz,
    )
