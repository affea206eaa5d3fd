"""R11: the stable time step."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import SCHEME, approx, cloud

from mpisph.core.particles import Particles
from mpisph.sph.timestep import (
    StepRule,
    allowed_step,
    force_limit,
    heat_limit,
    local_limit,
    signal_limit,
    smoothing_limit,
    step_to,
    strain_limit,
)


def test_signal_limit_r11():
    h, c, rho = 2e-3, 5000.0, 2700.0
    assert signal_limit(h, c, rho, 0.0, 0.0) == approx(4e-7, rel=1e-15)
    # Longitudinal waves of steel: K 160, G 80 GPa: sqrt((160 + 320/3) GPa/rho).
    c = math.sqrt(160e9 / 7800.0)
    want = h / math.sqrt(800e9 / 3.0 / 7800.0)
    assert signal_limit(h, c, 7800.0, 80e9, 0.0) == approx(want, rel=1e-15)
    limit = signal_limit(h, 5000.0, rho, 0.0, 1500.0)
    assert limit == approx(h / (5000.0 + 0.6 * 1500.0), rel=1e-15)


def test_heat_limit_r11():
    # Explicit diffusion: 4 zeta/h^2 is the rate at which a particle's heat goes.
    assert heat_limit(2e-3, 5.0, 1.0) == approx(2e-7, rel=1e-15)
    assert heat_limit(2e-3, 5.0, 10.0) == approx(2e-8, rel=1e-15)
    assert heat_limit(2e-3, 0.0, 1.0) == math.inf


def test_force_limit_r11():
    # A constant acceleration a moves a particle by h/2 within sqrt(h/a).
    assert force_limit(2e-3, 3e9, -4e9) == approx((2e-3 / 5e9) ** 0.5, rel=1e-15)
    assert force_limit(2e-3, 0.0, 0.0) == math.inf


def test_strain_limit_r11():
    assert strain_limit(4e5) == approx(7.5e-7, rel=1e-15)
    assert strain_limit(-4e5) == approx(7.5e-7, rel=1e-15)
    assert strain_limit(0.0) == math.inf


def test_smoothing_limit_r11():
    assert smoothing_limit(2e-3, 4e2) == approx(5e-6, rel=1e-15)
    assert smoothing_limit(2e-3, -4e2) == approx(5e-6, rel=1e-15)
    assert smoothing_limit(2e-3, 0.0) == math.inf


def varied(n, seed):
    p = cloud(n, seed)
    rng = np.random.default_rng(seed)
    p.c[:] = rng.uniform(3e3, 9e3, n)
    p.du_r[:], p.du_z[:] = rng.uniform(-1.0, 1.0, (2, n)) * 1e11
    p.dh[:] = rng.uniform(-1.0, 1.0, n) * 1e3
    p.G[:] = rng.uniform(0.0, 30e9, n)
    p.damping[:] = rng.uniform(0.0, 2e4, n)
    p.crowding[:] = rng.uniform(0.5, 1.5, n)
    return p


@pytest.mark.parametrize("seed", range(5))
def test_local_limit_r11_is_the_smallest_of_all(seed):
    p = varied(200, seed)
    closing = np.where(p.div < 0, -p.div, 0)
    speed = np.sqrt(p.c**2 + 4.0 / 3.0 * p.G / p.rho) + 0.6 * p.damping
    zeta = SCHEME.g1 * p.h * p.c + SCHEME.g2 * p.h**2 * 2.0 * closing
    limits = np.array(
        [
            p.h / speed,
            p.h**2 / (4.0 * zeta * p.crowding),
            np.sqrt(p.h / np.sqrt(p.du_r**2 + p.du_z**2)),
            0.3 / np.abs(p.div),
            p.h / np.abs(p.dh),
        ]
    )
    limit, where = local_limit(p.labels, p.values, SCHEME)
    assert limit == approx(limits.min(), rel=4e-16)
    assert where == np.argmin(limits.min(axis=0))


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("h", 1e-9),
        ("c", 1e9),
        ("G", 1e20),
        ("damping", 1e9),
        ("crowding", 1e6),
        ("du_z", 1e20),
        ("div", 1e15),
        ("dh", -1e15),
    ],
)
def test_local_limit_r11_heeds_every_limit(field, value):
    p = varied(50, 1)
    before = local_limit(p.labels, p.values, SCHEME)
    getattr(p, field)[17] = value
    limit, where = local_limit(p.labels, p.values, SCHEME)
    assert where == 17
    assert limit < 1e-2 * before[0]


def test_local_limit_r11_without_particles():
    p = Particles.zeros(0)
    assert local_limit(p.labels, p.values, SCHEME) == (math.inf, -1)


def test_the_step_r11_that_a_limit_allows():
    automatic = StepRule(fixed=False, longest=math.inf, courant=0.3)
    assert allowed_step(automatic, 2e-8) == 0.3 * 2e-8
    capped = automatic._replace(longest=1e-9)
    assert allowed_step(capped, 2e-8) == 1e-9
    assert allowed_step(capped, 2e-9) == 0.3 * 2e-9
    # A fixed step is made even where it is longer than every limit.
    fixed = StepRule(fixed=True, longest=1e-6, courant=0.3)
    assert allowed_step(fixed, 2e-8) == allowed_step(fixed, math.inf) == 1e-6


@given(remaining=st.floats(1e-9, 1e-3), dt=st.floats(1e-9, 1e-3))
def test_step_to_r11_meets_the_target_without_a_tiny_step(remaining, dt):
    """Steps of at most dt; none below half of it unless the whole rest is."""
    start = remaining
    for _ in range(3):
        step = step_to(remaining, dt)
        assert 0.0 < step <= dt * (1.0 + 1e-11)
        assert step >= 0.5 * min(dt, start) * (1.0 - 1e-11)
        if step == remaining:
            return
        remaining -= step
        # Two equal steps end exactly: half of a float is exact.
        if step < dt:
            assert step_to(remaining, dt) == remaining


def test_step_to_r11_by_hand():
    assert step_to(10.0, 1.0) == 1.0
    assert step_to(2.5, 1.0) == 1.0
    assert step_to(1.9, 1.0) == 0.95
    assert step_to(1.0, 1.0) == 1.0
    assert step_to(0.3, 1.0) == 0.3
    assert step_to(0.3, math.inf) == 0.3
    # A rest that is over by rounding only is no reason for a further step.
    assert step_to(1.0 + 1e-13, 1.0) == 1.0 + 1e-13
    assert step_to(2.0 + 2e-13, 1.0) == approx(1.0, rel=1e-12)
