"""Taylor's test, against the motion of its rigid part."""

import pytest
from scipy.integrate import solve_ivp

from mpisph.verify.exact.taylor import final_length


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
