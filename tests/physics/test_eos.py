"""R8, R9: equations of state, against closed forms coded apart."""

import math

import mpmath
import numpy as np
import pytest
from oracles import ALUMINIUM, PRESSURES, approx, pressure_and_slopes, table_of
from scipy.integrate import solve_ivp

from mpisph.physics.eos import GASES
from mpisph.physics.eos import pressure as chosen_pressure
from mpisph.physics.eos.mie_grueneisen import hugoniot_pressure
from mpisph.physics.isentrope import fill_isentrope, on_isentrope
from mpisph.physics.sound import sound_speed

MATERIALS = {kind: ALUMINIUM._replace(eos=kind) for kind in PRESSURES}
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


# Steinberg (1996): three polymers, an alloy with a volume correction of Gamma, and
# aluminium as in the other tests.
HUGONIOTS = {
    "aluminium": ALUMINIUM,
    "nylon": ALUMINIUM._replace(
        rho0=1140.0, c0=2208.0, gamma=0.70, slope=2.83, slope2=-3.18, slope3=1.177
    ),
    "polycarbonate": ALUMINIUM._replace(
        rho0=1196.0, c0=1933.0, gamma=0.61, slope=3.49, slope2=-8.2, slope3=9.6
    ),
    "PMMA": ALUMINIUM._replace(
        rho0=1182.0, c0=2180.0, gamma=0.85, slope=2.088, slope2=-1.124
    ),
    "7075": ALUMINIUM._replace(
        rho0=2803.0, c0=5200.0, gamma=2.20, slope=1.36, gamma_slope=0.48
    ),
}
EACH_HUGONIOT = pytest.mark.parametrize("name", HUGONIOTS)


def shock_velocity(up, mat):
    """Return U of U = c0 + s u + s2 (u/U) u + s3 (u/U)^2 u, to 40 digits."""
    with mpmath.workdps(40):

        def left_over(U):
            x = up / U
            return mat.c0 + (mat.slope + mat.slope2 * x + mat.slope3 * x**2) * up - U

        return mpmath.findroot(left_over, mat.c0 + mat.slope * up)


@EACH_HUGONIOT
@pytest.mark.parametrize("up", [1.0, 100.0, 700.0, 1500.0, 2500.0, 4000.0])
def test_mie_grueneisen_r8_keeps_its_hugoniot(name, up):
    """The states behind shocks, by the jump conditions alone."""
    mat = HUGONIOTS[name]
    U = shock_velocity(up, mat)
    P_H, E_H, m = mat.rho0 * U * up, 0.5 * up**2, float(up / (U - up))
    row = table_of(mat)[0]
    assert m < row.mie_grueneisen.last_compression
    got = hugoniot_pressure(m, mat.rho0, row.mie_grueneisen)[0]
    # Rounding of rho (1e-16) counts for 1/m as much in m.
    assert got == approx(float(P_H), rel=1e-13 + 4e-16 / m)
    got = pressure(mat.rho0 * (1.0 + m), E_H, mat)[0]
    assert got == approx(float(P_H), rel=1e-13 + 4e-16 / m)


@EACH_HUGONIOT
def test_mie_grueneisen_r8_has_the_grueneisen_parameter_of_its_volume(name):
    mat = HUGONIOTS[name]
    for m in (0.0, 0.1, 0.3):
        gamma = (mat.gamma + mat.gamma_slope * m) / (1.0 + m)
        rho = mat.rho0 * (1.0 + m)
        assert pressure(rho, 2e6, mat)[2] == approx(gamma * rho, rel=1e-13)
    assert pressure(0.7 * mat.rho0, 2e6, mat)[2] == approx(mat.gamma * 0.7 * mat.rho0)


@EACH_HUGONIOT
def test_mie_grueneisen_r8_never_turns_over(name):
    """However far matter is compressed, its pressure rises with its density."""
    mat = HUGONIOTS[name]
    eta = np.geomspace(1.0, 30.0, 400)
    row = table_of(mat)[0]
    for E in (0.0, 5e6, 4e7):
        states = [chosen_pressure(x * mat.rho0, E, row) for x in eta]
        P, P_rho, P_E = np.array(states).T
        assert (np.diff(P) > 0.0).all()
        assert (P_rho > 0.0).all()
        assert (P_E > 0.0).all()


@EACH_HUGONIOT
@pytest.mark.parametrize("m", [0.05, 0.3, 1.0, 4.0, 30.0])
def test_mie_grueneisen_r8_agrees_with_its_reference_form(name, m):
    mat = HUGONIOTS[name]
    for E in (0.0, 3e6):
        got = pressure(mat.rho0 * (1.0 + m), E, mat)
        want = pressure_and_slopes(mat.rho0 * (1.0 + m), E, mat)
        # The roots of a polynomial of sixth degree are good to 1e-9.
        np.testing.assert_allclose(got, want, rtol=1e-8)


def test_mie_grueneisen_r8_goes_on_along_its_tangent():
    """Four fifths of the way to the pole, or to where it would stop rising."""
    mat = ALUMINIUM
    end = 0.8 / 0.49
    assert LINE.last_compression == approx(end, rel=1e-13)
    for E in (0.0, 1e7):
        P, slope, _ = pressure(mat.rho0 * (1.0 + end * (1.0 - 1e-15)), E, mat)
        for beyond in (1e-9, 0.1, 10.0):
            further = pressure(mat.rho0 * (1.0 + end + beyond), E, mat)
            assert further[0] == approx(P + slope * mat.rho0 * beyond, rel=1e-12)
            assert further[1] == approx(slope, rel=1e-12)
    # A line of slope 1 or less has no pole.
    flat = table_of(ALUMINIUM._replace(slope=1.0))[0].mie_grueneisen
    assert flat.last_compression == math.inf
    a = 2710.0 * 5350.0**2
    assert hugoniot_pressure(3.0, RHO0, flat) == (approx(12.0 * a), approx(7.0 * a))
    # With b the pressure would turn over before the pole, at m = 0.8/0.36.
    row = table_of(HUGONIOTS["7075"])[0].mie_grueneisen
    assert 1.0 < row.last_compression < 0.8 / 0.36


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


# Melosh (1989), Spheral, Okamoto (2020), Benz and Asphaug (1999): rho0 [kg/m3], A, B
# [Pa], a, b, E0, Es, Es_prime [J/kg], alpha, beta.
TILLOTSONS = {
    name: ALUMINIUM._replace(
        eos="tillotson",
        **dict(
            zip(
                ("rho0", "A", "B", "a", "b", "E0", "Es", "Es_prime", "alpha", "beta"),
                numbers,
                strict=True,
            )
        ),
    )
    for name, numbers in {
        "aluminium": (2700.0, 75.2e9, 65e9, 0.5, 1.63, 5e6, 3e6, 13.9e6, 5.0, 5.0),
        "iron": (7800.0, 128e9, 105e9, 0.5, 1.5, 9.5e6, 2.4e6, 8.67e6, 5.0, 5.0),
        "copper": (8900.0, 139e9, 110e9, 0.5, 1.5, 32.5e6, 1.35e6, 3.0e6, 5.0, 5.0),
        "nylon": (1185.0, 10.1e9, 33.8e9, 0.6, 2.0, 7e6, 2e6, 2.4e6, 10.0, 5.0),
        "polycarbonate": (
            1194.0, 9.2e9, 6.9e9, 0.5, 1.0, 2e6, 0.28e6, 1.3e6, 5.0, 5.0,
        ),
        "basalt": (2700.0, 26.7e9, 26.7e9, 0.5, 1.5, 487e6, 4.72e6, 18.2e6, 5.0, 5.0),
        "ice": (917.0, 9.47e9, 9.47e9, 0.3, 0.1, 10e6, 0.773e6, 3.04e6, 10.0, 5.0),
    }.items()
}  # fmt: skip
EACH_TILLOTSON = pytest.mark.parametrize("name", TILLOTSONS)


@EACH_TILLOTSON
def test_tillotson_r8_pulls_cold_matter_together_however_far_it_expands(name):
    """With B in expansion nylon would push itself apart from 0.7 rho0 on."""
    mat = TILLOTSONS[name]
    eta = np.linspace(0.02, 1.0, 50)
    row = table_of(mat)[0]
    P, P_rho, P_E = np.array([chosen_pressure(x * mat.rho0, 0.0, row) for x in eta]).T
    assert (np.diff(P) > 0.0).all()
    assert P[-1] == 0.0
    np.testing.assert_allclose(P, mat.A * (eta - 1.0), rtol=1e-12, atol=1e-3)
    np.testing.assert_allclose(P_rho, mat.A / mat.rho0, rtol=1e-14)
    assert (P_E > 0.0).all()


@EACH_TILLOTSON
def test_tillotson_r8_slopes_with_density_meet_at_all_borders(name):
    mat = TILLOTSONS[name]
    row = table_of(mat)[0]
    Es, Es_prime = mat.Es, mat.Es_prime
    for E in (0.0, 0.5 * Es, Es, 0.5 * (Es + Es_prime), Es_prime, 2.0 * Es_prime):
        below, above = (
            np.array(chosen_pressure(mat.rho0 * (1.0 + d), E, row))
            for d in (-1e-9, 1e-9)
        )
        np.testing.assert_allclose(above[1:], below[1:], rtol=1e-7)
        assert above[0] - below[0] == approx(2e-9 * mat.rho0 * above[1], rel=1e-5)
    for E in (Es, Es_prime):
        for eta in (0.3, 0.6, 0.9, 0.99):
            below, above = (
                chosen_pressure(eta * mat.rho0, E * (1.0 + d), row)
                for d in (-1e-9, 1e-9)
            )
            size = mat.A * 1e-7
            assert above[0] == approx(below[0], rel=1e-7, abs=size)
            assert above[1] == approx(below[1], rel=1e-6, abs=size / mat.rho0)


@EACH_TILLOTSON
def test_tillotson_r8_has_a_real_sound_speed_wherever_matter_is_whole_or_torn(name):
    """Whole matter bears tension up to 5 % of A and is not hot; torn matter has none.

    But for a loop of ice, which is hot and near to its solid density: the constants
    make its pressure fall there as it is compressed.
    """
    mat = TILLOTSONS[name]
    row = table_of(mat)[0]
    imaginary = []
    for eta in np.geomspace(0.02, 3.0, 60):
        for E in np.geomspace(1e-3 * mat.Es, 20.0 * mat.Es_prime, 40):
            rho = eta * mat.rho0
            P, P_rho, P_E = chosen_pressure(rho, E, row)
            whole = E <= mat.Es and P >= -0.05 * mat.A
            P = P if whole else max(P, 0.0)
            if P_rho + P * P_E / rho**2 <= 0.0:
                imaginary.append((eta, E / mat.Es_prime))
    if name != "ice":
        assert not imaginary
    for eta, share in imaginary:
        assert 0.65 < eta < 0.95
        assert 0.8 < share < 1.5


@EACH_TILLOTSON
def test_the_isentrope_r13_of_tillotson_rises(name):
    mat = TILLOTSONS[name]
    row = table_of(mat)[0]
    fill_isentrope(row, 300.0)
    curve = row.isentrope
    # The slope of the energy is the pressure over rho0.
    for rising in ("energy", "temperature", "energy_slope"):
        assert (np.diff(curve[rising]) > 0.0).all()
    # dE = -P dV, by another integrator.
    x = 0.3

    def slope(x, E):
        return [chosen_pressure(mat.rho0 / (1.0 - x), E[0], row)[0] / mat.rho0]

    solved = solve_ivp(slope, (0.0, x), [0.0], rtol=1e-11, atol=1e-3)
    E, T = on_isentrope(1.0 / (1.0 - x), curve)
    assert solved.y[0, -1] == approx(E, rel=1e-6)
    assert T > 300.0
