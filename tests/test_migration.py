"""Particles on their way to their owners."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, bits

from mpisph.migration import migrate
from mpisph.particles import Particles


def everyone(n=500):
    """Particles whose every field has bits of its own, NaN and -0 among them."""
    rng = np.random.default_rng(1)
    p = Particles.zeros(n)
    p.labels[:] = rng.integers(-(2**62), 2**62, p.labels.shape)
    p.values[:] = rng.standard_normal(p.values.shape)
    p.id[:] = rng.permutation(n)
    p.body[:3] = -1
    p.E[:3] = np.nan
    p.u_r[:3] = -0.0
    return p


def table(p):
    """Return all fields as integers, one row a particle, in the order of the ids."""
    return bits(p.pack())[:, np.argsort(p.id)].T


EDGES = {
    "even": lambda size: np.linspace(-1.5, 1.5, size + 1)[1:-1],
    "empty slabs": lambda size: np.full(size - 1, 0.3),
    "all to the first": lambda size: np.full(size - 1, 99.0),
    "all to the last": lambda size: np.full(size - 1, -99.0),
}


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("name", EDGES)
def test_migration_keeps_every_bit_and_gives_each_slab_its_own(name):
    comm = MPI.COMM_WORLD
    p = everyone()
    edges = EDGES[name](comm.size)
    dealt = np.random.default_rng(2).integers(0, comm.size, p.n)
    got = migrate(comm, p.take(dealt == comm.rank), edges)

    bounds = np.concatenate([[-np.inf], edges, [np.inf]])
    low, high = bounds[comm.rank], bounds[comm.rank + 1]
    want = p.take((p.z >= low) & (p.z < high))
    problems = []
    if not np.array_equal(table(got), table(want)):
        problems.append(f"{got.n} particles, meant {want.n}")
    agree(comm, problems)
    assert comm.allreduce(got.n) == p.n


@pytest.mark.mpi(min_size=1)
def test_migration_of_particles_at_home_changes_nothing():
    comm = MPI.COMM_WORLD
    edges = EDGES["even"](comm.size)
    p = everyone()
    dealt = np.random.default_rng(2).integers(0, comm.size, p.n)
    once = migrate(comm, p.take(dealt == comm.rank), edges)
    twice = migrate(comm, once, edges)
    same = np.array_equal(bits(twice.pack()), bits(once.pack()))
    agree(comm, [] if same else ["moved"])


@pytest.mark.mpi(min_size=2)
def test_migration_from_one_rank_and_of_nothing():
    comm = MPI.COMM_WORLD
    p = everyone() if comm.rank == comm.size - 1 else Particles.zeros(0)
    got = migrate(comm, p, EDGES["even"](comm.size))
    none = migrate(comm, Particles.zeros(0), EDGES["even"](comm.size))
    counts = comm.allgather(got.n)
    assert sum(counts) == 500
    assert min(counts) > 0
    agree(comm, ["particles out of nothing"] if none.n else [])
