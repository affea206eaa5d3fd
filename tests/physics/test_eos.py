"""R8, R9: equations of state, against closed forms coded apart."""

import math

import numpy as np
import pytest
from oracles import ALUMINIUM, approx, pressure_and_slopes, table_of
from scipy.integrate import solve_ivp

from mpisph.physics.eos import GASES, MODELS
from mpisph.physics.eos import pressure as chosen_pressure
from mpisph.physics.eos.mie_grueneisen import hugoniot_pressure
from mpisph.physics.sound import sound_speed

MATERIALS = {kind: ALUMINIUM._replace(eos=kind) for kind in MODELS}
EACH = pytest.mark.parametrize("kind", MATERIALS)
RHO0 = ALUMINIUM.rho0
LINE = table_of(ALUMINIUM)[0].mie_grueneisen
ES, ES_PRIME = ALUMINIUM.Es, ALUMINIUM.Es_prime

# Compressed and expanded; cold, between Tillotson's energies, and hot.
STATES = [
    (eta * RHO0, E)
    for eta in (0.2, 0.6, 0.93, 1.07, 1.5, 2.0)
    for E in (-1e6, -1e5, 1e4, 1e6, 2.9e6, 8e6, 14.0e6, 14.2e6, 4e7)
]
NEXT_TO_A_KINK = [
    (eta * RHO0, E + side)
    for eta in (0.6, 0.99999, 1.00001)
    for E in (ES, ES_PRIME)
    for side in (-1.0, 1.0)
]


def pressure(rho, E, mat):
    """Return P, dP/drho, dP/dE as the material has chosen."""
    return chosen_pressure(rho, E, table_of(mat)[0])


@EACH
@pytest.mark.parametrize(("rho", "E"), STATES + NEXT_TO_A_KINK)
def test_pressure_and_derivatives_r8(kind, rho, E):
    mat = MATERIALS[kind]
    got = pressure(rho, E, mat)
    want = pressure_and_slopes(rho, E, mat)
    # Below 1e-13 of each, or of the largest term where terms cancel.
    np.testing.assert_allclose(got, want, rtol=1e-13, atol=4e-15 * mat.A)


@EACH
@pytest.mark.parametrize(("rho", "E"), STATES)
def test_derivatives_r8_by_finite_differences(kind, rho, E):
    mat = MATERIALS[kind]
    _, P_rho, P_E = pressure(rho, E, mat)

    def central(f, step):
        return (8 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12 * step)

    by_rho = central(lambda d: pressure(rho + d, E, mat)[0], 1e-3 * rho)
    by_E = central(lambda d: pressure(rho, E + d, mat)[0], 1e3)
    # Fourth order: (1e-3)^4 times the fifth logarithmic derivative (up to 1e4, for
    # exp(-5 x^2) at eta = 0.2); in E, (1e3/(E0 eta^2 + E))^4. And the rounding of P.
    assert P_rho == approx(by_rho, rel=1e-7, abs=1e-16 * mat.A / (1e-3 * rho))
    assert P_E == approx(by_E, rel=1e-7, abs=1e-15 * mat.A / 1e3)


@pytest.mark.parametrize("eta", [0.05, 0.2])
def test_tillotson_r8_of_a_negative_energy_stays_away_from_the_pole(eta):
    E = -ALUMINIUM.E0 * eta**2
    mat = MATERIALS["tillotson"]
    cold = pressure(eta * RHO0, 0.0, mat)[0]
    linear = (mat.a + mat.b) * eta * RHO0 * E
    assert pressure(eta * RHO0, E, mat)[0] == approx(cold + linear, rel=1e-13)


@EACH
@pytest.mark.parametrize("eta", [0.8, 1.1, 1.6])
def test_sound_speed_r8_is_the_slope_of_the_isentrope(kind, eta):
    mat = MATERIALS[kind]
    rho, E0 = eta * RHO0, 2.0e6
    d = 1e-3 * rho

    def isentrope(to):
        def slope(x, E):
            return [pressure(x, E[0], mat)[0] / x**2]

        solved = solve_ivp(slope, (rho, to), [E0], rtol=1e-12, atol=1e-6)
        return pressure(to, solved.y[0, -1], mat)[0]

    P = [isentrope(rho + k * d) for k in (-2, -1, 1, 2)]
    slope = (8 * (P[2] - P[1]) - (P[3] - P[0])) / (12 * d)
    P_a, P_rho, P_E = pressure(rho, E0, mat)
    c = sound_speed(rho, P_a, P_rho, P_E, 1.0)
    # Fourth order in d = 1e-3, and the solver's 1e-12 over 1e-3.
    assert c == approx(math.sqrt(slope), rel=1e-8)


def test_sound_speed_r8_has_a_floor():
    assert sound_speed(2e3, -1e12, 1e6, 1.0, 53.5) > 53.5
    assert sound_speed(2e3, 0.0, -1e6, 0.0, 53.5) == 53.5
    assert sound_speed(2e3, 4e6, 2e6, 3.0, 0.0) == approx(2000003.0**0.5)


def test_bulk_sound_speed_r8():
    assert MATERIALS["mie-grueneisen"].models.bulk_sound_speed == 5350.0
    linear = MATERIALS["linear"].models.bulk_sound_speed
    tillotson = MATERIALS["tillotson"].models.bulk_sound_speed
    assert linear == approx((72e9 / 2710.0) ** 0.5, rel=1e-15)
    assert tillotson == approx((78.5e9 / 2710.0) ** 0.5, rel=1e-15)
    for kind, mat in MATERIALS.items():
        if kind in GASES:
            continue
        at_rest = sound_speed(RHO0, *pressure(RHO0, 0.0, mat), 1.0)
        assert at_rest == approx(mat.models.bulk_sound_speed, rel=1e-14)


@EACH
def test_pressure_r8_of_the_undisturbed_material_is_zero(kind):
    assert pressure(RHO0, 0.0, MATERIALS[kind])[0] == 0.0


def test_ideal_gas_r8_in_numbers():
    """Air at 20 °C: 1.204 kg/m3 and 210 kJ/kg make one atmosphere and 343 m/s."""
    mat = MATERIALS["ideal-gas"]
    P, P_rho, P_E = pressure(1.204, 210.4e3, mat)
    assert approx(101.33e3, rel=1e-4) == P
    assert sound_speed(1.204, P, P_rho, P_E, 1.0) == approx(343.25, rel=1e-4)
    assert mat.models.bulk_sound_speed == 340.0


@pytest.mark.parametrize("rho", [1e-3, 1.0, 2710.0, 1e5])
def test_sound_speed_r8_of_the_ideal_gas_knows_no_reference_density(rho):
    mat = MATERIALS["ideal-gas"]
    P, P_rho, P_E = pressure(rho, 3.0, mat)
    assert approx(0.4 * rho * 3.0) == P
    assert sound_speed(rho, P, P_rho, P_E, 1e-9) == approx(math.sqrt(1.4 * P / rho))


def on_the_hugoniot(m):
    """Return P, E of the straight line Us = c0 + k up through the jump conditions."""
    # rho0 Us = rho (Us - up) with m = up/(Us - up) gives Us = up (1 + m)/m.
    up = 5350.0 * m / (1.0 + m - 1.49 * m)
    return RHO0 * (5350.0 + 1.49 * up) * up, 0.5 * up**2


def test_mie_grueneisen_r8_keeps_its_hugoniot():
    """The states behind shocks, by the jump conditions alone, up to 12 km/s."""
    mat = MATERIALS["mie-grueneisen"]
    for m in (0.01, 0.1, 0.3, 0.5, 1.0, 1.6):
        P_H, E_H = on_the_hugoniot(m)
        assert hugoniot_pressure(m, RHO0, LINE)[0] == approx(P_H, rel=1e-13)
        assert pressure(RHO0 * (1.0 + m), E_H, mat)[0] == approx(P_H, rel=1e-13)


def test_mie_grueneisen_r8_keeps_gamma_rho_in_compression():
    mat = MATERIALS["mie-grueneisen"]
    for eta in (1.0, 1.3, 3.0):
        assert pressure(eta * RHO0, 2e6, mat)[2] == approx(1.7 * RHO0)
    assert pressure(0.7 * RHO0, 2e6, mat)[2] == approx(1.7 * 0.7 * RHO0)


def test_mie_grueneisen_r8_never_turns_over():
    """However far matter is compressed, its pressure rises with its density."""
    mat = MATERIALS["mie-grueneisen"]
    for E in (0.0, 5e6, 4e7):
        P = [pressure(eta * RHO0, E, mat)[0] for eta in np.linspace(1.0, 30.0, 500)]
        assert np.all(np.diff(P) > 0.0)


def test_hugoniot_pressure_r8_goes_on_along_its_tangent_before_the_pole():
    end = 0.8 / 0.49
    P, slope = hugoniot_pressure(end, RHO0, LINE)
    for beyond in (1e-9, 0.1, 10.0):
        further = hugoniot_pressure(end + beyond, RHO0, LINE)
        want = P + slope * beyond
        assert further == (approx(want, rel=1e-12), approx(slope, rel=1e-12))
    # A line of slope 1 or less has no pole.
    flat = table_of(ALUMINIUM._replace(slope=1.0))[0].mie_grueneisen
    a = 2710.0 * 5350.0**2
    assert hugoniot_pressure(3.0, RHO0, flat) == (approx(12.0 * a), approx(7.0 * a))


def test_hugoniot_pressure_r8_is_linear_in_tension():
    a = 2710.0 * 5350.0**2
    assert hugoniot_pressure(-0.2, RHO0, LINE) == (approx(-0.2 * a), approx(a))
    # P_H and its slope go over into each other at m = 0.
    below, above = (hugoniot_pressure(m, RHO0, LINE) for m in (-1e-9, 1e-9))
    assert above[0] - below[0] == approx(2e-9 * a, rel=1e-7)
    assert above[1] == approx(below[1], rel=1e-8)


@pytest.mark.parametrize("E", [0.0, 1e6, ES, 5e6, 10e6, ES_PRIME, 4e7])
def test_tillotson_r8_is_continuous_at_the_reference_density(E):
    mat = MATERIALS["tillotson"]
    below = pressure(np.nextafter(RHO0, 0.0), E, mat)[0]
    at = pressure(RHO0, E, mat)[0]
    # One unit in the last place of rho moves P by 1e-16 of rho dP/drho.
    assert below == approx(at, rel=1e-14, abs=1e-15 * mat.A)


@pytest.mark.parametrize("eta", [0.3, 0.6, 0.9, 0.999])
@pytest.mark.parametrize("E", [ES, ES_PRIME])
def test_tillotson_r8_is_continuous_at_both_energies(eta, E):
    mat = MATERIALS["tillotson"]
    around = [
        pressure(eta * RHO0, np.nextafter(E, side), mat)[0] for side in (0.0, 1e9)
    ]
    assert around[0] == approx(around[1], rel=1e-14)
    # The branches themselves differ: a wrong energy would show.
    if eta < 0.95:
        other = pressure(eta * RHO0, ES + ES_PRIME - E, mat)[0]
        assert abs(other / around[0] - 1.0) > 0.1
