"""Spall, against integrals and equations of motion."""

import numpy as np
import pytest
from oracles import approx
from scipy.integrate import solve_ivp

from mpisph.verify.exact.shocks import Matter
from mpisph.verify.exact.spall import Crack, pull_back_of_solid, velocity_in_tension

RHO0, C0 = 2700.0, 5350.0
CRACK = Crack(2.2e9, 1.2e9, 2e4, RHO0 * C0)


def test_the_velocity_in_tension_is_that_of_a_simple_wave():
    """Of P = K (rho/rho0 - 1): c is constant, du = c drho/rho."""
    K = RHO0 * C0**2
    matter = Matter(RHO0, lambda rho, _: K * (rho / RHO0 - 1.0))
    want = -C0 * np.log(1.0 - 3e9 / K)
    assert velocity_in_tension(matter, 3e9) == approx(want, rel=1e-6)
    assert velocity_in_tension(matter, 1e6) == approx(1e6 / (RHO0 * C0), rel=1e-4)


def test_the_energy_of_an_isentrope_counts():
    """Of a gas about a pressure: P = K ((rho/rho0)**3 - 1)/3, by its energy."""
    K, gamma = RHO0 * C0**2, 3.0
    base = K / gamma

    def pressure(rho, E):
        total = E + base / (gamma - 1.0) / RHO0 + base * (1.0 / RHO0 - 1.0 / rho)
        return (gamma - 1.0) * rho * total - base

    eta = (1.0 - 5e9 / base) ** (1.0 / gamma)
    # The Riemann invariant 2 c/(gamma - 1).
    want = C0 * (1.0 - eta)
    assert velocity_in_tension(Matter(RHO0, pressure), 5e9) == approx(want, rel=1e-5)


def test_matter_that_bears_no_such_tension_has_no_velocity():
    with pytest.raises(ValueError, match="no tension of 2e"):
        velocity_in_tension(Matter(1.0, lambda rho, _: 1e9 * np.sin(rho - 1.0)), 2e9)


def test_the_pull_back_of_a_solid_is_between_those_of_both_waves():
    assert pull_back_of_solid(1.2e9, RHO0, C0, C0) == approx(2.4e9 / (RHO0 * C0))
    found = pull_back_of_solid(1.2e9, RHO0, C0, 6500.0)
    assert 1.2e9 == approx(RHO0 * C0 * 6500.0 / (C0 + 6500.0) * found)


def test_a_crack_opens_by_its_equation_of_motion():
    last = 2.0 * CRACK.energy / CRACK.strength

    def tension(opening):
        return CRACK.strength * max(1.0 - opening / last, 0.0)

    def rates(_, y):
        speed = 2.0 * (CRACK.load - tension(y[0])) / CRACK.impedance
        return [speed, tension(y[0]), tension(y[0]) * speed]

    found = solve_ivp(
        rates, (0.0, CRACK.opened), [0.0, 0.0, 0.0], rtol=1e-10, atol=1e-20
    )
    opening, impulse, work = found.y[:, -1]
    assert opening == approx(last, rel=1e-6)
    assert impulse == approx(CRACK.impulse, rel=1e-6)
    assert work == approx(CRACK.energy, rel=1e-6)
    half = 0.5 * CRACK.opened
    assert CRACK.tension(0.0) == approx(CRACK.strength)
    assert CRACK.tension(CRACK.opened) == approx(0.0, abs=1e-3 * CRACK.strength)
    assert CRACK.tension(-1e-9) == CRACK.tension(2.0 * CRACK.opened) == 0.0
    between = np.interp(half, found.t, found.y[0])
    assert CRACK.tension(half) == approx(tension(between), rel=0.02)
