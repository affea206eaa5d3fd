"""Matter at rest, whose rates are exactly zero without being evaluated.

A particle is calm if it has no radial velocity, no stress and no internal energy. Where
all particles within reach are calm and share one axial velocity, every term of R2-R7
and R10 is a product with an exact zero. Before the shock arrives that is most of a
plate. The test is made once a cell, on a box that holds whatever its particles reach,
so it may take quiescent matter for disturbed, never the reverse.

A kernel of six spacings carries some motion six spacings further in every step, thirty
times as fast as sound: 1e-100 m/s at the rim of a plate while the shock has hardly left
the hole. So a calm particle stays at rest as long as its rates are below `REST` times
what sound would do within h. That is ten thousand times less than the rounding of its
density, and takes place whether or not quiescent matter is skipped.
"""

import math

import numpy as np
from numba import njit

from mpisph.jit import EXACT
from mpisph.neighbours import SLACK, split_key

REST = 1e-20
"""Rates below this, in units of c^2/h for an acceleration, do not move calm matter."""


@njit(**EXACT)
def calm_particles(records):
    """Return which particles are calm, and how often the matter changes before each.

    Parameters
    ----------
    records : ndarray, shape (n, 16)
        As of `rates.Ring`, in the global order.

    Returns
    -------
    calm : ndarray of bool, shape (n,)
    changes : ndarray of int64, shape (n,)
        Number of particles up to and including each that are not calm, or differ from
        the one before in their axial velocity.
    """
    n = records.shape[0]
    calm = np.empty(n, np.bool_)
    changes = np.empty(n, np.int64)
    count = 0
    for i in range(n):
        ring = records[i]
        calm[i] = (
            ring[4] == 0.0
            and ring[10] == 0.0
            and ring[12] == 0.0
            and ring[13] == 0.0
            and ring[14] == 0.0
            and ring[15] == 0.0
        )
        same = i == 0 or ring[5] == records[i - 1, 5]
        count += not (calm[i] and same)
        changes[i] = count
    return calm, changes


@njit(**EXACT)
def cell_is_quiescent(cells, lattice, i, records, calm, changes):
    """Say whether all that the particles of one cell reach is calm and moves as one.

    Parameters
    ----------
    cells : CellOrder
    lattice : Lattice
    i : int
        Position of any particle of the cell.
    records : ndarray, shape (n, 16)
    calm, changes : ndarray, shape (n,)
        Of `calm_particles`.
    """
    level, iz_a, ir_a = split_key(cells.keys[i])
    size_a = lattice.size * 2.0**level
    h_a = 2.0 * lattice.h_ref * 2.0**level
    for lev in range(cells.levels.shape[0]):
        size = cells.levels[lev, 0]
        reach = 0.5 * lattice.kappa * (h_a + cells.levels[lev, 1]) * SLACK
        first, n_rows, base = cells.rows[lev]
        low = max(math.floor((iz_a * size_a - reach) / size), first)
        high = min(
            math.floor(((iz_a + 1) * size_a + reach) / size), first + n_rows - 1
        )
        left_a = math.floor((ir_a * size_a - reach) / size)
        right_a = math.floor(((ir_a + 1) * size_a + reach) / size)
        for iz in range(low, high + 1):
            ir_0, n_cells, cell = cells.columns[base + iz - first]
            left = max(left_a - ir_0, 0)
            right = min(right_a - ir_0, n_cells - 1)
            if left > right:
                continue
            begin = cells.starts[cell + left]
            last = cells.starts[cell + right + 1] - 1
            if last < begin:
                continue
            one = calm[begin] and records[begin, 5] == records[i, 5]
            if not one or changes[last] != changes[begin]:
                return False
    return True


@njit(**EXACT)
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
        abs(rates[0]) < rest * c
        and abs(rates[1]) < rest * c
        and abs(rates[2]) < rest * rho
        and abs(rates[3]) < rest * c * c
        and abs(rates[4]) < stress
        and abs(rates[5]) < stress
        and abs(rates[6]) < stress
        and abs(rates[7]) < rest * h
    )
