"""R11: kick, drift and predict, driven as a step drives them."""

import numpy as np
import pytest
from oracles import bits, cloud, predicted_fields
from scipy.linalg import expm

from mpisph.core.particles import INTEGRATED, Particles
from mpisph.sph.integrator import drift, kick

# Linear rates of u_z, rho, E, S_rr, S_zz, h out of z, u_z, rho, E, S_rr, S_zz, h:
# an oscillator, a coupled pair, a damped pair that the position drives, and a decay.
STATE = ("z", "u_z", "rho", "E", "S_rr", "S_zz", "h")
COUPLING = np.array(
    [
        # z   u_z  rho   E   S_rr  S_zz  h
        [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-4.0, -0.3, 0.0, 0.5, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 1.5, 0.0, 0.2, 0.0],
        [0.0, 0.4, -1.5, 0.0, 0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0, 0.0, -0.7, 1.1, 0.0],
        [0.0, 0.0, 0.3, 0.0, -1.1, -0.2, 0.0],
        [0.0, 0.0, 0.0, 0.0, 0.6, 0.0, -0.5],
    ]
)
START = np.array([1.0, 0.5, -0.7, 0.3, 1.2, -0.4, 0.8])


def linear_rates(p, predicted):
    fields = dict(zip(INTEGRATED, predicted, strict=True))
    p.w_z[:] = fields["u_z"]
    state = np.array([p.z, *(fields[name] for name in STATE[1:])])
    rates = COUPLING @ state
    for name, rate in zip(STATE[1:], rates[1:], strict=True):
        p.rates[INTEGRATED.index(name)] = rate


def oscillator_rates(p, predicted):
    """A ball on a spring through the axis, and a stress that follows it (both odd)."""
    u_r = predicted[INTEGRATED.index("u_r")]
    p.w_r[:] = u_r
    p.du_r[:] = -4.0 * p.r
    p.dS_rz[:] = 3.0 * p.r - 0.5 * predicted[INTEGRATED.index("S_rz")]
    p.dE[:] = u_r * u_r


def integrate(p, rates, dt, steps, before=0.5):
    rates(p, p.integrated.copy())
    for _ in range(steps):
        kick(p, before * dt)
        drift(p, dt)
        predicted = predicted_fields(p, (1.0 - before) * dt)
        rates(p, predicted)
        kick(p, (1.0 - before) * dt)


def orders(errors):
    return np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))


@pytest.mark.parametrize(
    ("before", "order", "off"), [(0.5, 2.0, 0.04), (1.0, 1.0, 0.09)]
)
def test_a_step_r11_is_of_second_order_in_every_field(before, order, off):
    """Or, where all of the kick comes first, of first order."""
    end = 2.0
    want = expm(COUPLING * end) @ START
    errors = []
    for steps in (200, 400, 800):
        p = Particles.zeros(3)
        for name, value in zip(STATE, START, strict=True):
            getattr(p, name)[:] = value
        p.r[:] = 1.0
        integrate(p, linear_rates, end / steps, steps, before)
        got = np.array([getattr(p, name)[1] for name in STATE])
        errors.append(got - want)
        assert p.r[1] == 1.0
    # The order tends to 2 with the step, and is off in proportion to it (third-order
    # terms): by at most 0.035 and 0.017 here. A first-order slip shows as 1. That of
    # first order tends to 1 likewise: by 0.088 and 0.042.
    np.testing.assert_allclose(orders(np.array(errors)), order, atol=off)
    assert np.abs(errors[-1]).max() < (1e-4 if order == 2.0 else 1e-2)


def test_a_particle_that_crosses_the_axis_r11_is_reflected():
    """r, u_r and S_rz follow the magnitude and the sign of a Cartesian motion."""
    matrix = np.array([[0.0, 1.0, 0.0], [-4.0, 0.0, 0.0], [3.0, 0.0, -0.5]])
    start = np.array([1.0, 0.3, 0.2])
    end = 5.0
    want = expm(matrix * end) @ start
    assert want[0] < 0.0
    errors = []
    for steps in (100, 200, 400, 800):
        p = Particles.zeros(1)
        p.r[:], p.u_r[:], p.S_rz[:] = start
        crossings = 0
        oscillator_rates(p, p.integrated.copy())
        for _ in range(steps):
            dt = end / steps
            kick(p, 0.5 * dt)
            before = p.u_r[0]
            drift(p, dt)
            crossings += p.u_r[0] != before
            assert p.r[0] >= 0.0
            oscillator_rates(p, predicted_fields(p, 0.5 * dt))
            kick(p, 0.5 * dt)
        assert crossings == 3
        errors.append(np.array([p.r[0], p.u_r[0], p.S_rz[0]]) + want)
    np.testing.assert_allclose(orders(np.array(errors)), 2.0, atol=0.06)


def test_drift_r11_reflects_the_odd_fields_only():
    p = cloud(50, 1)
    rng = np.random.default_rng(2)
    p.rates[:] = rng.uniform(-1.0, 1.0, p.rates.shape)
    p.correction_rates[:] = rng.uniform(-1.0, 1.0, (4, p.n))
    p.r[:] *= 1e-3
    before = p.take(np.arange(p.n))
    tau = 1e-9
    drift(p, tau)
    r = before.r + tau * before.u_r
    crossed = r < 0.0
    assert 3 < crossed.sum() < 47
    sign = np.where(crossed, -1.0, 1.0)
    np.testing.assert_array_equal(p.r, np.abs(r))
    np.testing.assert_array_equal(p.z, before.z + tau * before.u_z)
    odd = {"u_r", "S_rz", "du_r", "dS_rz", "B_rz", "dB_rz"}
    for name in (
        *INTEGRATED,
        "B_rr",
        "B_rz",
        "dB_rr",
        "dB_rz",
        "du_r",
        "du_z",
        "drho",
        "dE",
        "dS_rr",
        "dS_zz",
        "dS_rz",
    ):
        want = getattr(before, name) * (sign if name in odd else 1.0)
        np.testing.assert_array_equal(getattr(p, name), want, err_msg=name)
    for name in ("dh", "m", "div", "P", "id"):
        np.testing.assert_array_equal(getattr(p, name), getattr(before, name))


def test_drift_r11_reflects_at_planes_the_fields_that_are_odd_in_z():
    p = cloud(60, 1)
    rng = np.random.default_rng(2)
    p.rates[:] = rng.uniform(-1.0, 1.0, p.rates.shape)
    p.correction_rates[:] = rng.uniform(-1.0, 1.0, (4, p.n))
    before, low, high = p.take(np.arange(p.n)), -3e-3, 2e-3
    drift(p, 1e-9, low, high)
    z = before.z + 1e-9 * before.u_z
    below, above = z < low, z > high
    assert min(below.sum(), above.sum(), (~below & ~above).sum()) > 3
    want = np.where(below, 2 * low - z, np.where(above, 2 * high - z, z))
    np.testing.assert_array_equal(p.z, want)
    sign = np.where(below | above, -1.0, 1.0)
    odd = {"u_z", "S_rz", "du_z", "dS_rz", "B_rz", "dB_rz"}
    even = {"u_r", "S_rr", "S_zz", "du_r", "dS_rr", "B_rr", "B_zz", "dB_zz", "drho"}
    for name in odd | even:
        want = getattr(before, name) * (sign if name in odd else 1.0)
        np.testing.assert_array_equal(getattr(p, name), want, err_msg=name)


def test_drift_r11_leaves_a_particle_on_the_axis():
    p = Particles.zeros(1)
    p.S_rz[:] = 2.0
    drift(p, 1.0)
    assert p.r[0] == 0.0
    assert p.S_rz[0] == 2.0


def test_kick_and_predict_r11_advance_every_field_with_a_rate():
    p = cloud(20, 3)
    p.rates[:] = np.random.default_rng(4).uniform(-1.0, 1.0, p.rates.shape)
    # Rates for the mean velocity of the kick: no energy is left over.
    p.w_r[:], p.w_z[:] = p.u_r + 0.125 * p.du_r, p.u_z + 0.125 * p.du_z
    before = p.take(np.arange(p.n))
    want = before.integrated + 0.25 * before.rates
    predicted = predicted_fields(p, 0.25)
    np.testing.assert_array_equal(predicted, want)
    np.testing.assert_array_equal(bits(p.values), bits(before.values))
    kick(p, 0.25)
    np.testing.assert_allclose(p.integrated, want, rtol=1e-14)
    for name in ("m", "r", "z", "div", "P"):
        np.testing.assert_array_equal(getattr(p, name), getattr(before, name))
    np.testing.assert_array_equal(p.rates, before.rates)


@pytest.mark.parametrize("tau", [0.25, -0.1, 3.0])
def test_a_kick_r11_conserves_what_its_rates_conserve(tau):
    """Kinetic and internal energy change by the power at the velocities w alone."""
    p = cloud(20, 5)
    rng = np.random.default_rng(6)
    p.rates[:] = rng.uniform(-1e3, 1e3, p.rates.shape)
    p.w_r[:], p.w_z[:] = rng.uniform(-4e3, 4e3, (2, p.n))
    before = 0.5 * (p.u_r**2 + p.u_z**2) + p.E
    kick(p, tau)
    gained = 0.5 * (p.u_r**2 + p.u_z**2) + p.E - before
    want = tau * (p.dE + p.du_r * p.w_r + p.du_z * p.w_z)
    np.testing.assert_allclose(gained, want, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("n", [0, 1])
def test_few_particles(n):
    p = Particles.zeros(n)
    kick(p, 1.0)
    drift(p, 1.0)
    assert predicted_fields(p, 1.0).shape == (8, n)
