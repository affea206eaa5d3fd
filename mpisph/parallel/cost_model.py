"""Choosing how many slabs and columns to cut the domain into.

One census counts the particles and their work in cells. On it every possible cut is
tried, and the time of a step modelled from what its slowest part would have to do.
"""

from typing import Literal, NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.core.particles import FloatArray, IntArray
from mpisph.parallel.decomposition import (
    BINS,
    Cut,
    equal_shares,
    equal_work_cut,
    extent,
)
from mpisph.parallel.halo import NOTHING

CutMode = Literal["auto", "z", "zr"]

CELLS = 256
"""Cells of the census along z and along r."""

GHOST_WORK = 8.0
"""Work of receiving and sorting a ghost, in units of a pair (90 ns)."""

MESSAGE_WORK = 1000.0
"""Work of a message to and from one other part, in units of a pair (10 us)."""

SWITCH_GAIN = 0.05
"""Share of the step's time that another number of columns must promise."""


class Census(NamedTuple):
    """Sums over the particles in the cells of a grid, the same on all ranks.

    The borders follow the particles: the rows of cells hold about equally many, and so
    do the columns. A few that fly far away cost no resolution where the others are.

    Attributes
    ----------
    z, r : ndarray, shape (rows + 1,) and (columns + 1,)
        Borders of the cells, strictly ascending [m].
    particles : ndarray, shape (rows, columns)
    work : ndarray, shape (rows, columns)
        In pairs.
    reach : ndarray, shape (rows, columns)
        Sum of how far particles reach on either side [m].
    """

    z: FloatArray
    r: FloatArray
    particles: FloatArray
    work: FloatArray
    reach: FloatArray


def take_census(
    comm: MPI.Intracomm, r: FloatArray, z: FloatArray, reach: FloatArray,
    work: FloatArray,
) -> Census:  # fmt: skip
    """Count the particles of all ranks.

    Parameters
    ----------
    comm : MPI.Intracomm
    r, z : ndarray, shape (n,)
        Positions of the owned particles [m].
    reach : ndarray, shape (n,)
        How far each reaches (see `halo.reach`) [m].
    work : ndarray, shape (n,)
        Work of each, whole numbers.
    """
    z_borders, r_borders = _borders(comm, z), _borders(comm, r)
    rows, columns = z_borders.size - 1, r_borders.size - 1
    row = np.searchsorted(z_borders[1:-1], z, side="right")
    cell = row * columns + np.searchsorted(r_borders[1:-1], r, side="right")
    sums = np.empty((3, rows, columns))
    for k, weights in enumerate((np.ones(z.size), work, reach)):
        counts = np.bincount(cell, weights=weights, minlength=rows * columns)
        sums[k] = counts.reshape(rows, columns)
    comm.Allreduce(MPI.IN_PLACE, sums, MPI.SUM)
    return Census(z_borders, r_borders, *sums)


def _borders(comm: MPI.Intracomm, x: FloatArray) -> FloatArray:
    """Return borders along `x` between which lie about equally many particles."""
    (low,), (high,) = extent(comm, x, np.zeros(x.size, np.int64), 1)
    width = (high - low) / BINS
    if not width > 0.0:
        return np.array([low - 1.0, low + 1.0])
    bins = np.minimum(((x - low) / width).astype(np.int64), BINS - 1)
    histogram = np.bincount(bins, minlength=BINS).astype(np.float64)
    comm.Allreduce(MPI.IN_PLACE, histogram, MPI.SUM)
    inner = np.unique(equal_shares(histogram, CELLS))
    inner = inner[(inner > 0) & (inner < BINS)]
    return np.asarray(low + width * np.concatenate([[0], inner, [BINS]]))


def choices(mode: CutMode, parts: int) -> list[int]:
    """Return the numbers of columns that so many parts can have, ascending.

    Parameters
    ----------
    mode : {"auto", "z", "zr"}
        Any, one, or more than one column; one part has one in any case.
    parts : int
    """
    divisors = [k for k in range(1, parts + 1) if parts % k == 0]
    if mode == "z":
        return [1]
    return divisors[1:] if mode == "zr" and parts > 1 else divisors


def choose_columns(census: Census, mode: CutMode, parts: int, current: int) -> int:
    """Return the number of columns of the fastest cut into so many parts.

    Parameters
    ----------
    census : Census
    mode : {"auto", "z", "zr"}
    parts : int
    current : int
        Number of columns now, kept unless another promises more than `SWITCH_GAIN`;
        0 for none.
    """
    times = {k: modelled_time(census, parts // k, k) for k in choices(mode, parts)}
    best = min(times, key=lambda k: times[k])
    if current in times and times[best] >= (1.0 - SWITCH_GAIN) * times[current]:
        return current
    return best


def fastest_cut(
    comm: MPI.Intracomm, r: FloatArray, z: FloatArray, reach: FloatArray,
    work: FloatArray, *, mode: CutMode, current: int = 0,
) -> Cut:  # fmt: skip
    """Return a cut into parts of equal work, in the number of columns that is fastest.

    Parameters
    ----------
    comm : MPI.Intracomm
        One part is meant for each of its ranks.
    r, z, reach, work : ndarray, shape (n,)
        See `take_census`.
    mode : {"auto", "z", "zr"}
    current : int, optional
        See `choose_columns`.
    """
    possible = choices(mode, comm.size)
    columns = possible[0]
    if len(possible) > 1:
        census = take_census(comm, r, z, reach, work)
        columns = choose_columns(census, mode, comm.size, current)
    return equal_work_cut(comm, r, z, work, comm.size // columns, columns)


def modelled_time(census: Census, slabs: int, columns: int) -> float:
    """Return the time of a step on the slowest part of a cut, in units of a pair.

    Parameters
    ----------
    census : Census
    slabs, columns : int
    """
    part = _part_of_cells(census, slabs, columns)
    parts = slabs * columns
    own, work, reach = (
        np.bincount(part.ravel(), weights=sums.ravel(), minlength=parts)
        for sums in (census.particles, census.work, census.reach)
    )
    boxes = _boxes_of_parts(census, part, parts)
    mean = reach / np.maximum(own, 1.0)
    # A ghost is within the part's reach and its own, taken as equal.
    ghosts = _within(census, _widened(boxes, 2.0 * mean)) - own
    rank_boxes = _widened(boxes, mean)
    times = (
        work + GHOST_WORK * ghosts * (own > 0) + MESSAGE_WORK * _partners(rank_boxes)
    )
    return float(times.max())


def _part_of_cells(census: Census, slabs: int, columns: int) -> IntArray:
    """Return the part that each cell belongs to when the work is shared out equally."""
    part = np.empty_like(census.work, np.int64)
    rows = equal_shares(census.work.sum(axis=1), slabs)
    borders = np.concatenate([[0], rows, [len(part)]])
    for slab in range(slabs):
        these = slice(borders[slab], borders[slab + 1])
        inner = equal_shares(census.work[these].sum(axis=0), columns)
        column = np.searchsorted(inner, np.arange(census.r.size - 1), side="right")
        part[these] = slab * columns + column
    return part


def _boxes_of_parts(census: Census, part: IntArray, parts: int) -> FloatArray:
    """Return the box around the cells of each part that hold particles.

    Returns
    -------
    ndarray, shape (parts, 4)
        Lower and upper z, lower and upper r [m]; as `NOTHING` for an empty part.
    """
    row, column = np.nonzero(census.particles)
    which = part[row, column]
    boxes = np.tile(NOTHING, (parts, 1))
    np.minimum.at(boxes[:, 0], which, census.z[row])
    np.maximum.at(boxes[:, 1], which, census.z[row + 1])
    np.minimum.at(boxes[:, 2], which, census.r[column])
    np.maximum.at(boxes[:, 3], which, census.r[column + 1])
    return boxes


def _partners(rank_boxes: FloatArray) -> IntArray:
    """Return how many others each bounding box meets, shape (parts,)."""
    z_low, z_high, r_low, r_high = rank_boxes.T
    meets = (z_low < z_high[:, None]) & (z_high > z_low[:, None])
    meets &= (r_low < r_high[:, None]) & (r_high > r_low[:, None])
    np.fill_diagonal(meets, False)
    return np.asarray(meets.sum(axis=1))


def _widened(boxes: FloatArray, by: FloatArray) -> FloatArray:
    return np.asarray(boxes + by[:, None] * np.array([-1.0, 1.0, -1.0, 1.0]))


def _within(census: Census, boxes: FloatArray) -> FloatArray:
    """Return the number of particles in each box; cells count by their share."""
    below = np.pad(census.particles.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    z_low, z_high = (_place(census.z, edge) for edge in boxes.T[:2])
    r_low, r_high = (_place(census.r, edge) for edge in boxes.T[2:])
    return (
        _between(below, z_high, r_high) - _between(below, z_low, r_high)
        - _between(below, z_high, r_low) + _between(below, z_low, r_low)
    )  # fmt: skip


def _place(borders: FloatArray, x: FloatArray) -> FloatArray:
    """Return where `x` lies, counted in cells; outside it is the nearer end."""
    return np.asarray(np.interp(x, borders, np.arange(borders.size)))


def _between(table: FloatArray, i: FloatArray, j: FloatArray) -> FloatArray:
    """Interpolate bilinearly in a table at fractional places, shape (n,)."""
    row = np.minimum(i.astype(np.int64), table.shape[0] - 2)
    column = np.minimum(j.astype(np.int64), table.shape[1] - 2)
    a, b = i - row, j - column
    return np.asarray(
        (1.0 - a) * ((1.0 - b) * table[row, column] + b * table[row, column + 1])
        + a * ((1.0 - b) * table[row + 1, column] + b * table[row + 1, column + 1])
    )
