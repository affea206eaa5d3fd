"""Rates of change of each owned particle (R2-R7, R10).

Each particle finds its neighbours in the global order, sums over them, and has its
rates written; matter at rest is passed over. Lists of neighbours are not kept: the
exact test that settles who is in a sum must be made in every step anyhow, and finding
the runs to make it on takes 1 to 2 ns of a pair's 11 to 14. A list that served several
steps would save that alone, and cost 500 bytes a particle.
"""

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import LABEL, RATE, VALUE, FloatArray, Particles
from mpisph.physics.kernel import lies_near_axis
from mpisph.physics.response import MaterialTable
from mpisph.physics.scheme import SchemeConstants
from mpisph.physics.smoothing import smoothing_rate
from mpisph.physics.stress import jaumann_rate
from mpisph.sph.gradient import (
    UNITY,
    corrected,
    inverse_moments,
    moments,
    solid_share,
    velocity_gradient,
)
from mpisph.sph.neighbours import (
    CellOrder,
    Lattice,
    candidate_runs,
    find_neighbours,
    row_of,
)
from mpisph.sph.pair_records import record_at, write_pair_records
from mpisph.sph.pairs import (
    LANES,
    acceleration,
    heating,
    make_buffer,
    pack_neighbours,
    pair_sums,
)
from mpisph.sph.quiescence import (
    calm_particles,
    cell_reach,
    is_negligible,
    quiescent_until,
)
from mpisph.sph.sources import name_fields

CROWDED = 1.1
"""Kernel sum over carried density from which on a particle expands no further. Sound
runs stay below 1.1 at their 90th percentile. A carried density that has drifted lower
gives its particle too large a volume, hence too large a divergence, and runs away."""


@jitted(**EXACT)
def settling(crowding, c, h):
    """Return d(ln rho)/dt with which an expanded gas goes to its kernel sum (R2)."""
    return (crowding - 1.0) * c / h


@jitted(**EXACT)
def _write_rates(sums, a, sources, k, G, gas, scheme, crowding, rates, correction):
    """Write the rates of particle `k`, return its velocity divergence."""
    L = velocity_gradient(sums.continuity, a)
    M = velocity_gradient(sums.stress, a) if scheme.lee2003 else L
    B = (sources.B_rr[k], sources.B_tt[k], sources.B_rz[k], sources.B_zz[k])
    D = corrected(L, B)
    div, hoop = D[0] + D[1] + D[4], D[1]
    if crowding > CROWDED and div > 0.0:
        div = hoop = 0.0
    settled = 0.0
    if gas and abs(a.eta) < 1.0 and a.E > 0.0:  # without energy it has no waves
        settled = settling(crowding, sources.c[k], sources.h[k])
    new = inverse_moments(moments(sums.continuity, a))
    L_rr, L_tt, L_rz, L_zr, L_zz = corrected(L, new)
    share = 0.0 if scheme.lee2003 else solid_share(sources.P[k], G)
    _set_correction(correction, k, share, new)
    dS_rr, dS_zz, dS_rz = jaumann_rate(
        L_rr, L_tt, L_rz, L_zr, L_zz,
        sources.S_rr[k], sources.S_zz[k], sources.S_rz[k], G,
    )  # fmt: skip
    rates[RATE.du_r, k], rates[RATE.du_z, k] = acceleration(sums, a)
    rates[RATE.drho, k] = sources.rho[k] * (settled - div)
    rates[RATE.dE, k] = heating(sums, M, a)
    rates[RATE.dS_rr, k] = dS_rr
    rates[RATE.dS_zz, k] = dS_zz
    rates[RATE.dS_rz, k] = dS_rz
    rates[RATE.dh, k] = smoothing_rate(
        scheme.smoothing, sources.h[k], div - settled, hoop,
        sources.u_r[k], sources.r[k],
    )  # fmt: skip
    return div


@jitted(**EXACT)
def _set_correction(correction, k, share, B):
    """Write B of particle `k`, in part, for force and continuity of the next step."""
    for row in range(4):
        correction[row, k] = UNITY[row] + share * (B[row] - UNITY[row])


@jitted(**EXACT)
def _rest(k, alpha_c, rates, div, damping, crowding, correction):
    """Let particle `k` be at rest within matter as it was at the start."""
    for row in range(rates.shape[0]):
        rates[row, k] = 0.0
    div[k], damping[k], crowding[k] = 0.0, alpha_c, 1.0
    _set_correction(correction, k, 0.0, UNITY)


@jitted(**EXACT)
def _update_rates(
    fields, records, cells, lattice, table, scheme, lee2003, skip, G, labels, values
):
    sources = name_fields(fields)
    write_pair_records(sources, cells.order, table, scheme, records)
    calm, next_change = calm_particles(records)
    material = labels[LABEL.material]
    rates = values[VALUE.du_r : VALUE.dh + 1]
    correction = values[VALUE.B_rr : VALUE.B_zz + 1]
    div, damping = values[VALUE.div], values[VALUE.damping]
    crowding, count = values[VALUE.crowding], values[VALUE.neighbours]
    runs = np.empty((cells.columns.shape[0], 2), np.int64)
    rows = make_buffer(512)
    buffer = rows.reshape((rows.shape[0], -1))
    index = np.empty(rows.shape[1], np.int64)
    total = 0
    cell = row = np.int64(-1)
    until = 0.0
    quiescent = False
    for i in range(cells.order.size):
        k = cells.order[i]
        if k >= div.size:  # a ghost
            continue
        if skip and cells.keys[i] != cell:
            cell = cells.keys[i]
            reach = cell_reach(cells, lattice, i)
            if row_of(cell) != row or reach > until:
                row = row_of(cell)
                until = quiescent_until(cells, lattice, i, records, calm, next_change)
            quiescent = reach <= until
        alpha_c = scheme.alpha * sources.c[k]
        if quiescent:
            _rest(k, alpha_c, rates, div, damping, crowding, correction)
            count[k] = 0.0
            continue
        n_runs, candidates = candidate_runs(
            cells, sources.r[k], sources.z[k], sources.h[k], scheme.kappa, runs
        )
        if candidates + LANES > rows.shape[1]:
            rows = make_buffer(2 * candidates)
            buffer = rows.reshape((rows.shape[0], -1))
            index = np.empty(rows.shape[1], np.int64)
        n = find_neighbours(
            records, runs, n_runs, i, scheme.kappa, scheme.self_term, index
        )
        padded = pack_neighbours(records, index, n, rows)
        a = record_at(records, i)
        near_axis = lies_near_axis(a.r, 2.0 * a.half_h, scheme.kappa)
        if not near_axis:
            sums, close = pair_sums(a, buffer, padded, scheme, None, lee2003)
            near_axis = close > 0.0
        if near_axis:
            sums, _ = pair_sums(a, buffer, padded, scheme, True, lee2003)
        mat = table[material[k]]
        damping[k] = -0.25 / a.half_rho * sums.damping
        crowding[k] = -0.5 * sums.crowding / abs(a.eta)
        div[k] = _write_rates(
            sums, a, sources, k, G[k], mat.gas, scheme, crowding[k], rates, correction
        )
        if calm[i] and is_negligible(
            rates[:, k], mat.bulk_sound_speed, sources.h[k], sources.rho[k]
        ):
            _rest(k, alpha_c, rates, div, damping, crowding, correction)
        count[k] = n
        total += n
    return total


def update_rates(
    fields: FloatArray,
    cells: CellOrder,
    lattice: Lattice,
    table: MaterialTable,
    scheme: SchemeConstants,
    G: FloatArray,
    p: Particles,
    records: FloatArray,
    skip_quiescent: bool = True,
) -> int:
    """Evaluate the rates of all owned particles (R2-R7, R10).

    Parameters
    ----------
    fields : ndarray, shape (len(EXCHANGED), n + ghosts)
        Owned particles, then ghosts.
    cells : CellOrder
        Their global order.
    lattice : Lattice
    table : structured ndarray
        Material constants.
    scheme : SchemeConstants
    G : ndarray, shape (n,)
        Shear modulus of the owned particles [Pa].
    p : Particles
        The owned particles, of which are written: the rates; the correction of the
        next evaluation, `fields` hold that of this one; divergence, viscous signal
        speed, and kernel sum over density; and the number of neighbours evaluated, zero
        where the surroundings are quiescent.
    records : ndarray, shape (n + ghosts, RECORD_FIELDS)
        Room for what the pair loop reads. From NumPy, which asks for large pages as
        Numba does not: records of 350 000 particles then take four times as long to
        write.
    skip_quiescent : bool, optional
        False evaluates quiescent matter too, with the same bits.

    Returns
    -------
    int
        Number of directed interactions evaluated.
    """
    return int(
        _update_rates(
            fields, records, cells, lattice, table, scheme,
            True if scheme.lee2003 else None,  # None compiles the other form
            skip_quiescent, G, p.labels, p.values,
        )
    )  # fmt: skip
