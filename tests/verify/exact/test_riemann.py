"""The Riemann problem, against printed values and the conservation laws."""

from itertools import pairwise

import numpy as np
import pytest

from mpisph.verify.exact.riemann import GasState, solve_riemann

# Toro (2009), table 4.1: left and right states; table 4.3: P*, u*, rho*L, rho*R.
TORO = [
    ((1.0, 0.0, 1.0), (0.125, 0.0, 0.1), (0.30313, 0.92745, 0.42632, 0.26557)),
    ((1.0, -2.0, 0.4), (1.0, 2.0, 0.4), (0.00189, 0.0, 0.02185, 0.02185)),
    ((1.0, 0.0, 1000.0), (1.0, 0.0, 0.01), (460.894, 19.5975, 0.57506, 5.99924)),
    ((1.0, 0.0, 0.01), (1.0, 0.0, 100.0), (46.0950, -6.19633, 5.99242, 0.57511)),
    (
        (5.99924, 19.5975, 460.894),
        (5.99242, -6.19633, 46.0950),
        (1691.64, 8.68975, 14.2823, 31.0426),
    ),
]


@pytest.mark.parametrize(("left", "right", "printed"), TORO)
def test_the_middle_state_is_as_printed(left, right, printed):
    found = solve_riemann(GasState(*left), GasState(*right), 1.4)
    nearby = 1e-9 * np.abs([left, right]).max()
    states = (found.at(found.u - nearby).rho, found.at(found.u + nearby).rho)
    values = (found.P, found.u, *states)
    assert values == pytest.approx(printed, rel=5e-5, abs=6e-6)


@pytest.mark.parametrize(("left", "right", "_printed"), TORO)
def test_mass_momentum_and_energy_are_conserved(left, right, _printed):
    """The integral over a wide interval changes by the fluxes at its ends alone."""
    g = 1.4
    left, right = GasState(*left), GasState(*right)
    found = solve_riemann(left, right, g)

    def conserved(state):
        e = state.P / (g - 1) + 0.5 * state.rho * state.u**2
        return np.array([state.rho, state.rho * state.u, e])

    def flux(state):
        _, momentum, e = conserved(state)
        return np.array(
            [momentum, momentum * state.u + state.P, (e + state.P) * state.u]
        )

    wide = 100.0
    waves = sorted([-wide, -40.0, found.u, found.shock_speed, wide])
    inside = np.zeros(3)
    for low, high in pairwise(waves):
        s = np.linspace(low, high, 20001)[:-1] + (high - low) / 40000.0
        inside += conserved(found.at(s)).sum(axis=1) * (high - low) / 20000.0
    first = wide * (conserved(left) + conserved(right))
    scale = np.abs(first) + np.abs(flux(left)) + np.abs(flux(right))
    change = (inside - first - flux(left) + flux(right)) / scale
    assert change == pytest.approx(0.0, abs=3e-4)


def test_a_fan_is_smooth_and_its_invariant_constant():
    found = solve_riemann(GasState(1.0, 0.0, 1.0), GasState(0.125, 0.0, 0.1), 1.4)
    s = np.linspace(-1.18, -0.08, 50)
    rho, u, P = found.at(s)
    c = np.sqrt(1.4 * P / rho)
    assert u - c == pytest.approx(s, abs=1e-12)
    assert u + 2.0 * c / 0.4 == pytest.approx(2.0 * np.sqrt(1.4) / 0.4)
    assert P / rho**1.4 == pytest.approx(1.0)


def test_a_vacuum_is_refused():
    away = GasState(1.0, -100.0, 1.0), GasState(1.0, 100.0, 1.0)
    with pytest.raises(ValueError, match="vacuum"):
        solve_riemann(*away, 1.4)
