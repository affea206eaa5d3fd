"""What is molten and broken, and how it moves: the same on any number of ranks."""

import math

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree

from mpisph.core.particles import Particles
from mpisph.diagnostics.condition import measure_condition
from mpisph.diagnostics.series import Scales

SCALES = Scales(mass=1e-6, speed=8e3)


def matter(n=300):
    """Three bodies, of which the last has no particles."""
    rng = np.random.default_rng(3)
    p = Particles.zeros(n)
    p.id[:] = np.arange(n)
    p.body[:] = np.arange(n) % 2
    p.m[:] = rng.uniform(1e-9, 1e-6, n)
    p.melt[:] = np.where(p.body == 0, rng.uniform(0.0, 1.0, n), 0.0)
    p.u_z[:] = rng.uniform(-5e3, 5e3, n)
    p.u_r[:] = rng.uniform(-5e3, 5e3, n)
    p.E[:] = rng.uniform(0.0, 1e6, n)
    p.damage[:] = np.where(p.id < 200, 1.0, 0.999)
    return p


def test_shares_are_those_of_the_mass():
    p = matter()
    first, second, empty = measure_condition(MPI.COMM_SELF, p, 3, SCALES)
    for found, mine in ((first, p.body == 0), (second, p.body == 1)):
        mass = math.fsum(p.m[mine])
        assert found.mass == mass
        molten = math.fsum(p.m[mine] * p.melt[mine])
        assert found.molten == pytest.approx(molten / mass, rel=1e-15)
        broken = math.fsum(p.m[mine & (p.damage == 1.0)])
        assert found.broken == pytest.approx(broken / mass, rel=1e-15)
        momentum = math.fsum(p.m[mine] * p.u_z[mine])
        assert found.momentum_z == pytest.approx(momentum, rel=1e-12)
        kinetic = math.fsum(0.5 * p.m[mine] * (p.u_r[mine] ** 2 + p.u_z[mine] ** 2))
        assert found.kinetic_energy == pytest.approx(kinetic, rel=1e-14)
        internal = math.fsum(p.m[mine] * p.E[mine])
        assert found.internal_energy == pytest.approx(internal, rel=1e-14)
    assert second.molten == 0.0
    assert empty.mass == 0.0
    assert math.isnan(empty.molten)


def test_what_is_wholly_broken_is_broken_to_the_last_bit():
    p = matter()
    p.damage[:] = p.melt[:] = 1.0
    for found in measure_condition(MPI.COMM_SELF, p, 2, SCALES):
        assert found.molten == found.broken == 1.0


@pytest.mark.mpi(min_size=2)
def test_the_bits_are_those_of_one_rank():
    comm = MPI.COMM_WORLD
    p = matter()
    want = measure_condition(MPI.COMM_SELF, p, 2, SCALES)
    got = measure_condition(comm, p.take(p.id % comm.size == comm.rank), 2, SCALES)
    agree(comm, [f"{got} {want}"] if got != want else [])
