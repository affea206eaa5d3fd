"""Slabs along z, one a rank, holding equal work.

A particle belongs to the rank in whose slab it was at the last migration. Between
migrations it may drift out: the halo follows the particles, not the edges.
"""

import numpy as np
from mpi4py import MPI

from mpisph.particles import FloatArray, IntArray

BINS = 16384
"""Bins of the work histogram along z."""

PARTICLE_WORK = 8.0
"""Work of a particle besides its pairs, in units of a pair: what the survey, material,
halo and stepping phases took in shot 4-1353 at NPR 40, over the pairs' time."""


def work_of(neighbours: FloatArray) -> FloatArray:
    """Return the work of particles with so many neighbours, whole numbers."""
    return neighbours + PARTICLE_WORK


def imbalance(work: FloatArray) -> float:
    """Return the largest work of a rank over the mean, less 1.

    Parameters
    ----------
    work : ndarray, shape (ranks,)
    """
    mean = float(work.mean())
    return float(work.max()) / mean - 1.0 if mean > 0.0 else 0.0


def equal_work_edges(
    comm: MPI.Intracomm, z: FloatArray, work: FloatArray
) -> FloatArray:
    """Return the inner edges of slabs of equal work, the same on all ranks.

    Parameters
    ----------
    comm : MPI.Intracomm
    z : ndarray, shape (n,)
        Axial positions of the owned particles [m].
    work : ndarray, shape (n,)
        Work of each, whole numbers: their sum has no rounding.

    Returns
    -------
    ndarray, shape (ranks - 1,)
        Ascending [m]. Slabs may be empty.
    """
    ends = np.array([-np.inf, -np.inf])
    if z.size > 0:
        ends[:] = -z.min(), z.max()
    comm.Allreduce(MPI.IN_PLACE, ends, MPI.MAX)
    low, high = -ends[0], ends[1]
    width = (high - low) / BINS
    if not width > 0.0:
        return np.full(comm.size - 1, high)
    bins = np.minimum(((z - low) / width).astype(np.int64), BINS - 1)
    # Of an empty rank bincount returns integers, whatever the weights.
    histogram = np.bincount(bins, weights=work, minlength=BINS).astype(np.float64)
    comm.Allreduce(MPI.IN_PLACE, histogram, MPI.SUM)
    below = np.concatenate([[0.0], np.cumsum(histogram)])
    targets = below[-1] * np.arange(1, comm.size) / comm.size
    after = np.searchsorted(below, targets)
    nearer_before = targets - below[after - 1] < below[after] - targets
    return np.asarray(low + width * (after - nearer_before))


def owners(z: FloatArray, edges: FloatArray) -> IntArray:
    """Return the rank in whose slab each particle lies.

    Parameters
    ----------
    z : ndarray, shape (n,)
        Axial positions [m].
    edges : ndarray, shape (ranks - 1,)
        Inner edges [m].
    """
    return np.searchsorted(edges, z, side="right").astype(np.int64)
