"""Matter at rest, whose rates are exactly zero without being evaluated.

A particle is calm if it has no radial velocity, no stress and no internal energy. Where
all particles within reach are calm and share one axial velocity, every term of R2-R7
and R10 is a product with an exact zero. Before the shock arrives that is most of a
plate. The test is made on whole cells, so it may take quiescent matter for disturbed,
never the reverse.

A kernel of six spacings carries some motion six spacings further in every step, thirty
times as fast as sound: 1e-100 m/s at the rim of a plate while the shock has hardly left
the hole. So a calm particle stays at rest as long as its rates are below `REST` times
what sound would do within h. That is ten thousand times less than the rounding of its
density, and takes place whether or not quiescent matter is skipped.
"""

import math

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import RATE
from mpisph.sph.neighbours import REACH_SLACK, split_key
from mpisph.sph.pair_records import record_at

REST = 1e-20
"""Rates below this, in units of c^2/h for an acceleration, do not move calm matter."""


@jitted(**EXACT)
def calm_particles(records):
    """Return which particles are calm, and where the matter changes after each.

    Parameters
    ----------
    records : ndarray, shape (n, 16)
        As of `pair_records.PairRecord`, in the global order.

    Returns
    -------
    calm : ndarray of bool, shape (n,)
    next_change : ndarray of int64, shape (n + 1,)
        Position of the first particle, at each or behind it, that is not calm or
        differs from the one before in its axial velocity; n where there is none.
    """
    n = records.shape[0]
    calm = np.empty(n, np.bool_)
    next_change = np.empty(n + 1, np.int64)
    next_change[n] = n
    for i in range(n - 1, -1, -1):
        ring = record_at(records, i)
        calm[i] = (
            ring.u_r == 0.0
            and ring.E == 0.0
            and ring.s_rr == 0.0
            and ring.half_s_tr == 0.0
            and ring.s_zz == 0.0
            and ring.s_rz == 0.0
        )
        same = i > 0 and ring.u_z == record_at(records, i - 1).u_z
        next_change[i] = next_change[i + 1] if calm[i] and same else i
    return calm, next_change


@jitted(**EXACT)
def cell_reach(cells, lattice, i):
    """Return the radius up to which the particles of the cell of `i` reach [m]."""
    level, _, ir = split_key(cells.keys[i])
    scale = 2.0**level
    coarsest = 0.0
    for lev in range(cells.levels.shape[0]):
        coarsest = max(coarsest, cells.levels[lev, 1])
    reach = 0.5 * lattice.kappa * (2.0 * lattice.h_ref * scale + coarsest) * REACH_SLACK
    return (ir + 1) * lattice.size * scale + reach


@jitted(**EXACT)
def quiescent_until(cells, lattice, i, records, calm, next_change):
    """Return up to which radius all that a cell could reach is calm and moves as one.

    The rows of cells that a cell reaches are those that all cells of its row reach. So
    what is found here for one cell serves those that follow it in its row.

    Parameters
    ----------
    cells : CellOrder
    lattice : Lattice
    i : int
        Position of any particle of the cell.
    records : ndarray, shape (n, 16)
    calm, next_change : ndarray
        Of `calm_particles`.

    Returns
    -------
    float
        Left edge of the first cell, from the reach inwards of this cell on, that holds
        disturbed matter [m]. The search ends where that is within reach.
    """
    if not calm[i]:
        return 0.0
    level, iz_a, ir_a = split_key(cells.keys[i])
    u_z = record_at(records, i).u_z
    size_a = lattice.size * 2.0**level
    h_a = 2.0 * lattice.h_ref * 2.0**level
    needed = cell_reach(cells, lattice, i)
    until = math.inf
    for lev in range(cells.levels.shape[0]):
        size = cells.levels[lev, 0]
        reach = 0.5 * lattice.kappa * (h_a + cells.levels[lev, 1]) * REACH_SLACK
        first, n_rows, base = cells.rows[lev]
        low = max(math.floor((iz_a * size_a - reach) / size), first)
        high = min(math.floor(((iz_a + 1) * size_a + reach) / size), first + n_rows - 1)
        left_a = math.floor((ir_a * size_a - reach) / size)
        for iz in range(low, high + 1):
            ir_0, n_cells, cell = cells.columns[base + iz - first]
            left = max(left_a - ir_0, 0)
            if left >= n_cells:
                continue
            begin = cells.starts[cell + left]
            end = cells.starts[cell + n_cells]
            if begin == end:
                continue
            changed = begin
            if calm[begin] and record_at(records, begin).u_z == u_z:
                changed = next_change[begin + 1]
            if changed < end:
                until = min(until, split_key(cells.keys[changed])[2] * size)
                if until < needed:
                    return until
    return until


@jitted(**EXACT)
def is_negligible(rates, c, h, rho):
    """Say whether rates are too small to move calm matter.

    Parameters
    ----------
    rates : ndarray, shape (8,)
        Of u_r, u_z, rho, E, S_rr, S_zz, S_rz and h, in SI units.
    c, h, rho : float
        Bulk sound speed [m/s], smoothing length [m] and density [kg/m3].
    """
    rest = REST * c / h
    stress = rest * rho * c * c
    return (
        abs(rates[RATE.du_r]) < rest * c
        and abs(rates[RATE.du_z]) < rest * c
        and abs(rates[RATE.drho]) < rest * rho
        and abs(rates[RATE.dE]) < rest * c * c
        and abs(rates[RATE.dS_rr]) < stress
        and abs(rates[RATE.dS_zz]) < stress
        and abs(rates[RATE.dS_rz]) < stress
        and abs(rates[RATE.dh]) < rest * h
    )
