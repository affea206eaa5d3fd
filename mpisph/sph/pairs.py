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
from mpisph.physics.viscosity import (
    FAR_NODES,
    PRINTED_NODES,
    closing,
    hoop_approach,
    near_nodes,
    viscous_pressure,
)
from mpisph.sph.pair_records import RECORD_FIELDS, PairRecord, record_at

LANES = 8
"""Lists are filled up to a multiple of this with rings of no mass: what a vector leaves
over would run one by one, and take as long as the whole vector."""

GROUP = 4
"""Fields that stand side by side in the buffer: one copy moves them, and the loop takes
them apart by shuffles. Copied one by one, the fields cost 5 ns a pair instead of 2."""

VOLUME = PairRecord._fields.index("V_F") % GROUP
"""Place of V_F in its group."""


class PairSums(NamedTuple):
    """Sums of one particle over its neighbours, weighted by V_b F.

    Attributes
    ----------
    L_rr, L_tt, L_rz, L_zr, L_zz : float
        Velocity gradient (R2) [1/s].
    M_rr, M_tt, M_rz, M_zz : float
        Velocity gradient that the stress works on (R4), both shears in `M_rz` [1/s].
    K_rr, K_tt, K_rz, K_zz : float
        Moments: the sums of R2 over positions in place of velocities.
    f_r, f_z : float
        Forces a density, of the neighbours' stress and of viscosity, and (`X`, `Z`) a
        unit of the particle's own stress (R3) [N/m3, 1/m].
    heat : float
        Heating by viscosity and artificial heat (R4, R6) [W/m3].
    damping : float
        Viscous signal speed (R11) [m/s].
    crowding : float
        ``sum V_b eta_b <W>``, in eta the kernel sum (R2).
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
    K_rr: float
    K_tt: float
    K_rz: float
    K_zz: float
    f_r: float
    f_z: float
    X: float
    Z: float
    heat: float
    damping: float
    crowding: float


@njit(**EXACT)
def make_buffer(candidates):
    """Return a buffer for so many candidates, shape (5, length, 4).

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
    records : ndarray, shape (n, 20)
    index : ndarray of int64, shape (>= n + LANES,)
        Of `find_neighbours`; filled up to a multiple of `LANES`.
    n : int
    rows : ndarray, shape (5, >= n + LANES, 4)
        Written: group, neighbour, field.

    Returns
    -------
    int
        `n` rounded up to a multiple of `LANES`. The rest repeat the first neighbour,
        without its volume.
    """
    padded = LANES * ((n + LANES - 1) // LANES)
    for k in range(n, padded):
        index[k] = index[0]
    place, motion, state, stress, rest = rows[0], rows[1], rows[2], rows[3], rows[4]
    for k in range(padded):
        x = record_at(records, np.uint64(index[k]))
        _put(x, np.uint64(k), place, motion, state, stress, rest)
    for k in range(n, padded):
        motion[k, VOLUME] = 0.0
    return padded


@njit(**EXACT)
def _put(x, k, place, motion, state, stress, rest):
    """Write a ring into place `k` of the five groups, each of shape (length, 4)."""
    row = place[k]
    row[0], row[1], row[2], row[3] = x.r, x.z, x.half_h, x.root
    row = motion[k]
    row[0], row[1], row[2], row[3] = x.u_r, x.u_z, x.V_F, x.half_rho
    row = state[k]
    row[0], row[1], row[2], row[3] = x.eta, x.share, x.half_alpha_c, x.zeta
    row = stress[k]
    row[0], row[1], row[2], row[3] = x.s_rr, x.s_tr, x.s_zz, x.s_rz
    row = rest[k]
    row[0], row[1], row[2], row[3] = x.E, x.spare_1, x.spare_2, x.spare_3


@njit(**INLINE)
def gradient_terms(a, b, w, kernel, dz):
    """Return the terms of L and K that ring b adds to ring a (R2), times `w`.

    `kernel` holds x, y + r_b s2, r_b s2, z A0 and z A1.
    """
    x, y, b_s2, z_A0, z_A1 = kernel
    x, y, b_s2, z_A0, z_A1 = w * x, w * y, w * b_s2, w * z_A0, w * z_A1
    du_z = a.u_z - b.u_z
    return (
        b.u_r * y - a.u_r * x,
        -b.u_r * b_s2,
        b.u_r * z_A1 - a.u_r * z_A0,
        -du_z * x,
        -du_z * z_A0,
        b.r * y - a.r * x,
        -b.r * b_s2,
        -dz * x,
        -dz * z_A0,
    )


@njit(**INLINE)
def pair_terms(a, b, kernel, nodes, dr, dz, d2, h, scheme, lee2003):
    """Return the terms of `PairSums` that ring b adds to ring a (R2, R3, R4, R5, R6).

    Parameters
    ----------
    a, b : PairRecord
    kernel : tuple of float
        ``V_b F`` times A0, A1 and s2; q and ratio (R1).
    nodes : Nodes
        Of the average over the angle (R5).
    dr, dz, d2 : float
        Differences a - b [m] and their squares' sum [m2].
    h : float
        Pair mean of h [m].
    scheme : SchemeConstants
    lee2003 : None or bool
        None compiles the form in which continuity and stress have the same weights.
    """
    A0, A1, s2, q, ratio = kernel
    A0_q = A0 * q
    dr_A1 = dr * A1
    x = a.r * A0_q + dr_A1
    y = dr_A1 - b.r * A0_q
    a_s2, b_s2 = a.r * s2, b.r * s2
    z_A0, z_A1 = dz * A0, dz * A1
    du_r, du_z = a.u_r - b.u_r, a.u_z - b.u_z

    # Weights of a's stress and of b's (R3).
    d_eta = b.eta - a.eta
    w_a = 1.0 + a.share * d_eta
    w_b = 1.0 - b.share * d_eta
    averages = (x, y + b_s2, b_s2, z_A0, z_A1)
    if lee2003 is None:
        L = gradient_terms(a, b, w_a, averages, dz)
        M = L
    else:
        L = gradient_terms(a, b, 1.0, averages, dz)
        M = gradient_terms(a, b, w_a, averages, dz)

    # Viscosity: at each node the approach N and the squared distance D.
    tau_1, tau_2, w_1 = nodes
    h2 = h * h
    N = dr * du_r + dz * du_z
    N_hoop = hoop_approach(a.r, b.r, a.u_r, b.u_r, q, scheme.printed)
    D = d2 + scheme.epsilon * h2
    D_hoop = ratio * h2
    N_1, N_2 = N + tau_1 * N_hoop, N + tau_2 * N_hoop
    D_1, D_2 = D + tau_1 * D_hoop, D + tau_2 * D_hoop
    rho = a.half_rho + b.half_rho
    D_12 = D_1 * D_2
    inv = 1.0 / (D_12 * rho)  # one division for all
    inv_rho = D_12 * inv
    h_inv = h * rho * inv
    mu_1 = closing(N_1) * (D_2 * h_inv)
    mu_2 = closing(N_2) * (D_1 * h_inv)
    alpha_c = a.half_alpha_c + b.half_alpha_c
    b_share = 2.0 * b.half_rho * inv_rho
    scale = 2.0 * a.half_rho * b_share
    P_1 = viscous_pressure(mu_1, alpha_c, scheme.beta, w_1 * scale)
    P_2 = viscous_pressure(mu_2, alpha_c, scheme.beta, (1.0 - w_1) * scale)
    P_hoop = q * (tau_1 * P_1 + tau_2 * P_2)
    P_12 = P_1 + P_2
    mu = mu_2 + w_1 * (mu_1 - mu_2)
    W_V = -0.5 * h2 * A0
    flow = heat_flow(a.zeta + b.zeta, scale, a.E, b.E)

    bw_rz = w_b * b.s_rz
    bw_rr = w_b * b.s_rr
    return PairSums(
        L[0], L[1], L[2], L[3], L[4],
        M[0], M[1], M[2] + M[3], M[4],
        L[5], L[6], L[7], L[8],
        bw_rr * x + w_b * b.s_tr * a_s2 + bw_rz * z_A1 + A0 * (dr * P_12 + b.r * P_hoop),
        (w_b * b.s_zz + P_12) * z_A0 + bw_rz * y,
        w_a * x,
        w_a * z_A0,
        A0 * (0.5 * (P_1 * N_1 + P_2 * N_2) + flow),
        W_V * b_share * (alpha_c - scheme.beta * mu),
        W_V * b.eta,
    )  # fmt: skip


@njit(**INLINE)
def pair_sums(a, buffer, n, scheme, near_axis, lee2003):
    """Sum `pair_terms` over the first `n` packed neighbours.

    Parameters
    ----------
    a : PairRecord
    buffer : ndarray, shape (5, >= 4 n)
        The packed neighbours.
    n : int
        A multiple of `LANES`.
    scheme : SchemeConstants
    near_axis : None or bool
        None compiles the loop for rings with xi >= XI_FAR only.
    lee2003 : None or bool
        See `pair_terms`.

    Returns
    -------
    sums : PairSums
    close : float
        Number of pairs with xi < XI_FAR, for which the loop without near axis is not
        good; zero from the other.
    """
    place, motion, state = buffer[0], buffer[1], buffer[2]
    stress, rest = buffer[3], buffer[4]
    root_a = 0.7071067811865476 * a.root
    far_nodes = PRINTED_NODES if scheme.printed else FAR_NODES
    L_rr = L_tt = L_rz = L_zr = L_zz = 0.0
    M_rr = M_tt = M_rz = M_zz = 0.0
    K_rr = K_tt = K_rz = K_zz = 0.0
    f_r = f_z = X = Z = heat = damping = crowding = 0.0
    close = 0.0
    for k in range(n):
        b = PairRecord(
            place[4 * k], place[4 * k + 1], place[4 * k + 2], place[4 * k + 3],
            motion[4 * k], motion[4 * k + 1], motion[4 * k + 2], motion[4 * k + 3],
            state[4 * k], state[4 * k + 1], state[4 * k + 2], state[4 * k + 3],
            stress[4 * k], stress[4 * k + 1], stress[4 * k + 2], stress[4 * k + 3],
            rest[4 * k], 0.0, 0.0, 0.0,
        )  # fmt: skip
        dr = a.r - b.r
        dz = a.z - b.z
        d2 = dr * dr + dz * dz
        h = a.half_h + b.half_h
        inv_h = 1.0 / h
        inv_h2 = inv_h * inv_h
        weight = b.V_F * (inv_h2 * inv_h2)
        root = root_a * b.root
        root_inv_xi = h * root
        inv_xi = root_inv_xi * root_inv_xi
        if near_axis is None:
            nodes = far_nodes
            kernel = ring_averages_far(d2 * inv_h2, weight, root, inv_xi)
            close += 1.0 if inv_xi > 1.0 / XI_FAR else 0.0
        else:
            xi = 2.0 * a.r * b.r * inv_h2
            kernel = ring_averages(d2 * inv_h2, weight, root, inv_xi, xi, inv_h)
            near = near_nodes(kernel[3] if xi < XI_FAR else 0.0)
            nodes = (
                1.0 if scheme.printed else near[0],
                1.0 if scheme.printed else near[1],
                1.0 if scheme.printed else near[2],
            )
        t = pair_terms(a, b, kernel, nodes, dr, dz, d2, h, scheme, lee2003)
        L_rr += t.L_rr
        L_tt += t.L_tt
        L_rz += t.L_rz
        L_zr += t.L_zr
        L_zz += t.L_zz
        M_rr += t.M_rr
        M_tt += t.M_tt
        M_rz += t.M_rz
        M_zz += t.M_zz
        K_rr += t.K_rr
        K_tt += t.K_tt
        K_rz += t.K_rz
        K_zz += t.K_zz
        f_r += t.f_r
        f_z += t.f_z
        X += t.X
        Z += t.Z
        heat += t.heat
        damping += t.damping
        crowding += t.crowding
    sums = PairSums(
        L_rr, L_tt, L_rz, L_zr, L_zz, M_rr, M_tt, M_rz, M_zz, K_rr, K_tt, K_rz, K_zz,
        f_r, f_z, X, Z, heat, damping, crowding,
    )  # fmt: skip
    return sums, close


@njit(**EXACT)
def acceleration(sums, a):
    """Return du_r/dt and du_z/dt (R3, R5) [m/s2]."""
    inv_rho = 0.5 / a.half_rho
    return (
        -inv_rho * (sums.f_r + a.s_rr * sums.X + a.s_rz * sums.Z),
        -inv_rho * (sums.f_z + a.s_rz * sums.X + a.s_zz * sums.Z),
    )


@njit(**EXACT)
def heating(sums, a):
    """Return dE/dt (R4, R6): the work of a's own stress, viscosity and heat [W/kg]."""
    work = (
        a.s_rr * (sums.M_rr + sums.M_tt)
        + a.s_tr * sums.M_tt
        + a.s_rz * sums.M_rz
        + a.s_zz * sums.M_zz
    )
    return 0.5 / a.half_rho * (sums.heat - work)
