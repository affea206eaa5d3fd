"""Particles on their way to their owners."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, bits, cut_at

from mpisph.core.particles import Particles
from mpisph.parallel.decomposition import owners
from mpisph.parallel.migration import migrate


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


def even(size):
    return np.linspace(-1.5, 1.5, size + 1)[1:-1]


EDGES = {
    "even": even,
    "columns": lambda size: np.linspace(-1, 1, size + 1)[1:-1],
    "empty slabs": lambda size: np.full(size - 1, 0.3),
    "all to the first": lambda size: np.full(size - 1, 99.0),
    "all to the last": lambda size: np.full(size - 1, -99.0),
}


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("name", EDGES)
def test_migration_keeps_every_bit_and_gives_each_part_its_own(name):
    comm = MPI.COMM_WORLD
    p = everyone()
    edges = EDGES[name](comm.size)
    cut = cut_at(*edges, along_r=name == "columns")
    dealt = np.random.default_rng(2).integers(0, comm.size, p.n)
    got = migrate(comm, p.take(dealt == comm.rank), cut)

    x = p.r if name == "columns" else p.z
    bounds = np.concatenate([[-np.inf], edges, [np.inf]])
    low, high = bounds[comm.rank], bounds[comm.rank + 1]
    want = p.take((x >= low) & (x < high))
    problems = []
    if not np.array_equal(table(got), table(want)):
        problems.append(f"{got.n} particles, meant {want.n}")
    agree(comm, problems)
    assert comm.allreduce(got.n) == p.n


@pytest.mark.mpi(min_size=1)
def test_particles_at_home_are_not_even_copied():
    comm = MPI.COMM_WORLD
    cut = cut_at(*even(comm.size))
    p = everyone()
    dealt = np.random.default_rng(2).integers(0, comm.size, p.n)
    once = migrate(comm, p.take(dealt == comm.rank), cut)
    agree(comm, [] if migrate(comm, once, cut) is once else ["copied"])


@pytest.mark.mpi(min_size=2)
def test_stayers_keep_their_places_before_those_who_come():
    comm = MPI.COMM_WORLD
    cut = cut_at(*even(comm.size))
    p = everyone()
    home = owners(cut, p.r, p.z)
    astray = np.where(p.id < 20, (home + 1) % comm.size, home)
    mine = p.take(astray == comm.rank)
    got = migrate(comm, mine, cut)
    stay = mine.take(mine.id >= 20)
    same = np.array_equal(bits(got.pack()[:, : stay.n]), bits(stay.pack()))
    came = (p.id < 20) & (home == comm.rank)
    problems = [] if same else ["stayers moved"]
    if set(got.id[stay.n :].tolist()) != set(p.id[came].tolist()):
        problems.append(f"came: {got.id[stay.n :]}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=2)
def test_migration_from_one_rank_and_of_nothing():
    comm = MPI.COMM_WORLD
    p = everyone() if comm.rank == comm.size - 1 else Particles.zeros(0)
    got = migrate(comm, p, cut_at(*even(comm.size)))
    none = migrate(comm, Particles.zeros(0), cut_at(*even(comm.size)))
    counts = comm.allgather(got.n)
    assert sum(counts) == 500
    assert min(counts) > 0
    agree(comm, ["particles out of nothing"] if none.n else [])
