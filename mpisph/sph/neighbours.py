"""Neighbour search that follows the local smoothing length.

Particles are sorted into levels by their h (a factor of two each) and, within a level,
into square cells of a size that follows the level. The lattice has its origin at r = z
= 0 and depends on no rank. A particle looks, level by level, at the rows and columns of
cells that its reach touches; so fine particles never search the wide cells of coarse
ones, and the cost stays proportional to the number of neighbours.
"""

import math
from typing import NamedTuple

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import FloatArray, IntArray

CELLS_PER_REACH = 2.0
"""Cell size: the reach kappa h of the level's smallest h over this. Larger cells make
more candidates, smaller ones more runs: with 1.5, 2, 2.5, 3 and 4 a pair took 13.1,
13.3, 13.8, 13.9 and 14.6 ns in the cloud of shot 4-1353 at 6 us (NPR 40), and 11.1,
11.5, 11.6, 12.3 and 11.3 ns at impact; but matter at rest is found in whole cells."""

LEVEL_BITS, AXIS_BITS = 6, 28
MAX_LEVEL = 2 ** (LEVEL_BITS - 1) - 1
MAX_CELL = 2 ** (AXIS_BITS - 1) - 1
REACH_SLACK = 1.0 + 1e-9
"""Widens the search box against rounding; the exact test alone decides."""


class Lattice(NamedTuple):
    """The global cell lattice of a run.

    Attributes
    ----------
    h_ref : float
        Smoothing length at the lower edge of level 0 [m].
    size : float
        Cell size of level 0 [m].
    kappa : float
        Cut of the kernel in units of h.
    """

    h_ref: float
    size: float
    kappa: float


class CellOrder(NamedTuple):
    """The global order of particles and the table that finds a cell in it.

    Attributes
    ----------
    order : ndarray of int64, shape (n,)
        Positions sorted by (level, axial cell, radial cell, id).
    levels : ndarray of float64, shape (n_levels, 2)
        Cell size and largest h of each level [m].
    rows : ndarray of int64, shape (n_levels, 3)
        First axial cell, number of rows, index of the first row.
    columns : ndarray of int64, shape (n_rows, 3)
        First radial cell, number of cells, index of the first cell.
    starts : ndarray of int64, shape (n_cells + n_rows,)
        First particle of each cell; each row has one entry more, its end.
    keys : ndarray of int64, shape (n,)
        Key of each particle's cell, ascending.
    """

    order: IntArray
    levels: FloatArray
    rows: IntArray
    columns: IntArray
    starts: IntArray
    keys: IntArray


def make_lattice(h0: float, kappa: float) -> Lattice:
    """Return the lattice of a run whose initial smoothing length is `h0` [m].

    Level 0 is [h0/1.5, h0/0.75): an initial h stands well inside, so that small
    changes of h move no particle to another level.
    """
    h_ref = h0 / 1.5
    return Lattice(h_ref, kappa * h_ref / CELLS_PER_REACH, kappa)


@jitted(**EXACT)
def level_of(h, h_ref):
    """Return the level of a smoothing length: floor(log2(h/h_ref)), clipped."""
    _, exponent = math.frexp(h / h_ref)
    return min(max(exponent - 1, -MAX_LEVEL), MAX_LEVEL)


@jitted(**EXACT)
def cell_keys(r, z, h, lattice):
    """Return the sort key of each particle's cell, int64, shape (n,)."""
    keys = np.empty(r.size, np.int64)
    for i in range(r.size):
        level = level_of(h[i], lattice.h_ref)
        size = lattice.size * 2.0**level
        ir = min(math.floor(r[i] / size), MAX_CELL)
        iz = min(max(math.floor(z[i] / size), -MAX_CELL), MAX_CELL)
        row = (np.int64(level + MAX_LEVEL) << AXIS_BITS) | np.int64(iz + MAX_CELL)
        keys[i] = (row << AXIS_BITS) | np.int64(ir)
    return keys


@jitted(**EXACT)
def sort_ids_within_cells(order, keys, ids):
    """Order the particles of each cell by id, in place (cells hold few)."""
    for i in range(1, order.size):
        moving = order[i]
        j = i - 1
        while j >= 0 and keys[order[j]] == keys[moving] and ids[order[j]] > ids[moving]:
            order[j + 1] = order[j]
            j -= 1
        order[j + 1] = moving


@jitted(**EXACT)
def split_key(key):
    """Return the level, axial cell and radial cell of a key."""
    ir = key & ((1 << AXIS_BITS) - 1)
    iz = ((key >> AXIS_BITS) & ((1 << AXIS_BITS) - 1)) - MAX_CELL
    return (key >> (2 * AXIS_BITS)) - MAX_LEVEL, iz, ir


@jitted(**EXACT)
def row_of(key):
    """Return what the keys of all cells of one level and row have in common."""
    return key >> AXIS_BITS


@jitted(**EXACT)
def _level_table(order, keys, h, lattice):
    """Return `levels` and `rows` of `CellOrder`."""
    levels = np.empty((2 * MAX_LEVEL + 1, 2))
    rows = np.empty((2 * MAX_LEVEL + 1, 3), np.int64)
    count = 0
    before = -MAX_LEVEL - 1
    first_row = 0
    for i in range(order.size):
        level, iz, _ = split_key(keys[order[i]])
        if level != before:
            if count > 0:
                first_row += rows[count - 1, 1]
            levels[count, 0] = lattice.size * 2.0**level
            levels[count, 1] = 0.0
            rows[count, 0] = iz
            rows[count, 2] = first_row
            before = level
            count += 1
        levels[count - 1, 1] = max(levels[count - 1, 1], h[order[i]])
        rows[count - 1, 1] = iz - rows[count - 1, 0] + 1
    return levels[:count].copy(), rows[:count].copy()


@jitted(**EXACT)
def _column_table(order, keys, rows):
    """Return `columns` of `CellOrder`; empty rows get no cells."""
    n_rows = rows[-1, 1] + rows[-1, 2] if rows.shape[0] > 0 else 0
    columns = np.zeros((n_rows, 3), np.int64)
    lev = -1
    before = -MAX_LEVEL - 1
    for i in range(order.size):
        level, iz, ir = split_key(keys[order[i]])
        if level != before:
            lev += 1
            before = level
        row = rows[lev, 2] + iz - rows[lev, 0]
        if columns[row, 1] == 0:
            columns[row, 0] = ir
        columns[row, 1] = ir - columns[row, 0] + 1
    cell = 0
    for row in range(n_rows):
        columns[row, 2] = cell
        cell += columns[row, 1] + 1
    return columns, cell


@jitted(**EXACT)
def _cell_starts(order, keys, rows, columns, n_starts):
    """Return `starts` of `CellOrder` by counting."""
    starts = np.zeros(n_starts + 1, np.int64)
    lev = -1
    before = -MAX_LEVEL - 1
    for i in range(order.size):
        level, iz, ir = split_key(keys[order[i]])
        if level != before:
            lev += 1
            before = level
        row = rows[lev, 2] + iz - rows[lev, 0]
        starts[columns[row, 2] + ir - columns[row, 0] + 1] += 1
    for cell in range(n_starts):
        starts[cell + 1] += starts[cell]
    return starts


def sort_into_cells(
    ids: IntArray, r: FloatArray, z: FloatArray, h: FloatArray, lattice: Lattice
) -> CellOrder:
    """Sort particles by (cell, id) and tabulate the cells.

    Parameters
    ----------
    ids : ndarray of int64, shape (n,)
    r, z, h : ndarray of float64, shape (n,)
        Positions and smoothing lengths [m], owned and ghosts.
    lattice : Lattice

    Returns
    -------
    CellOrder
    """
    keys = cell_keys(r, z, h, lattice)
    order = np.argsort(keys, kind="stable")
    sort_ids_within_cells(order, keys, ids)
    levels, rows = _level_table(order, keys, h, lattice)
    columns, n_starts = _column_table(order, keys, rows)
    starts = _cell_starts(order, keys, rows, columns, n_starts)
    return CellOrder(order, levels, rows, columns, starts, keys[order])


@jitted(**EXACT)
def candidate_runs(cells, r_a, z_a, h_a, kappa, runs):
    """Find where the neighbours of a particle can stand in the global order.

    Parameters
    ----------
    cells : CellOrder
    r_a, z_a, h_a : float
        Position and smoothing length of the particle [m].
    kappa : float
        Cut of the kernel.
    runs : ndarray of int64, shape (>= number of rows, 2)
        Written: first position of each run and the one after its last. Every particle
        within ``kappa (h_a + h_b)/2`` stands in one run, and the runs ascend.

    Returns
    -------
    n_runs, candidates : int
        Number of runs, and of the positions in them.
    """
    n_runs = 0
    candidates = 0
    for lev in range(cells.levels.shape[0]):
        size = cells.levels[lev, 0]
        per_size = 1.0 / size
        reach = 0.5 * kappa * (h_a + cells.levels[lev, 1]) * REACH_SLACK
        first, n_rows, base = cells.rows[lev]
        low = max(math.floor((z_a - reach) * per_size), first)
        high = min(math.floor((z_a + reach) * per_size), first + n_rows - 1)
        for iz in range(low, high + 1):
            ir_0, n_cells, cell = cells.columns[base + iz - first]
            gap = max(iz * size - z_a, z_a - (iz + 1) * size, 0.0)
            half = math.sqrt(max(reach * reach - gap * gap, 0.0)) * REACH_SLACK
            left = max(math.floor((r_a - half) * per_size) - ir_0, 0)
            right = min(math.floor((r_a + half) * per_size) - ir_0, n_cells - 1)
            if left <= right:
                begin = cells.starts[cell + left]
                end = cells.starts[cell + right + 1]
                runs[n_runs, 0] = begin
                runs[n_runs, 1] = end
                n_runs += 1
                candidates += end - begin
    return n_runs, candidates


@jitted(**EXACT)
def find_neighbours(records, runs, n_runs, i, kappa, self_term, index):
    """List the neighbours of particle `i`: those within ``kappa (h_a + h_b)/2``.

    Parameters
    ----------
    records : ndarray, shape (n, >= 3)
        In the global order; a row begins with r, z and h/2 [m]. These are the pair
        loop's records: read from arrays of their own, the search itself would be no
        faster, and the records not yet in the first-level cache when they are packed
        (0.8 ns a pair more in all).
    runs : ndarray of int64, shape (>= n_runs, 2)
        Of `candidate_runs`.
    n_runs : int
    i : int
    kappa : float
        Cut of the kernel.
    self_term : bool
        Whether a particle is a neighbour of itself (R1).
    index : ndarray of int64, shape (>= candidates,)
        Written: positions of the neighbours, ascending.

    Returns
    -------
    int
        Number of neighbours.
    """
    r_a, z_a, half_h_a = records[i, 0], records[i, 1], records[i, 2]
    cut2 = kappa * kappa
    n = 0
    for run in range(n_runs):
        for b in range(runs[run, 0], runs[run, 1]):
            record = records[np.uint64(b)]
            # Always written: a branch that cannot be foreseen costs more.
            index[np.uint64(n)] = b
            dr = r_a - record[0]
            dz = z_a - record[1]
            h = half_h_a + record[2]
            n += np.int64(dr * dr + dz * dz < cut2 * (h * h))
    return n if self_term else _leave_out(index, n, i)


@jitted(**EXACT)
def _leave_out(index, n, i):
    """Take `i` out of the first `n` of a list, return the new length."""
    kept = 0
    for k in range(n):
        index[kept] = index[k]
        kept += index[k] != i
    return kept
