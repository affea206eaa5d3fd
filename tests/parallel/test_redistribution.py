"""Particles sent from rank to rank."""

import numpy as np
import pytest
from mpi4py import MPI

from mpisph.core.particles import Particles
from mpisph.parallel.redistribution import block_starts, by_id_blocks, gather_all

SELF = MPI.COMM_SELF


def numbered(ids, seed=0):
    """Particles whose every field is a known function of the id."""
    ids = np.asarray(ids, np.int64)
    p = Particles.zeros(len(ids))
    p.labels[:] = ids * np.array([[1], [3], [7]])
    p.values[:] = np.sin(ids + np.arange(len(p.values))[:, None] + seed)
    p.id[:] = ids
    return p


def shuffled_share(comm, n, seed):
    """Return this rank's share of 0..n-1, dealt at random; rank 0 gets none."""
    rng = np.random.default_rng(seed)
    owner = rng.integers(min(1, comm.size - 1), comm.size, n)
    ids = rng.permutation(n)
    return ids[owner[ids] == comm.rank]


def same_bits(one, other):
    return np.array_equal(
        np.asarray(one).view(np.int64), np.asarray(other).view(np.int64)
    )


def test_blocks_cover_all_ids_nearly_equally():
    starts = block_starts(10, 4)
    assert starts.tolist() == [0, 2, 5, 7, 10]
    assert block_starts(2, 4).tolist() == [0, 0, 1, 1, 2]


def test_blocks_on_one_rank_sort():
    ids = np.random.default_rng(5).permutation(20)
    got = by_id_blocks(SELF, numbered(ids), 20)
    want = numbered(np.arange(20))
    np.testing.assert_array_equal(got.labels, want.labels)
    np.testing.assert_array_equal(got.values, want.values)


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("n", [0, 1, 3, 1000])
def test_blocks_hold_their_ids_with_all_fields(n):
    comm = MPI.COMM_WORLD
    got = by_id_blocks(comm, numbered(shuffled_share(comm, n, 7)), n)
    first = comm.rank * n // comm.size
    last = (comm.rank + 1) * n // comm.size
    want = numbered(np.arange(first, last))
    assert same_bits(got.labels, want.labels)
    assert same_bits(got.values, want.values)


@pytest.mark.mpi(min_size=2)
def test_blocks_with_particles_missing():
    comm = MPI.COMM_WORLD
    ids = shuffled_share(comm, 100, 8)
    got = by_id_blocks(comm, numbered(ids[ids % 3 == 0]), 100)
    everyone = np.concatenate(comm.allgather(got.id))
    assert everyone.tolist() == list(range(0, 100, 3))


@pytest.mark.mpi(min_size=2)
@pytest.mark.parametrize("stray", [-1, 8])
def test_an_id_out_of_range_is_refused_on_all_ranks(stray):
    comm = MPI.COMM_WORLD
    ids = [stray] if comm.rank == 1 else []
    with pytest.raises(ValueError, match="n_total - 1 = 7"):
        by_id_blocks(comm, numbered(ids), 8)


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("n", [0, 1, 500])
def test_gather_all_on_any_root(n):
    comm = MPI.COMM_WORLD
    root = comm.size - 1
    got = gather_all(comm, numbered(shuffled_share(comm, n, 9)), root)
    assert (got is None) == (comm.rank != root)
    if got is not None:
        want = numbered(np.arange(n))
        assert same_bits(got.labels, want.labels)
        assert same_bits(got.values, want.values)
