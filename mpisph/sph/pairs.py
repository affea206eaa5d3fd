"""The pair loop: sums of one particle over its neighbours (R2-R6).

The neighbours' records are copied from the global order into a small buffer that stays
in the first-level cache. Then one branch-free loop over the buffer, which the compiler
vectorises, forms all sums. Nothing is scattered, so the sums of a particle depend on
its own neighbours and their order alone.
"""

from typing import NamedTuple

import numpy as np

from mpisph.core.jit import EXACT, INLINE
from mpisph.core.jitted import jitted
from mpisph.core.stack import align_stack
from mpisph.physics.artificial_stress import repulsion
from mpisph.physics.heat import heat_flow
from mpisph.physics.kernel import XI_FAR, ring_averages, ring_averages_far
from mpisph.physics.viscosity import (
    FAR_NODES,
    PRINTED_NODES,
    closing,
    hoop_approach,
    near_nodes,
    signal_speed,
    viscous_pressure,
)
from mpisph.sph.gradient import NO_SUMS, GradientSums, added, gradient_terms
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
    """Sums of one particle over its neighbours, weighted by V_b F, SI units.

    Attributes
    ----------
    continuity, stress : GradientSums
        With the weights of the continuity equation, and with those of the particle's
        own stress.
    f_r, f_z : float
        Force of the neighbours' stress and of viscosity (R3, R5) [N/m3].
    heat : float
        Heating by viscosity and artificial heat, doubled (R4, R6) [W/m3].
    damping : float
        Viscous signal speed times density, over -h^2 F/4 (R11) [kg/s].
    crowding : float
        Kernel sum in eta, over -h^2 F/2 (R2) [m2].
    """

    continuity: GradientSums
    stress: GradientSums
    f_r: float
    f_z: float
    heat: float
    damping: float
    crowding: float


@jitted(**EXACT)
def make_buffer(candidates):
    """Return a buffer for so many candidates, shape (4, length, 4).

    Its groups are an odd number of cache lines apart: groups a multiple of 4096 bytes
    apart would fall on the same lines of the first-level cache.
    """
    lines = (candidates + LANES + 1) // 2
    return np.empty((RECORD_FIELDS // GROUP, 2 * (lines + 1 - lines % 2), GROUP))


@jitted(**EXACT)
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
        without its volume.
    """
    padded = LANES * ((n + LANES - 1) // LANES)
    for k in range(n, padded):
        index[k] = index[0]
    place, motion, state, stress = rows[0], rows[1], rows[2], rows[3]
    for k in range(padded):
        x = record_at(records, np.uint64(index[k]))
        _put(x, np.uint64(k), place, motion, state, stress)
    for k in range(n, padded):
        place[k, VOLUME] = 0.0
    return padded


@jitted(**EXACT)
def _put(x, k, place, motion, state, stress):
    """Write a ring into place `k` of the four groups, each of shape (length, 4)."""
    row = place[k]
    row[0], row[1], row[2], row[3] = x.r, x.z, x.half_h, x.V_F
    row = motion[k]
    row[0], row[1], row[2], row[3] = x.u_r, x.u_z, x.half_rho, x.eta
    row = state[k]
    row[0], row[1], row[2], row[3] = x.half_alpha_c, x.E, x.two_zeta, x.s_rr
    row = stress[k]
    row[0], row[1], row[2], row[3] = x.half_s_tr, x.s_zz, x.s_rz, x.s_zr


@jitted(**INLINE)
def mean(w, one, other):
    """Return the mean of two values, the first with the weight `w`."""
    return other + w * (one - other)


@jitted(**INLINE)
def pair_terms(a, b, kernel, nodes, dr, dz, d2, q2, h, h2_r, theta_a, scheme, lee2003):
    """Return what ring b adds to the sums of ring a (R2-R6, R21).

    Parameters
    ----------
    a, b : PairRecord
    kernel : tuple of float
        ``V_b F`` times A0, A1 and s2; q and ratio (R1).
    nodes : tuple of float
        Of the average over the angle (see `viscosity.Nodes`).
    dr, dz, d2 : float
        Differences a - b [m] and their squares' sum [m2].
    q2 : float
        That sum over h^2.
    h, h2_r : float
        Pair mean of h, and its square over r_b [m].
    theta_a : float
        theta of ring a over its eta, or 1 over half of its density (R3).
    scheme : SchemeConstants
    lee2003 : None or bool
        See `pair_sums`.

    Returns
    -------
    averages : tuple of float
        See `gradient_terms`.
    w_a : float
        Weight of a's stress (R3).
    f_r, f_z, heat, damping, crowding : float
        Terms of `PairSums`.
    """
    A0, A1, _, q, ratio = kernel
    h2 = h * h
    A0_q = A0 * q
    dr_A0, z_A0 = dr * A0, dz * A0
    hoop = b.r * A0_q
    x = dr_A0 + hoop
    y = dr_A0 - a.r * A0_q

    # Viscosity: at each node the approach N and the squared distance D.
    tau_1, tau_2, w_1 = nodes
    N = dr * (a.u_r - b.u_r) + dz * (a.u_z - b.u_z)
    N_hoop = hoop_approach(a.r, b.r, a.u_r, b.u_r, q, scheme.printed)
    D = d2 + scheme.epsilon * h2
    D_hoop = ratio * h2
    D_1, D_2 = D + tau_1 * D_hoop, D + tau_2 * D_hoop
    rho = a.half_rho + b.half_rho
    b_eta = abs(b.eta)
    ratio_a = abs(a.eta) if lee2003 is None else a.half_rho
    ratio_b = b_eta if lee2003 is None else b.half_rho
    D_12, rho_ratio = D_1 * D_2, rho * ratio_b
    inv = 1.0 / (D_12 * rho_ratio)  # one division for all
    inv_rho_ratio = inv * D_12
    inv_rho, inv_ratio_b = inv_rho_ratio * ratio_b, inv_rho_ratio * rho
    h_inv = (h * rho_ratio) * inv
    mu_1 = closing(N + tau_1 * N_hoop) * (D_2 * h_inv)
    mu_2 = closing(N + tau_2 * N_hoop) * (D_1 * h_inv)
    alpha_c = a.half_alpha_c + b.half_alpha_c
    P_1 = viscous_pressure(mu_1, alpha_c, scheme.beta)
    P_2 = viscous_pressure(mu_2, alpha_c, scheme.beta)
    P = mean(w_1, P_1, P_2)
    P_hoop = mean(w_1 * tau_1, P_1, P_2)  # the weights times tau add up to 1 too
    speed = mean(
        w_1,
        signal_speed(mu_1, alpha_c, scheme.beta),
        signal_speed(mu_2, alpha_c, scheme.beta),
    )
    warming = N * P + N_hoop * P_hoop
    warming += heat_flow(a.two_zeta + b.two_zeta, a.E, b.E)
    scale = (4.0 * a.half_rho * b.half_rho) * inv_rho
    scale_A0 = scale * A0
    heat = scale_A0 * warming
    P, P_hoop = scale * P, scale * P_hoop
    held_r = held_z = 0.0
    if lee2003 is None:
        t_r = dr * (a.s_rr + b.s_rr) + dz * (a.s_rz + b.s_rz)
        t_z = dr * (a.s_zr + b.s_zr) + dz * (a.s_zz + b.s_zz)
        share = repulsion(q2, dr, dz, d2, t_r, t_z, scheme.artificial_stress)
        held_r, held_z = A1 * (share * t_r), A0 * (share * t_z)
        heat += held_r * (a.u_r - b.u_r) + held_z * (a.u_z - b.u_z)

    # Weights of a's stress and of b's. In that of b, r_a s2 = A1 h2/(2 r_b).
    d_ratio = ratio_b - ratio_a
    theta_b = inv_ratio_b if lee2003 is not None or b.eta > 0.0 else 0.0
    w_a, w_b = 1.0 + theta_a * d_ratio, 1.0 - theta_b * d_ratio
    stress_r = b.s_rr * x + A1 * (b.half_s_tr * h2_r + b.s_rz * dz)
    stress_z = b.s_zz * z_A0 + b.s_zr * y
    return (
        (x, y, A1 * h2, z_A0, q),
        w_a,
        w_b * stress_r + dr_A0 * P + hoop * P_hoop + held_r,
        w_b * stress_z + z_A0 * P + held_z,
        heat,
        scale_A0 * h2 * speed,
        h2 * A0 * b_eta,
    )


@jitted(**INLINE)
def pair_sums(a, buffer, n, scheme, near_axis, lee2003):
    """Sum over the first `n` packed neighbours.

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
    lee2003 : None or bool
        None compiles the consistent form, in which continuity has the weights of the
        stress; else these are those of eqs (5), (6) (R3).

    Returns
    -------
    sums : PairSums
    close : float
        Number of pairs with xi < XI_FAR, for which the loop without near axis is not
        good; zero from the other.
    """
    place, motion, state, stress = buffer[0], buffer[1], buffer[2], buffer[3]
    align_stack()
    root_a = 1.0 / np.sqrt(2.0 * a.r)
    half_inv_a = 0.5 / a.r
    if lee2003 is None:
        theta_a = 1.0 / a.eta if a.eta > 0.0 else 0.0
    else:
        theta_a = 1.0 / a.half_rho
    far_nodes = PRINTED_NODES if scheme.printed else FAR_NODES
    own = volume = NO_SUMS
    f_r = f_z = heat = damping = crowding = 0.0
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
        h2 = h * h
        inv = 1.0 / (h2 * b.r)  # one division for both
        inv_h2 = inv * b.r
        weight = b.V_F * (inv_h2 * inv_h2)
        h2_r = h2 * (inv * h2)
        inv_xi = half_inv_a * h2_r
        if near_axis is None:
            nodes = far_nodes
            kernel = ring_averages_far(d2 * inv_h2, weight, root_a, inv_xi)
            close += 1.0 if inv_xi > 1.0 / XI_FAR else 0.0
        else:
            xi = 2.0 * a.r * b.r * inv_h2
            root_b = np.sqrt(b.r)
            kernel = ring_averages(
                d2 * inv_h2, weight * root_b, root_a / root_b, inv_xi, xi, h * inv_h2
            )
            near = near_nodes(kernel[3] if xi < XI_FAR else 0.0)
            nodes = (
                1.0 if scheme.printed else near[0],
                1.0 if scheme.printed else near[1],
                1.0 if scheme.printed else near[2],
            )
        averages, w_a, t_r, t_z, t_heat, t_damping, t_crowding = pair_terms(
            a, b, kernel, nodes, dr, dz, d2, d2 * inv_h2, h, h2_r, theta_a, scheme,
            lee2003,
        )  # fmt: skip
        own = added(own, gradient_terms(a, b, w_a, averages, dz))
        if lee2003 is not None:
            volume = added(volume, gradient_terms(a, b, 1.0, averages, dz))
        f_r += t_r
        f_z += t_z
        heat += t_heat
        damping += t_damping
        crowding += t_crowding
    continuity = own if lee2003 is None else volume
    return PairSums(continuity, own, f_r, f_z, heat, damping, crowding), close


@jitted(**EXACT)
def acceleration(sums, a):
    """Return du_r/dt and du_z/dt (R3, R5) [m/s2]."""
    own = sums.stress
    inv_rho = 0.5 / a.half_rho
    return (
        -inv_rho * (sums.f_r + a.s_rr * own.x + a.s_rz * own.z),
        -inv_rho * (sums.f_z + a.s_zr * own.x + a.s_zz * own.z),
    )


@jitted(**EXACT)
def heating(sums, M, a):
    """Return dE/dt (R4, R6): the work of a's own stress, viscosity and heat [W/kg].

    `M` is the velocity gradient with the weights of that stress.
    """
    M_rr, M_tt, M_rz, M_zr, M_zz = M
    work = (
        a.s_rr * (M_rr + M_tt)
        + 2.0 * a.half_s_tr * M_tt
        + a.s_rz * M_rz
        + a.s_zr * M_zr
        + a.s_zz * M_zz
    )
    return 0.5 / a.half_rho * (0.5 * sums.heat - work)
