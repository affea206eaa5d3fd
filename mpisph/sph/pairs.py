"""The pair loop: sums of one particle over its neighbours (R2-R6).

The neighbours' records are copied from the global order into a small buffer that stays
in the first-level cache. Then one branch-free loop over the buffer, which the compiler
vectorises, forms all sums. Nothing is scattered, so the sums of a particle depend on
its own neighbours and their order alone.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mpisph.core.jit import EXACT, INLINE
from mpisph.physics.heat import heat_flow
from mpisph.physics.kernel import XI_FAR, ring_averages, ring_averages_far
from mpisph.physics.viscosity import approach, separation2, viscous_pressure
from mpisph.sph.pair_records import RECORD_FIELDS, PairRecord, record_at

LANES = 8
"""Lists are filled up to a multiple of this with rings of no mass: what a vector leaves
over would run one by one, and take as long as the whole vector."""

GROUP = 4
"""Fields that stand side by side in the buffer: one copy moves them, and the loop takes
them apart by shuffles. Copied one by one, the fields cost 5 ns a pair instead of 2."""

MASS = PairRecord._fields.index("m_F") % GROUP
"""Place of m_F in its group."""


class PairSums(NamedTuple):
    """Sums of one particle over its neighbours, SI units.

    The velocity gradient (R2), the same sums weighted by mass instead of volume (R4,
    `M_rz` holds both shears), acceleration (R3) and the heating by viscosity and
    artificial heat (R4, R6).
    """

    L_rr: float
    L_tt: float
    L_rz: float
    L_zr: float
    L_zz: float
    M_rr: float
    M_tt: float
    M_rz: float
    M_zz: float
    du_r: float
    du_z: float
    heat: float


@njit(**EXACT)
def make_buffer(candidates):
    """Return a buffer for so many candidates, shape (4, length, 4).

    Its groups are an odd number of cache lines apart: groups a multiple of 4096 bytes
    apart would fall on the same lines of the first-level cache.
    """
    lines = (candidates + LANES + 1) // 2
    return np.empty((RECORD_FIELDS // GROUP, 2 * (lines + 1 - lines % 2), GROUP))


@njit(**EXACT)
def pack_neighbours(records, index, n, rows):
    """Copy the records of the neighbours of a particle into the buffer.

    Parameters
    ----------
    records : ndarray, shape (n, 16)
    index : ndarray of int64, shape (>= n + LANES,)
        Of `find_neighbours`; filled up to a multiple of `LANES`.
    n : int
    rows : ndarray, shape (4, >= n + LANES, 4)
        Written: group, neighbour, field.

    Returns
    -------
    int
        `n` rounded up to a multiple of `LANES`. The rest repeat the first neighbour,
        without its mass.
    """
    padded = LANES * ((n + LANES - 1) // LANES)
    for k in range(n, padded):
        index[k] = index[0]
    place, motion, state, stress = rows[0], rows[1], rows[2], rows[3]
    for k in range(padded):
        x = record_at(records, np.uint64(index[k]))
        _put(x, np.uint64(k), place, motion, state, stress)
    for k in range(n, padded):
        motion[k, MASS] = 0.0
    return padded


@njit(**EXACT)
def _put(x, k, place, motion, state, stress):
    """Write a ring into place `k` of the four groups, each of shape (length, 4)."""
    row = place[k]
    row[0], row[1], row[2], row[3] = x.r, x.z, x.half_h, x.root
    row = motion[k]
    row[0], row[1], row[2], row[3] = x.u_r, x.u_z, x.m_F, x.half_rho
    row = state[k]
    row[0], row[1], row[2], row[3] = x.inv_rho, x.half_alpha_c, x.E, x.zeta
    row = stress[k]
    row[0], row[1], row[2], row[3] = x.s_rr, x.s_tr, x.s_zz, x.s_rz


@njit(**INLINE)
def pair_terms(a, b, kernel, dr, dz, d2, h, scheme):
    """Return the terms of `PairSums` that ring b adds to ring a (R2, R3, R4, R5, R6).

    Parameters
    ----------
    a, b : PairRecord
    kernel : tuple of float
        ``m_b F`` times A0, A1 and s2; q and ratio (R1).
    dr, dz, d2 : float
        Differences a - b [m] and their squares' sum [m2].
    h : float
        Pair mean of h [m].
    """
    A0, A1, s2, q, ratio = kernel
    A0_q = A0 * q
    dr_A1 = dr * A1
    x = a.r * A0_q + dr_A1
    y = dr_A1 - b.r * A0_q
    a_s2, b_s2 = a.r * s2, b.r * s2
    z_A0, z_A1 = dz * A0, dz * A1
    du_r, du_z = a.u_r - b.u_r, a.u_z - b.u_z

    l_rr = b.u_r * (y + b_s2) - a.u_r * x
    l_tt = -b.u_r * b_s2
    l_rz = b.u_r * z_A1 - a.u_r * z_A0
    l_zr = -du_z * x
    l_zz = -du_z * z_A0

    N = approach(dr, dz, du_r, du_z, a.r, b.r, a.u_r, b.u_r, q, scheme.printed)
    D = separation2(d2, ratio, scheme.epsilon, h)
    rho = a.half_rho + b.half_rho
    inv = 1.0 / (D * rho)  # one division for both
    inv_D, inv_rho = rho * inv, D * inv
    alpha_c = a.half_alpha_c + b.half_alpha_c
    Pi = viscous_pressure(N, inv_D, h, alpha_c, scheme.beta, inv_rho)
    flow = heat_flow(a.zeta + b.zeta, inv_rho, a.E, b.E)

    force_r = (a.s_rr + b.s_rr + Pi) * x + b.s_tr * a_s2 + a.s_rz * z_A0 + b.s_rz * z_A1
    force_z = a.s_rz * x + (a.s_zz + b.s_zz + Pi) * z_A0 + b.s_rz * y
    return PairSums(
        b.inv_rho * l_rr,
        b.inv_rho * l_tt,
        b.inv_rho * l_rz,
        b.inv_rho * l_zr,
        b.inv_rho * l_zz,
        l_rr,
        l_tt,
        l_rz + l_zr,
        l_zz,
        -force_r,
        -force_z,
        A0 * (0.5 * Pi * N + flow),
    )


@njit(**INLINE)
def pair_sums(a, buffer, n, scheme, near_axis):
    """Sum `pair_terms` over the first `n` packed neighbours.

    Parameters
    ----------
    a : PairRecord
    buffer : ndarray, shape (4, >= 4 n)
        The packed neighbours.
    n : int
        A multiple of `LANES`.
    scheme : SchemeConstants
    near_axis : None or bool
        None compiles the loop for rings with xi >= XI_FAR only.

    Returns
    -------
    sums : PairSums
    close : float
        Number of pairs with xi < XI_FAR, for which the loop without near axis is not
        good; zero from the other.
    """
    place, motion, state, stress = buffer[0], buffer[1], buffer[2], buffer[3]
    root_a = 0.7071067811865476 * a.root
    L_rr = L_tt = L_rz = L_zr = L_zz = M_rr = M_tt = M_rz = M_zz = 0.0
    du_r = du_z = heat = 0.0
    close = 0.0
    for k in range(n):
        b = PairRecord(
            place[4 * k], place[4 * k + 1], place[4 * k + 2], place[4 * k + 3],
            motion[4 * k], motion[4 * k + 1], motion[4 * k + 2], motion[4 * k + 3],
            state[4 * k], state[4 * k + 1], state[4 * k + 2], state[4 * k + 3],
            stress[4 * k], stress[4 * k + 1], stress[4 * k + 2], stress[4 * k + 3],
        )  # fmt: skip
        dr = a.r - b.r
        dz = a.z - b.z
        d2 = dr * dr + dz * dz
        h = a.half_h + b.half_h
        inv_h = 1.0 / h
        inv_h2 = inv_h * inv_h
        weight = b.m_F * (inv_h2 * inv_h2)
        root = root_a * b.root
        root_inv_xi = h * root
        inv_xi = root_inv_xi * root_inv_xi
        if near_axis is None:
            kernel = ring_averages_far(d2 * inv_h2, weight, root, inv_xi)
            close += 1.0 if inv_xi > 1.0 / XI_FAR else 0.0
        else:
            xi = 2.0 * a.r * b.r * inv_h2
            kernel = ring_averages(d2 * inv_h2, weight, root, inv_xi, xi, inv_h)
        t = pair_terms(a, b, kernel, dr, dz, d2, h, scheme)
        L_rr += t.L_rr
        L_tt += t.L_tt
        L_rz += t.L_rz
        L_zr += t.L_zr
        L_zz += t.L_zz
        M_rr += t.M_rr
        M_tt += t.M_tt
        M_rz += t.M_rz
        M_zz += t.M_zz
        du_r += t.du_r
        du_z += t.du_z
        heat += t.heat
    sums = PairSums(
        L_rr, L_tt, L_rz, L_zr, L_zz, M_rr, M_tt, M_rz, M_zz, du_r, du_z, heat
    )
    return sums, close


@njit(**EXACT)
def heating(sums, a):
    """Return dE/dt (R4, R6): the work of a's own stress, viscosity and heat [W/kg]."""
    work = (
        a.s_rr * (sums.M_rr + sums.M_tt)
        + a.s_tr * sums.M_tt
        + a.s_rz * sums.M_rz
        + a.s_zz * sums.M_zz
    )
    return sums.heat - work
