"""The point explosion, against printed values and the equations of motion."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from mpisph.verify.exact.sedov import sedov


def test_the_energy_is_as_printed():
    """Kamm and Timmes (2007), table 1: the shock is at 1 at t = 1."""
    assert sedov(1.4).alpha == pytest.approx(0.851072, rel=2e-5)


@pytest.mark.parametrize("gamma", [1.4, 5.0 / 3.0])
def test_states_behind_the_shock_are_those_of_a_strong_one(gamma):
    rho, u, P = sedov(gamma).at([0.4999999, 0.5000001], 0.5, 2.0)
    speed = 0.4 * 0.5 / 2.0
    assert rho == pytest.approx([(gamma + 1) / (gamma - 1), 1.0], rel=1e-4)
    assert u == pytest.approx([2 / (gamma + 1) * speed, 0.0], rel=1e-4)
    assert P == pytest.approx([2 / (gamma + 1) * speed**2, 0.0], rel=1e-4)


@pytest.mark.parametrize("gamma", [1.4, 5.0 / 3.0])
def test_mass_and_energy_are_those_that_were_there(gamma):
    found = sedov(gamma)
    energy = found.energy(0.7, 3.0)
    r = np.linspace(0.0, 0.7, 200001)[:-1]
    rho, u, P = found.at(r, 0.7, 3.0)
    shells = 4.0 * np.pi * r**2
    assert trapezoid(rho * shells, r) == pytest.approx(4 / 3 * np.pi * 0.7**3, rel=1e-4)
    inside = trapezoid((0.5 * rho * u**2 + P / (gamma - 1)) * shells, r)
    assert inside == pytest.approx(energy, rel=1e-4)


@pytest.mark.parametrize("gamma", [1.4, 5.0 / 3.0])
def test_it_obeys_the_equations_of_motion(gamma):
    """Finite differences in r and t of what `at` returns, with R = t^(2/5)."""
    found = sedov(gamma)
    r, t, step = np.linspace(0.3, 0.95, 40), 1.0, 1e-3

    def state(r, t):
        return np.array(found.at(r, t**0.4, t))

    dr = (state(r + step, t) - state(r - step, t)) / (2 * step)
    dt = (state(r, t + step) - state(r, t - step)) / (2 * step)
    rho, u, P = state(r, t)
    mass = dt[0] + u * dr[0] + rho * (dr[1] + 2 * u / r)
    motion = dt[1] + u * dr[1] + dr[2] / rho
    heat = dt[2] + u * dr[2] + gamma * P * (dr[1] + 2 * u / r)
    assert mass == pytest.approx(0.0, abs=2e-3 * np.abs(dt[0]).max())
    assert motion == pytest.approx(0.0, abs=2e-3 * np.abs(dt[1]).max())
    assert heat == pytest.approx(0.0, abs=2e-3 * np.abs(dt[2]).max())
