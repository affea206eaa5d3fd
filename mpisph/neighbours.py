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
import numpy.typing as npt
from numba import njit

from mpisph.jit import EXACT
from mpisph.particles import FloatArray, IntArray

CELLS_PER_REACH = 4.0
"""Cell size: the reach kappa h of the level's smallest h over this. In a uniform block
2 to 8 took the same time within the noise of 15 %."""

LEVEL_BITS, AXIS_BITS = 6, 28
MAX_LEVEL = 2 ** (LEVEL_BITS - 1) - 1
MAX_CELL = 2 ** (AXIS_BITS - 1) - 1
SLACK = 1.0 + 1e-9
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
    """

    order: IntArray
    levels: FloatArray
    rows: IntArray
    columns: IntArray
    starts: IntArray


class NeighbourList(NamedTuple):
    """Neighbours of each owned particle, itself included unless left out.

    Attributes
    ----------
    owned : ndarray of int64, shape (n_owned,)
        Position of each owned particle in the global order.
    start : ndarray of int64, shape (n_owned + 1,)
        Where each list begins in `members`.
    members : ndarray of int32
        Neighbours, ascending in the global order.
    """

    owned: IntArray
    start: IntArray
    members: npt.NDArray[np.int32]


def make_lattice(h0: float, kappa: float) -> Lattice:
    """Return the lattice of a run whose initial smoothing length is `h0` [m].

    Level 0 is [h0/1.5, h0/0.75): an initial h stands well inside, so that small
    changes of h move no particle to another level.
    """
    h_ref = h0 / 1.5
    return Lattice(h_ref, kappa * h_ref / CELLS_PER_REACH, kappa)


@njit(**EXACT)
def level_of(h, h_ref):
    """Return the level of a smoothing length: floor(log2(h/h_ref)), clipped."""
    _, exponent = math.frexp(h / h_ref)
    return min(max(exponent - 1, -MAX_LEVEL), MAX_LEVEL)


@njit(**EXACT)
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


@njit(**EXACT)
def sort_ids_within_cells(order, keys, ids):
    """Order the particles of each cell by id, in place (cells hold few)."""
    for i in range(1, order.size):
        moving = order[i]
        j = i - 1
        while j >= 0 and keys[order[j]] == keys[moving] and ids[order[j]] > ids[moving]:
            order[j + 1] = order[j]
            j -= 1
        order[j + 1] = moving


@njit(**EXACT)
def _split_key(key):
    """Return the level, axial cell and radial cell of a key."""
    ir = key & ((1 << AXIS_BITS) - 1)
    iz = ((key >> AXIS_BITS) & ((1 << AXIS_BITS) - 1)) - MAX_CELL
    return (key >> (2 * AXIS_BITS)) - MAX_LEVEL, iz, ir


@njit(**EXACT)
def _level_table(order, keys, h, lattice):
    """Return `levels` and `rows` of `CellOrder`."""
    levels = np.empty((2 * MAX_LEVEL + 1, 2))
    rows = np.empty((2 * MAX_LEVEL + 1, 3), np.int64)
    count = 0
    before = -MAX_LEVEL - 1
    first_row = 0
    for i in range(order.size):
        level, iz, _ = _split_key(keys[order[i]])
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


@njit(**EXACT)
def _column_table(order, keys, rows):
    """Return `columns` of `CellOrder`; empty rows get no cells."""
    n_rows = rows[-1, 1] + rows[-1, 2] if rows.shape[0] > 0 else 0
    columns = np.zeros((n_rows, 3), np.int64)
    lev = -1
    before = -MAX_LEVEL - 1
    for i in range(order.size):
        level, iz, ir = _split_key(keys[order[i]])
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


@njit(**EXACT)
def _cell_starts(order, keys, rows, columns, n_starts):
    """Return `starts` of `CellOrder` by counting."""
    starts = np.zeros(n_starts + 1, np.int64)
    lev = -1
    before = -MAX_LEVEL - 1
    for i in range(order.size):
        level, iz, ir = _split_key(keys[order[i]])
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
    return CellOrder(order, levels, rows, columns, starts)


@njit(**EXACT)
def _search(cells, owned, r, z, h, kappa, self_term, start, index):
    """Fill `start` and, as far as it has room, `index`; return the room needed."""
    found = 0
    cut2 = 0.25 * kappa * kappa
    for k in range(owned.size):
        a = owned[k]
        start[k] = found
        r_a, z_a, h_a = r[a], z[a], h[a]
        for lev in range(cells.levels.shape[0]):
            size = cells.levels[lev, 0]
            reach = 0.5 * kappa * (h_a + cells.levels[lev, 1]) * SLACK
            first, n_rows, base = cells.rows[lev]
            low = max(math.floor((z_a - reach) / size), first)
            high = min(math.floor((z_a + reach) / size), first + n_rows - 1)
            for iz in range(low, high + 1):
                ir_0, n_cells, cell = cells.columns[base + iz - first]
                if n_cells == 0:
                    continue
                gap = max(iz * size - z_a, z_a - (iz + 1) * size, 0.0)
                half = math.sqrt(max(reach * reach - gap * gap, 0.0)) * SLACK
                left = max(math.floor((r_a - half) / size) - ir_0, 0)
                right = min(math.floor((r_a + half) / size) - ir_0, n_cells - 1)
                if right < left:
                    continue
                for b in range(
                    cells.starts[cell + left], cells.starts[cell + right + 1]
                ):
                    dr = r_a - r[b]
                    dz = z_a - z[b]
                    h_ab = h_a + h[b]
                    near = dr * dr + dz * dz < cut2 * h_ab * h_ab
                    if near and (self_term or b != a):
                        if found < index.size:
                            index[found] = b
                        found += 1
    start[owned.size] = found
    return found


def find_neighbours(
    cells: CellOrder,
    slot: IntArray,
    r: FloatArray,
    z: FloatArray,
    h: FloatArray,
    kappa: float,
    self_term: bool,
    room: int,
) -> NeighbourList:
    """Find the neighbours within ``kappa (h_a + h_b)/2`` of each owned particle.

    Parameters
    ----------
    cells : CellOrder
    slot : ndarray of int64, shape (n,)
        Negative for ghosts, which need no list.
    r, z, h : ndarray of float64, shape (n,)
        Positions and smoothing lengths in the global order [m].
    kappa : float
        Cut of the kernel.
    self_term : bool
        Whether a particle is a neighbour of itself (R1).
    room : int
        Expected total of neighbours; more is found by a second pass.
    """
    owned = np.flatnonzero(slot >= 0)
    start = np.empty(owned.size + 1, np.int64)
    index = np.empty(room, np.int32)
    found = _search(cells, owned, r, z, h, kappa, self_term, start, index)
    if found > room:
        index = np.empty(found, np.int32)
        _search(cells, owned, r, z, h, kappa, self_term, start, index)
    return NeighbourList(owned, start, index[:found])
