"""Cuts of the r-z domain into parts, one a rank, that hold equal work.

The domain is cut into slabs along z, and each slab along r into the same number of
columns. A particle belongs to the rank in whose part it was at the last migration.
Between migrations it may drift out: the halo follows the particles, not the edges.
"""

import math
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.core.particles import FloatArray, IntArray

BINS = 16384
"""Bins of the work histogram along z, and along r of all slabs together."""

FEWEST_BINS = 512
"""Bins along r of one slab at least."""

OFFSET = 0.5 * (math.sqrt(5.0) - 1.0)
"""Where in its bin the first particle lies. Particles start in layers, and no layer of
few should lie on a border, where rounding decides; an irrational share sees to it."""


class Cut(NamedTuple):
    """A cut of the domain; part ``slab * columns + column`` belongs to that rank.

    Attributes
    ----------
    z_edges : ndarray, shape (slabs - 1,)
        Inner edges of the slabs, ascending [m]. Slabs may be empty.
    r_edges : ndarray, shape (slabs, columns - 1)
        Inner edges of each slab's columns, ascending [m].
    """

    z_edges: FloatArray
    r_edges: FloatArray

    @property
    def slabs(self) -> int:
        """Number of slabs."""
        return len(self.r_edges)

    @property
    def columns(self) -> int:
        """Number of columns of a slab."""
        return len(self.r_edges.T) + 1


def owners(cut: Cut, r: FloatArray, z: FloatArray) -> IntArray:
    """Return the rank in whose part each particle lies, shape (n,).

    Parameters
    ----------
    cut : Cut
    r, z : ndarray, shape (n,)
        Positions [m].
    """
    slab = np.searchsorted(cut.z_edges, z, side="right").astype(np.int64)
    owner = slab * cut.columns
    for edges in cut.r_edges.T:
        owner += r >= edges[slab]
    return owner


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
    total = _histogram(owner, work, comm.size)
    comm.Allreduce(MPI.IN_PLACE, total, MPI.SUM)
    return total


def equal_work_cut(
    comm: MPI.Intracomm, r: FloatArray, z: FloatArray, work: FloatArray,
    slabs: int, columns: int,
) -> Cut:  # fmt: skip
    """Return a cut into parts of equal work, the same on all ranks.

    Parameters
    ----------
    comm : MPI.Intracomm
    r, z : ndarray, shape (n,)
        Positions of the owned particles [m].
    work : ndarray, shape (n,)
        Work of each, whole numbers: their sum has no rounding.
    slabs, columns : int
    """
    everywhere = np.zeros(z.size, np.int64)
    (z_edges,) = _equal_work_edges(comm, z, work, everywhere, (1, slabs), BINS)
    slab = np.searchsorted(z_edges, z, side="right").astype(np.int64)
    bins = max(BINS // slabs, FEWEST_BINS)
    return Cut(z_edges, _equal_work_edges(comm, r, work, slab, (slabs, columns), bins))


def _equal_work_edges(
    comm: MPI.Intracomm, x: FloatArray, work: FloatArray, group: IntArray,
    shape: tuple[int, int], bins: int,
) -> FloatArray:  # fmt: skip
    """Return inner edges along `x` that share out the work of each group equally.

    Parameters
    ----------
    shape : tuple of int
        Number of groups, and of parts of each.

    Returns
    -------
    ndarray, shape (groups, parts - 1)
    """
    groups, parts = shape
    if parts == 1:
        return np.empty((groups, 0))
    low, high = extent(comm, x, group, groups)
    width = (high - low) / (bins - 1)
    low = low - OFFSET * width
    scaled = (x - low[group]) / np.where(width > 0.0, width, 1.0)[group]
    inside = np.minimum(scaled.astype(np.int64), bins - 1)
    histogram = _histogram(group * bins + inside, work, groups * bins)
    comm.Allreduce(MPI.IN_PLACE, histogram, MPI.SUM)
    borders = np.array([equal_shares(h, parts) for h in histogram.reshape(groups, -1)])
    return np.asarray(low[:, None] + width[:, None] * borders)


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


def equal_shares(work: FloatArray, parts: int) -> IntArray:
    """Return the borders between bins that come nearest to equal shares of the work.

    Parameters
    ----------
    work : ndarray, shape (bins,)
    parts : int

    Returns
    -------
    ndarray of int64, shape (parts - 1,)
        Border `k` lies below bin `k`.
    """
    below = np.concatenate([[0.0], np.cumsum(work)])
    targets = below[-1] * np.arange(1, parts) / parts
    after = np.searchsorted(below, targets)
    nearer_before = targets - below[after - 1] < below[after] - targets
    return np.asarray(after - nearer_before)


def _histogram(bins: IntArray, weights: FloatArray, size: int) -> FloatArray:
    # Of an empty rank bincount returns integers, whatever the weights.
    return np.bincount(bins, weights=weights, minlength=size).astype(np.float64)
