"""Slabs of equal work."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, approx

from mpisph.decomposition import (
    BINS,
    PARTICLE_WORK,
    equal_work_edges,
    imbalance,
    owners,
    work_of,
)


def test_work_is_that_of_the_pairs_and_a_constant():
    work = work_of(np.array([0.0, 30.0]))
    assert work.tolist() == [PARTICLE_WORK, 30.0 + PARTICLE_WORK]
    assert float(PARTICLE_WORK).is_integer()  # sums of work are exact


def test_imbalance():
    assert imbalance(np.array([1.0, 1.0, 4.0])) == approx(1.0)
    assert imbalance(np.array([2.0, 2.0])) == 0.0
    assert imbalance(np.zeros(3)) == 0.0


def test_owners():
    edges = np.array([-1.0, 2.0, 2.0])
    z = np.array([-9.0, -1.0, 0.0, 1.9, 2.0, 7.0])
    assert owners(z, edges).tolist() == [0, 1, 1, 1, 3, 3]
    assert owners(z, np.empty(0)).tolist() == [0] * 6
    assert owners(np.empty(0), edges).dtype == np.int64


def test_one_rank_has_no_edges():
    z = np.linspace(0.0, 1.0, 7)
    assert equal_work_edges(MPI.COMM_SELF, z, np.ones(7)).size == 0
    assert equal_work_edges(MPI.COMM_SELF, z[:0], z[:0]).size == 0


def distributions():
    """Return z and work of all particles: even, clustered, with far strays."""
    rng = np.random.default_rng(1)
    n = 6000
    even = rng.uniform(-3e-3, 5e-3, n)
    clustered = np.concatenate([rng.normal(0.0, 1e-4, n // 2), rng.uniform(0, 0.1, n)])
    strays = np.concatenate([even, [-0.5, 0.9]])
    for z in (even, clustered, strays):
        yield z, work_of(rng.integers(0, 120, z.size).astype(float))


def share(comm, n):
    """Return a mask of this rank's particles; the last of several ranks has none."""
    owner = np.random.default_rng(2).integers(0, max(comm.size - 1, 1), n)
    return owner == comm.rank


@pytest.mark.mpi(min_size=1)
def test_slabs_have_equal_work_within_a_bin():
    comm = MPI.COMM_WORLD
    problems = []
    for z, work in distributions():
        mine = share(comm, z.size)
        edges = equal_work_edges(comm, z[mine], work[mine])
        if not all(np.array_equal(edges, other) for other in comm.allgather(edges)):
            problems.append(f"ranks disagree: {edges}")
        if edges.shape != (comm.size - 1,) or (np.diff(edges) < 0.0).any():
            problems.append(f"not ascending: {edges}")
        width = (z.max() - z.min()) / BINS
        for k, edge in enumerate(edges):
            below = work[z < edge].sum()
            target = work.sum() * (k + 1) / comm.size
            # The nearer border of the bin that holds the target; a particle on the
            # border itself may be counted on either side.
            bin_work = work[np.abs(z - edge) <= width * (1.0 + 1e-9)].sum()
            if abs(below - target) > bin_work:
                problems.append(f"work below {edge}: {below}, meant {target}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=2)
def test_an_edge_lies_at_the_nearer_border_of_its_bin():
    """Two heavy particles in one bin: the edge goes where less is misplaced."""
    comm = MPI.COMM_WORLD
    z = np.array([0.0, 0.5 + 0.3 / BINS, 1.0])
    mine = slice(None) if comm.rank == 0 else slice(0, 0)
    problems = []
    for before in (9.0, 11.0):
        # Half of all the work lies inside the middle bin, nearer to one of its ends.
        work = np.array([before, 20.0, 20.0 - before])
        edges = equal_work_edges(comm, z[mine], work[mine])
        wanted = 0.5 if before > 10.0 else 0.5 + 1.0 / BINS
        if comm.size % 2 == 0 and abs(edges[comm.size // 2 - 1] - wanted) > 1e-9:
            problems.append(f"edge {edges}, meant {wanted}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_edges_do_not_depend_on_who_owns_what():
    comm = MPI.COMM_WORLD
    z, work = next(distributions())
    mine = share(comm, z.size)
    edges = equal_work_edges(comm, z[mine], work[mine])
    dealt = slice(comm.rank, None, comm.size)
    again = equal_work_edges(comm, z[dealt], work[dealt])
    agree(comm, [] if np.array_equal(edges, again) else [edges, again])


@pytest.mark.mpi(min_size=1)
def test_particles_in_one_place_and_none_at_all():
    comm = MPI.COMM_WORLD
    z = np.full(5, 0.25)
    edges = equal_work_edges(comm, z, np.ones(5))
    nothing = equal_work_edges(comm, z[:0], z[:0])
    problems = []
    if edges.tolist() != [0.25] * (comm.size - 1):
        problems.append(edges)
    if len(set(owners(z, edges).tolist())) != 1:
        problems.append("one place, several owners")
    if nothing.shape != (comm.size - 1,) or np.isnan(nothing).any():
        problems.append(nothing)
    agree(comm, problems)
