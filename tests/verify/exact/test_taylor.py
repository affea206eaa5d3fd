"""Taylor's test, against the motion of its rigid part."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from mpisph.verify.exact.taylor import (
    RODS_6061_T6,
    final_length,
    stopped_length,
    strength_of,
)


def test_the_rear_is_stopped_by_the_yield_strength_above_the_foot():
    L0, rho, Y, U = 0.03, 8930.0, 4e8, 190.0

    def rates(_, y):
        length, speed = y
        return -speed, -Y / (rho * (length - 0.12 * L0))

    def still(_, y):
        return y[1]

    still.terminal = True
    found = solve_ivp(rates, (0, 1e-3), (L0, U), events=still, rtol=1e-10, atol=1e-12)
    end = found.y_events[0][0][0]
    assert final_length(L0, rho, Y, U) == pytest.approx(end, rel=1e-8)
    assert final_length(L0, rho, Y, 0.0) == L0


def test_a_front_at_the_wall_is_the_limit_of_one_above_it():
    rho, Y, U = 2700.0, 5e8, 300.0
    above = final_length(1.0, rho, Y, U)
    assert stopped_length(rho, Y, U) == pytest.approx((above - 0.12) / 0.88, rel=1e-12)


def test_measured_rods_scatter_by_a_hundredth_about_the_best_fit():
    rods = [rod for rods in RODS_6061_T6.values() for rod in rods]
    assert len(rods) == 57

    def misses(Y):
        return np.array([stopped_length(2700.0, Y, U) - ratio for U, ratio in rods])

    best = strength_of(2700.0)
    assert best == pytest.approx(526e6, rel=1e-3)
    assert math.sqrt(np.mean(misses(best) ** 2)) == pytest.approx(0.0098, abs=1e-4)
    assert np.abs(misses(best)).max() == pytest.approx(0.023, abs=1e-3)
    for other in (0.99 * best, 1.01 * best):
        assert np.sum(misses(other) ** 2) > np.sum(misses(best) ** 2)
