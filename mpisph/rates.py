"""The pair loop: rates of change of each owned particle (R2-R7, R10).

Each particle gathers over its own neighbours: their fields are first packed into a
small contiguous buffer, and then one branch-free loop over the buffer, which the
compiler vectorises, forms all sums. Nothing is scattered, so the result of a particle
depends on its list alone.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from mpisph.constitutive import MaterialTable, pressure_and_sound_speed
from mpisph.heat import diffusivity, heat_flow
from mpisph.jit import EXACT, INLINE
from mpisph.kernel import XI_FAR, ring_averages, ring_averages_far
from mpisph.neighbours import NeighbourList
from mpisph.particles import FloatArray
from mpisph.scheme import Scheme
from mpisph.smoothing import smoothing_rate
from mpisph.sources import Sources
from mpisph.strength import jaumann_rate
from mpisph.viscosity import approach, separation2, viscous_pressure

TINY_RADIUS = 1e-150
"""Keeps 1/r finite for a particle on the axis [m]."""


class Ring(NamedTuple):
    """What a pair needs to know of one ring, SI units (or rows of many rings).

    `root` is ``r^(-1/2)``, `V` is m/rho, and `s_..` is sigma/rho^2, compression
    positive (R3).
    """

    r: float
    z: float
    h: float
    root: float
    u_r: float
    u_z: float
    m: float
    V: float
    rho: float
    c: float
    E: float
    zeta: float
    s_rr: float
    s_tt: float
    s_zz: float
    s_rz: float


RING_FIELDS = len(Ring._fields)


class PairSums(NamedTuple):
    """Sums of one particle over its neighbours (R2-R4, R6), SI units."""

    L_rr: float
    L_tt: float
    L_rz: float
    L_zr: float
    L_zz: float
    du_r: float
    du_z: float
    dE: float


@njit(**EXACT)
def ring_records(sources, table, scheme):
    """Return the records of `Ring`, shape (n, 16): one row is two cache lines."""
    records = np.empty((sources.r.size, RING_FIELDS))
    for i in range(sources.r.size):
        mat = table[sources.material[i]]
        rho, E = sources.rho[i], sources.E[i]
        P, c = pressure_and_sound_speed(rho, E, mat, scheme)
        S_rr, S_zz, S_rz = sources.S_rr[i], sources.S_zz[i], sources.S_rz[i]
        rho2 = rho * rho
        ring = records[i]
        ring[0] = sources.r[i]
        ring[1] = sources.z[i]
        ring[2] = sources.h[i]
        ring[3] = 1.0 / np.sqrt(max(sources.r[i], TINY_RADIUS))
        ring[4] = sources.u_r[i]
        ring[5] = sources.u_z[i]
        ring[6] = sources.m[i]
        ring[7] = sources.m[i] / rho
        ring[8] = rho
        ring[9] = c
        ring[10] = E
        ring[11] = diffusivity(scheme.g1, scheme.g2, sources.h[i], c, sources.div[i])
        ring[12] = (P - S_rr) / rho2
        ring[13] = (P + S_rr + S_zz) / rho2
        ring[14] = (P - S_zz) / rho2
        ring[15] = -S_rz / rho2
    return records


@njit(**INLINE)
def pair_terms(a, b, A0, A1, s2, q, dr, dz, d2, h, F, scheme):
    """Return the terms of `PairSums` that ring b adds to ring a (R2, R3, R4, R5, R6).

    Parameters
    ----------
    a, b : Ring
    A0, A1, s2, q : float
        Ring averages of the kernel (R1).
    dr, dz, d2 : float
        Differences a - b [m] and their squares' sum [m2].
    h, F : float
        Pair mean of h [m] and -2/h^2 [1/m2].
    """
    dr_A1 = dr * A1
    x = a.r * A0 * q + dr_A1
    y = dr_A1 - b.r * A0 * q
    b_s2 = b.r * s2
    z_A0, z_A1 = dz * A0, dz * A1
    du_r, du_z = a.u_r - b.u_r, a.u_z - b.u_z

    l_rr = F * (b.u_r * (y + b_s2) - a.u_r * x)
    l_tt = -F * b.u_r * b_s2
    l_rz = F * (b.u_r * z_A1 - a.u_r * z_A0)
    l_zr = -F * du_z * x
    l_zz = -F * du_z * z_A0

    N = approach(dr, dz, du_r, du_z, a.r, b.r, a.u_r, b.u_r, q, scheme.printed)
    D = separation2(d2, a.r, b.r, q, scheme.epsilon, h)
    rho = 0.5 * (a.rho + b.rho)
    Pi = viscous_pressure(N, D, h, scheme.alpha, scheme.beta, 0.5 * (a.c + b.c), rho)

    force_r = (
        (a.s_rr + Pi) * x
        + a.s_rz * z_A0
        + b.s_rr * (x - a.r * s2)
        + b.s_tt * a.r * s2
        + b.s_rz * z_A1
    )
    force_z = a.s_rz * x + (a.s_zz + b.s_zz + Pi) * z_A0 + b.s_rz * y
    work = (
        a.s_rr * l_rr
        + a.s_tt * l_tt
        + a.s_zz * l_zz
        + a.s_rz * (l_rz + l_zr)
        - 0.5 * Pi * F * A0 * N
    )
    heat = heat_flow(0.5 * (a.zeta + b.zeta), rho, a.E, b.E, F, A0)
    return PairSums(
        b.V * l_rr,
        b.V * l_tt,
        b.V * l_rz,
        b.V * l_zr,
        b.V * l_zz,
        -b.m * F * force_r,
        -b.m * F * force_z,
        b.m * (heat - work),
    )


@njit(**INLINE)
def pair_sums(a, rows, n, scheme, near_axis):
    """Sum `pair_terms` over the first `n` packed neighbours.

    Parameters
    ----------
    a : Ring
    rows : Ring of ndarray, shape (>= n,)
        The packed neighbours.
    n : int
    scheme : Scheme
    near_axis : None or bool
        None compiles the loop for rings with xi >= XI_FAR only.

    Returns
    -------
    PairSums
    """
    L_rr = L_tt = L_rz = L_zr = L_zz = du_r = du_z = dE = 0.0
    for k in range(n):
        b = Ring(
            rows.r[k], rows.z[k], rows.h[k], rows.root[k], rows.u_r[k], rows.u_z[k],
            rows.m[k], rows.V[k], rows.rho[k], rows.c[k], rows.E[k], rows.zeta[k],
            rows.s_rr[k], rows.s_tt[k], rows.s_zz[k], rows.s_rz[k],
        )  # fmt: skip
        dr = a.r - b.r
        dz = a.z - b.z
        d2 = dr * dr + dz * dz
        h = 0.5 * (a.h + b.h)
        inv_h = 1.0 / h
        inv_h2 = inv_h * inv_h
        root_inv_xi = h * (0.7071067811865476 * a.root) * b.root
        inv_xi = root_inv_xi * root_inv_xi
        if near_axis is None:
            A0, A1, s2, q = ring_averages_far(d2 * inv_h2, inv_h, inv_xi, root_inv_xi)
        else:
            xi = 2.0 * a.r * b.r * inv_h2
            A0, A1, s2, q = ring_averages(d2 * inv_h2, inv_h, xi, inv_xi, root_inv_xi)
        t = pair_terms(a, b, A0, A1, s2, q, dr, dz, d2, h, -2.0 * inv_h2, scheme)
        L_rr += t.L_rr
        L_tt += t.L_tt
        L_rz += t.L_rz
        L_zr += t.L_zr
        L_zz += t.L_zz
        du_r += t.du_r
        du_z += t.du_z
        dE += t.dE
    return PairSums(L_rr, L_tt, L_rz, L_zr, L_zz, du_r, du_z, dE)


@njit(**EXACT)
def ring_at(records, i):
    """Return record `i` as a `Ring`."""
    x = records[i]
    return Ring(
        x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7],
        x[8], x[9], x[10], x[11], x[12], x[13], x[14], x[15],
    )  # fmt: skip


@njit(**EXACT)
def pack_neighbours(records, index, first, last, a, buffer):
    """Copy the neighbours' records into `buffer`'s rows.

    Returns
    -------
    bool
        Whether any pair lies so near the axis that ``xi < XI_FAR``.
    """
    near_axis = False
    for k in range(first, last):
        ring = records[index[k]]
        j = k - first
        for f in range(RING_FIELDS):
            buffer[f, j] = ring[f]
        h = 0.5 * (a.h + ring[2])
        near_axis |= 2.0 * a.r * ring[0] < XI_FAR * h * h
    return near_axis


@njit(**EXACT)
def _write_rates(sums, a, S, mu, mode, rates):
    """Write the rates of one particle, return its velocity divergence."""
    div = sums.L_rr + sums.L_tt + sums.L_zz
    dS_rr, dS_zz, dS_rz = jaumann_rate(
        sums.L_rr, sums.L_tt, sums.L_rz, sums.L_zr, sums.L_zz, S[0], S[1], S[2], mu
    )
    rates[0] = sums.du_r
    rates[1] = sums.du_z
    rates[2] = -a.rho * div
    rates[3] = sums.dE
    rates[4] = dS_rr
    rates[5] = dS_zz
    rates[6] = dS_rz
    rates[7] = smoothing_rate(mode, a.h, div, a.u_r, a.r)
    return div


@njit(**EXACT)
def _buffer_rows(longest):
    """Return a buffer for `longest` neighbours.

    A row is an odd number of cache lines: rows a multiple of 4096 bytes apart would
    fall on the same lines of the first-level cache (100 ns a pair instead of 20).
    """
    lines = (longest + 7) // 8
    return np.empty((RING_FIELDS, 8 * (lines + 1 - lines % 2)))


@njit(**EXACT)
def _update_rates(
    sources, records, table, scheme, owned, start, index, rates, div, count
):
    longest = 0
    for k in range(owned.size):
        longest = max(longest, start[k + 1] - start[k])
    buffer = _buffer_rows(longest)
    rows = Ring(
        buffer[0], buffer[1], buffer[2], buffer[3],
        buffer[4], buffer[5], buffer[6], buffer[7],
        buffer[8], buffer[9], buffer[10], buffer[11],
        buffer[12], buffer[13], buffer[14], buffer[15],
    )  # fmt: skip
    for k in range(owned.size):
        i = owned[k]
        slot = sources.slot[i]
        a = ring_at(records, i)
        n = start[k + 1] - start[k]
        if pack_neighbours(records, index, start[k], start[k + 1], a, buffer):
            sums = pair_sums(a, rows, n, scheme, True)
        else:
            sums = pair_sums(a, rows, n, scheme, None)
        div[slot] = _write_rates(
            sums,
            a,
            (sources.S_rr[i], sources.S_zz[i], sources.S_rz[i]),
            table[sources.material[i]].mu,
            scheme.smoothing,
            rates[:, slot],
        )
        count[slot] = n


def update_rates(
    sources: Sources,
    neighbours: NeighbourList,
    table: MaterialTable,
    scheme: Scheme,
    rates: FloatArray,
    div: FloatArray,
    count: FloatArray,
) -> None:
    """Evaluate the rates of all owned particles (R2-R7, R10).

    Parameters
    ----------
    sources : Sources
        Owned and ghosts in global order.
    neighbours : NeighbourList
    table : structured ndarray
        Material constants.
    scheme : Scheme
    rates : ndarray, shape (8, n)
        Written: rates of u_r, u_z, rho, E, S_rr, S_zz, S_rz, h.
    div, count : ndarray, shape (n,)
        Written: velocity divergence [1/s] and number of neighbours.
    """
    records = ring_records(sources, table, scheme)
    _update_rates(
        sources,
        records,
        table,
        scheme,
        neighbours.owned,
        neighbours.start,
        neighbours.members,
        rates,
        div,
        count,
    )
