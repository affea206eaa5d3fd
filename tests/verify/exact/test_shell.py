"""Verney's shell, against published numbers and its equation of motion."""

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from mpisph.verify.exact.shell import (
    Shell,
    outer_radius,
    plastic_work,
    starting_velocity,
    stopping_time,
    surface_of,
)

BERYLLIUM = Shell(0.08, 0.10, 1845.0, 330e6)


@pytest.mark.parametrize(("stop", "u0"), [(6, 448.3), (5, 545.1), (4, 619.8)])
def test_the_starting_velocity_is_as_published(stop, u0):
    assert starting_velocity(BERYLLIUM, stop / 100) == pytest.approx(u0, rel=2e-4)


def test_the_work_is_that_of_all_spheres():
    """The strain of each sphere from its start, summed over the shell."""
    stop = 0.05

    def work(s):
        now = (s**3 + stop**3 - BERYLLIUM.inner**3) ** (1 / 3)
        return 4 * math.pi * s**2 * 330e6 * 2 * math.log(s / now)

    whole = quad(work, BERYLLIUM.inner, BERYLLIUM.outer)[0]
    assert plastic_work(BERYLLIUM, stop) == pytest.approx(whole, rel=1e-9)


def test_published_form_with_the_thickness():
    """(r_o/r_i)^3 = 1 + W/x^3 with W = 3 a + 3 a^2 + a^3, x = r_i/R_i."""
    a, x = 0.25, 0.6
    W = 3 * a + 3 * a**2 + a**3
    ratio = outer_radius(BERYLLIUM, x * 0.08) / (x * 0.08)
    assert ratio**3 == pytest.approx(1 + W / x**3)


def test_the_shell_stops_where_and_when_its_equation_of_motion_says():
    """Integrate the radial momentum balance between both surfaces, not the energy.

    rho (du/dt) = -d(sigma)/ds - 2 Y/s with u = u_i (r_i/s)^2, inwards yielding.
    """
    rho, Y = BERYLLIUM.density, BERYLLIUM.yield_strength
    stop = 0.05

    def rates(_, y):
        r, u = y
        R = outer_radius(BERYLLIUM, r)
        # The integral over s of the acceleration of u(s, t) = u r^2/s^2.
        by_rate = r**2 * (1 / r - 1 / R)
        by_speed = 2 * r * u**2 * (1 / r - 1 / R) - 0.5 * u**2 * (1 - (r / R) ** 4)
        return u, (2 * Y * math.log(R / r) / rho - by_speed) / by_rate

    def still(_, y):
        return y[1]

    still.terminal, still.direction = True, 1
    start = (BERYLLIUM.inner, -starting_velocity(BERYLLIUM, stop))
    found = solve_ivp(rates, (0, 1), start, events=still, rtol=1e-10, atol=1e-14)
    assert found.y_events[0][0][0] == pytest.approx(stop, rel=1e-6)
    assert found.t_events[0][0] == pytest.approx(
        stopping_time(BERYLLIUM, stop), rel=1e-5
    )


def test_a_surface_is_found_from_any_matter_that_kept_its_volume():
    before = np.linspace(0.08, 0.10, 5)
    now = np.cbrt(before**3 + 0.05**3 - 0.08**3)
    assert surface_of(before, now, 0.08) == pytest.approx(0.05)
    outer = outer_radius(BERYLLIUM, 0.05)
    assert surface_of(before, now, 0.10) == pytest.approx(outer)
