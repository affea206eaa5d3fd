"""Cuts of the r-z domain into parts, one a rank, that hold equal work.

The domain is bisected along z or r, and each half again, until there are as many parts
as ranks (orthogonal recursive bisection: Berger, Bokhari 1987, IEEE Trans. Comput. 36,
570-580). A particle belongs to the rank in whose part it was at the last migration.
Between migrations it may drift out: the halo follows the particles, not the edges.
"""

import math
from collections.abc import Iterator
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.core.particles import FloatArray, IntArray

CutMode = Literal["auto", "z", "r"]

BINS = 16384
"""Bins of the work histogram of all groups together."""

FEWEST_BINS = 512
"""Bins of one group at least."""

OFFSET = 0.5 * (math.sqrt(5.0) - 1.0)
"""Where in its bin the first particle lies. Particles start in layers, and no layer of
few should lie on a border, where rounding decides; an irrational share sees to it."""

GHOST_WORK = 8.0
"""Work of receiving and sorting a ghost, in units of a pair (100 ns)."""

SWITCH_GAIN = 0.2
"""Share of its cost that a cut in the other direction than before must save."""


class Level(NamedTuple):
    """Cuts of groups of parts into halves; arrays of shape (groups,).

    Attributes
    ----------
    along_r : ndarray of bool
        Whether a group is cut along r; else along z.
    edges : ndarray
        Where [m]; a particle on an edge lies above it. NaN for a single part.
    halves : ndarray of int64
        Which group of the next level is the lower half; the upper one follows it.
    """

    along_r: npt.NDArray[np.bool_]
    edges: FloatArray
    halves: IntArray


Cut = tuple[Level, ...]
"""Levels from the whole domain down to parts, which belong to the ranks in order."""


def owners(cut: Cut, r: FloatArray, z: FloatArray) -> IntArray:
    """Return the rank in whose part each particle lies, shape (n,).

    Parameters
    ----------
    cut : Cut
    r, z : ndarray, shape (n,)
        Positions [m].
    """
    group = np.zeros(z.size, np.int64)
    for level in cut:
        group = _divided(level, group, r, z)
    return group


def _divided(level: Level, group: IntArray, r: FloatArray, z: FloatArray) -> IntArray:
    """Return the halves in which particles of groups lie, as groups of the next."""
    x = np.where(level.along_r[group], r, z)
    return np.asarray(level.halves[group] + (x >= level.edges[group]))


def part_work(comm: MPI.Intracomm, owner: IntArray, work: FloatArray) -> FloatArray:
    """Return the work of each rank, were the particles owned so, shape (ranks,).

    Parameters
    ----------
    comm : MPI.Intracomm
    owner : ndarray of int64, shape (n,)
        Rank for each particle that this rank owns now.
    work : ndarray, shape (n,)
        Whole numbers.
    """
    return _sums(comm, owner, work, comm.size)


def equal_work_cut(
    comm: MPI.Intracomm, r: FloatArray, z: FloatArray, reach: FloatArray,
    work: FloatArray, parts: int, mode: CutMode = "auto", current: Cut = (),
) -> Cut:  # fmt: skip
    """Return a cut into parts of equal work, the same on all ranks.

    Each group is cut in that direction in which the cut costs less: ghosts, and work
    that it cannot share out, for it never divides a layer of equal positions.

    Parameters
    ----------
    comm : MPI.Intracomm
    r, z : ndarray, shape (n,)
        Positions of the owned particles, finite [m].
    reach : ndarray, shape (n,)
        How far each reaches (see `halo.reach`) [m].
    work : ndarray, shape (n,)
        Work of each, whole numbers: their sum has no rounding.
    parts : int
    mode : {"auto", "z", "r"}, optional
        Along either, or along one alone.
    current : Cut, optional
        Whose directions are kept unless the others save `SWITCH_GAIN`.
    """
    group, cut = np.zeros(z.size, np.int64), []
    ways = {"auto": (0, 1), "z": (0,), "r": (1,)}[mode]
    for number, (below, size) in enumerate(_halvings(parts)):
        edges, costs = np.full((2, 2, below.size), np.inf)
        for way in ways:
            x = (z, r)[way]
            edges[way], lost = _bisect(comm, x, work, group, below / size)
            near = (np.abs(x - edges[way][group]) < 2.0 * reach).astype(np.float64)
            ghosts = _sums(comm, group, near, below.size)
            costs[way] = GHOST_WORK * ghosts + lost
        kept = current[number].along_r if number < len(current) else None
        along_r = _is_along_r(costs, kept)
        divided = below > 0
        halves = np.concatenate([[0], np.cumsum(1 + divided)[:-1]])
        chosen = np.where(along_r, edges[1], edges[0])
        level = Level(along_r, np.where(divided, chosen, np.nan), halves)
        group = _divided(level, group, r, z)
        cut.append(level)
    return tuple(cut)


def _is_along_r(
    costs: FloatArray, kept: npt.NDArray[np.bool_] | None
) -> npt.NDArray[np.bool_]:
    """Say which groups to cut along r, for cuts along z and r cost so much."""
    along_z, along_r = costs
    if kept is None:
        return np.asarray(along_r < along_z)
    enough = 1.0 - SWITCH_GAIN
    leaves_z, keeps_r = along_r < enough * along_z, along_z >= enough * along_r
    return np.asarray(np.where(kept, keeps_r, leaves_z))


def _halvings(parts: int) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield, by levels, how many parts of each group lie below its cut, and in all."""
    sizes = np.array([parts])
    while sizes.max() > 1:
        below = sizes // 2
        yield below, sizes
        halves = np.stack([below, sizes - below], axis=1).ravel()
        sizes = halves[halves > 0]


def _bisect(
    comm: MPI.Intracomm, x: FloatArray, work: FloatArray, group: IntArray,
    share: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return where to cut groups along `x` so that a share of the work lies below.

    Parameters
    ----------
    share : ndarray, shape (groups,)

    Returns
    -------
    edges : ndarray, shape (groups,)
    lost : ndarray, shape (groups,)
        Work by which the lower half misses its share.
    """
    groups = share.size
    bins = max(BINS // groups, FEWEST_BINS)
    low, high = extent(comm, x, group, groups)
    width = (high - low) / (bins - 1)
    low = low - OFFSET * width
    scaled = (x - low[group]) / np.where(width > 0.0, width, 1.0)[group]
    inside = np.minimum(scaled.astype(np.int64), bins - 1)
    histogram = _sums(comm, group * bins + inside, work, groups * bins)
    border, lost = nearest_border(histogram.reshape(groups, bins), share)
    return low + width * border, lost


def extent(
    comm: MPI.Intracomm, x: FloatArray, group: IntArray, groups: int
) -> tuple[FloatArray, FloatArray]:
    """Return the smallest and the largest `x` of each group over all ranks.

    Parameters
    ----------
    comm : MPI.Intracomm
    x : ndarray, shape (n,)
    group : ndarray of int64, shape (n,)
    groups : int

    Returns
    -------
    low, high : ndarray, shape (groups,)
        Zero for a group that is empty everywhere.
    """
    ends = np.full((2, groups), -np.inf)
    np.maximum.at(ends[0], group, -x)
    np.maximum.at(ends[1], group, x)
    comm.Allreduce(MPI.IN_PLACE, ends, MPI.MAX)
    low, high = np.where(np.isfinite(ends), ends, 0.0)
    return -low, high


def nearest_border(work: FloatArray, share: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return the borders between bins below which a share of the work lies, nearly.

    Parameters
    ----------
    work : ndarray, shape (groups, bins)
    share : ndarray, shape (groups,)

    Returns
    -------
    border : ndarray of int64, shape (groups,)
        Border `k` lies below bin `k`.
    missed : ndarray, shape (groups,)
        Work by which what lies below it differs from the share.
    """
    below = np.pad(work.cumsum(axis=1), ((0, 0), (1, 0)))
    target = below[:, -1] * share
    after = (below < target[:, None]).sum(axis=1)
    near = np.stack([np.maximum(after - 1, 0), after])
    missed = np.abs(np.take_along_axis(below, near.T, axis=1).T - target)
    nearest = missed.argmin(axis=0)
    group = np.arange(target.size)
    return near[nearest, group], missed[nearest, group]


def _sums(
    comm: MPI.Intracomm, group: IntArray, weights: FloatArray, groups: int
) -> FloatArray:
    """Return the sum of each group over all ranks."""
    # Of an empty rank bincount returns integers, whatever the weights.
    sums = np.bincount(group, weights=weights, minlength=groups).astype(np.float64)
    comm.Allreduce(MPI.IN_PLACE, sums, MPI.SUM)
    return sums
