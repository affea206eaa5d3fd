"""Which matter has left the game: judged by body, position, velocity and time."""

import numpy as np
import pytest

from mpisph.core.particles import Particles
from mpisph.sph.retirement import Retirement, has_left

RULE = Retirement(np.array([0.05, 0.01]), np.array([2e-6, 1e-6]), 20e-6)
"""Of two bodies: reach [m], time from which it counts and horizon [s]."""


@pytest.mark.parametrize(
    ("body", "z", "u_z", "time", "left"),
    [
        (0, 0.0, 2501.0, 0.0, False),
        (0, 0.0, 0.0, 1.9e-6, False),  # its time has not come
        (0, 0.0, 0.0, 2e-6, True),
        (1, 0.0, 0.0, 1.9e-6, True),  # that of the other body has
        (0, 0.0, 4999.0, 10e-6, True),  # comes to 49.99 mm
        (0, 0.0, 5001.0, 10e-6, False),
        (1, 0.0, 999.0, 10e-6, True),
        (1, 0.0, 1001.0, 10e-6, False),
        (0, 0.049, -1.0, 10e-6, True),
        (0, 0.051, -8000.0, 10e-6, False),  # still there, however it moves
        (0, 0.049, 1e6, 20e-6, True),  # no time is left
        (0, 0.049, 1e6, 25e-6, True),
        (0, 0.051, -1.0, 25e-6, False),
    ],
)
def test_matter_leaves_that_cannot_come_to_where_it_matters(body, z, u_z, time, left):
    p = Particles.zeros(1)
    p.body[:], p.z[:], p.u_z[:] = body, z, u_z
    assert has_left(p, RULE, time).tolist() == [left]


def test_each_particle_is_judged_by_itself():
    p = Particles.zeros(200)
    rng = np.random.default_rng(3)
    p.body[:] = rng.integers(0, 2, p.n)
    p.z[:], p.u_z[:] = rng.uniform(-0.02, 0.06, p.n), rng.normal(0.0, 3e3, p.n)
    left = has_left(p, RULE, 5e-6)
    assert 20 < left.sum() < 180
    for i in range(p.n):
        assert has_left(p.take(np.array([i])), RULE, 5e-6)[0] == left[i]


def test_of_no_particles_none_has_left():
    assert has_left(Particles.zeros(0), RULE, 5e-6).size == 0
