"""Shares that are molten and broken: by hand, the same on any number of ranks."""

import math

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree

from mpisph.core.particles import Particles
from mpisph.diagnostics.condition import measure_condition


def matter(n=300):
    """Three bodies, of which the last has no particles."""
    rng = np.random.default_rng(3)
    p = Particles.zeros(n)
    p.id[:] = np.arange(n)
    p.body[:] = np.arange(n) % 2
    p.m[:] = rng.uniform(1e-9, 1e-6, n)
    p.melt[:] = np.where(p.body == 0, rng.uniform(0.0, 1.0, n), 0.0)
    p.damage[:] = np.where(p.id < 200, 1.0, 0.999)
    return p


def test_shares_are_those_of_the_mass():
    p = matter()
    first, second, empty = measure_condition(MPI.COMM_SELF, p, 3, p.m.max())
    for found, mine in ((first, p.body == 0), (second, p.body == 1)):
        mass = math.fsum(p.m[mine])
        assert found.mass == mass
        molten = math.fsum(p.m[mine] * p.melt[mine])
        assert found.molten == pytest.approx(molten / mass, rel=1e-15)
        broken = math.fsum(p.m[mine & (p.damage == 1.0)])
        assert found.broken == pytest.approx(broken / mass, rel=1e-15)
    assert second.molten == 0.0
    assert empty.mass == 0.0
    assert math.isnan(empty.molten)


def test_what_is_wholly_broken_is_broken_to_the_last_bit():
    p = matter()
    p.damage[:] = p.melt[:] = 1.0
    for found in measure_condition(MPI.COMM_SELF, p, 2, 1e-6):
        assert found.molten == found.broken == 1.0


@pytest.mark.mpi(min_size=2)
def test_the_bits_are_those_of_one_rank():
    comm = MPI.COMM_WORLD
    p = matter()
    want = measure_condition(MPI.COMM_SELF, p, 2, 1e-6)
    got = measure_condition(comm, p.take(p.id % comm.size == comm.rank), 2, 1e-6)
    agree(comm, [f"{got} {want}"] if got != want else [])
