"""R20: tabulated equations of state, against the closed forms that they are made of."""

import numpy as np
import pytest
import tables
from hypothesis import given
from hypothesis import strategies as st
from oracles import approx
from pydantic import ValidationError
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from tables import GAS_GAMMA, RHO0

from mpisph.materials.model import TABLES
from mpisph.physics.eos.table import States, Tabulated, cell_of, cubic, tabulated
from mpisph.physics.models import record, record_type
from mpisph.verify.exact.shocks import Matter, plane_waves


def row_of(states, rho0, T=300.0):
    """The constants of a table as compiled code takes them."""
    constants = Tabulated(content=states.packed(), reference_temperature=T)
    row = np.zeros(1, record_type(Tabulated))
    row[0] = record(constants, rho0)
    return row[0]


GAS = row_of(tables.ideal_gas(), 1.0)
SOLID = row_of(tables.mie_grueneisen(), RHO0)


@pytest.mark.parametrize("rho", [1e-4, 2e-3, 0.5, 1.0, 17.0, 25.0])
@pytest.mark.parametrize("E", [1e4, 3e5, 5e6, 3e8])
def test_tabulated_r20_is_exact_for_an_ideal_gas(rho, E):
    """Also beyond the table: its pressure is in proportion to both."""
    energy = E - tables.GAS_HEAT * 300.0  # zero at 300 K
    P, P_rho, P_E = tabulated(rho, energy, GAS)
    assert approx((GAS_GAMMA - 1.0) * rho * E, rel=1e-12) == P
    assert P_rho == approx((GAS_GAMMA - 1.0) * E, rel=1e-10)
    assert P_E == approx((GAS_GAMMA - 1.0) * rho, rel=1e-10)


def star(pressure, left, right):
    """Pressure and velocity of Riemann's problem, by the equation of state alone.

    A rarefaction runs into the left state, (rho, E) at rest, a shock into the right.
    """

    def released(P):
        def slope(_, y):
            p, p_rho, p_E = pressure(*y[:2])
            c2 = p_rho + p * p_E / y[0] ** 2
            return [1.0 / c2, p / y[0] ** 2 / c2, -1.0 / (y[0] * np.sqrt(c2))]

        start = [*left, 0.0]
        ends = (pressure(*left)[0], P)
        return solve_ivp(slope, ends, start, rtol=1e-10, atol=1e-12).y[2, -1]

    def shocked(P):
        rho0, E0 = right
        P0 = pressure(rho0, E0)[0]

        def excess(rho):
            volume = 1.0 / rho0 - 1.0 / rho
            return pressure(rho, E0 + 0.5 * (P + P0) * volume)[0] - P

        rho = brentq(excess, rho0 * (1.0 + 1e-9), 5.99 * rho0, xtol=1e-14)
        return np.sqrt((P - P0) * (1.0 / rho0 - 1.0 / rho))

    P = brentq(lambda P: released(P) - shocked(P), 0.11e5, 0.99e5, rtol=1e-10)
    return P, shocked(P)


def test_a_table_r20_of_a_gas_gives_sods_tube():
    """With 1 bar and 1 kg/m3 on the left, 0.1 bar and 1/8 kg/m3 on the right."""
    shift = tables.GAS_HEAT * 300.0
    P, u = star(
        lambda rho, E: tabulated(rho, E, GAS),
        (1.0, 1e5 / 0.4 - shift),
        (0.125, 0.1e5 / 0.4 / 0.125 - shift),
    )
    assert P == approx(0.30313017805e5, rel=1e-7)
    assert u == approx(0.92745262004 * np.sqrt(1e5), rel=1e-7)


@pytest.mark.parametrize("up", [200.0, 1000.0, 3000.0])
def test_a_table_r20_of_a_solid_gives_its_hugoniot(up):
    """Sixty densities: to 2e-5 of the pressure and of the shock's speed."""
    matter = Matter(RHO0, lambda rho, E: tabulated(rho, E, SOLID)[0])
    (wave,) = plane_waves(matter, up)
    U = tables.C0 + tables.SLOPE * up
    assert wave.speed == approx(U, rel=2e-5)
    assert wave.pressure == approx(RHO0 * U * up, rel=2e-5)


def test_a_table_r20_of_a_solid_gives_its_pressure_anywhere():
    """To 1e-4 of it or of the bulk modulus, from 0.8 to 1.7 times the density."""
    rng = np.random.default_rng(1)
    bulk = RHO0 * tables.C0**2
    for _ in range(300):
        m, heat = rng.uniform(-0.2, 0.7), rng.uniform(0.0, 2e7)
        E = heat + tables.cold_energy(m)
        P, P_rho, P_E = tabulated(RHO0 * (1.0 + m), E, SOLID)
        want, gamma_rho = tables.solid_pressure(m, E)
        assert approx(want, rel=1e-4, abs=1e-4 * bulk) == P
        assert P_E == approx(gamma_rho, rel=1e-4)
        assert P_rho > 0.0


@pytest.mark.parametrize("row", [GAS, SOLID], ids=["gas", "solid"])
def test_derivatives_r20_are_those_of_the_interpolation(row):
    rng = np.random.default_rng(2)
    cells = int(row.cells)
    for _ in range(300):
        rho = rng.uniform(0.5 * row.density[0], 1.2 * row.density[cells])
        E = rng.uniform(-1e5, 2e7)
        _, P_rho, P_E = tabulated(rho, E, row)
        d, e = 1e-6 * rho, 1e-7 * (abs(E) + 1e6)
        by_rho, by_E = (
            [tabulated(rho + a, E + b, row) for a, b in steps]
            for steps in (((-d, 0.0), (d, 0.0)), ((0.0, -e), (0.0, e)))
        )
        # A node between both would be a kink.
        if by_rho[0][2] == approx(by_rho[1][2], rel=1e-4) and abs(
            by_rho[0][1] - by_rho[1][1]
        ) < 1e-3 * abs(P_rho):
            slope = (by_rho[1][0] - by_rho[0][0]) / (2.0 * d)
            assert P_rho == approx(slope, rel=1e-4, abs=1e-3)
        if by_E[0][2] == by_E[1][2]:
            slope = (by_E[1][0] - by_E[0][0]) / (2.0 * e)
            assert P_E == approx(slope, rel=1e-4, abs=1e-6)


def test_tabulated_r20_is_continuous_at_the_borders_of_the_table():
    for row in (GAS, SOLID):
        cells = int(row.cells)
        for rho in (row.density[0], row.density[3], row.density[cells]):
            for E in (1e5, 5e6):
                below, above = (
                    tabulated(rho * x, E, row)[0] for x in (1 - 1e-10, 1 + 1e-10)
                )
                assert above == approx(below, rel=1e-7, abs=20.0)


def test_tabulated_r20_is_never_below_the_table():
    least = tables.mie_grueneisen().pressure.min()
    assert least < -10e9
    for rho in (1.0, 0.3 * RHO0, 0.7 * RHO0):
        for E in (-1e7, -1e6, 0.0):
            assert tabulated(rho, E, SOLID)[0] >= least
    # Colder than the table: the pressure of its lowest isotherm.
    cold = tabulated(1.1 * RHO0, -1e6, SOLID)
    assert cold[0] == tabulated(1.1 * RHO0, -5e6, SOLID)[0]
    assert cold[2] == 0.0


@st.composite
def rising_tables(draw):
    """Tables whose pressure rises with density and energy, as unevenly as may be."""
    n, m = draw(st.integers(2, 6)), draw(st.integers(2, 5))
    steps = st.floats(1e-3, 1e3)
    lists = (
        st.lists(steps, min_size=n, max_size=n),
        st.lists(steps, min_size=m, max_size=m),
    )
    density, temperature = (np.cumsum(draw(each)) for each in lists)
    energy = 1e3 * temperature + np.zeros((n, 1))
    rises = draw(
        st.lists(st.just(0.0) | st.floats(1e-3, 1e6), min_size=n * m, max_size=n * m)
    )
    pressure = np.cumsum(np.cumsum(np.reshape(rises, (n, m)), axis=0), axis=1)
    return States(density, temperature, pressure, energy)


@given(rising_tables(), st.data())
def test_tabulated_r20_rises_wherever_the_table_does(states, data):
    T = float(states.temperature[0])
    row = row_of(states, float(states.density[0]), T)
    places = st.floats(0.5 * states.density[0], 1.5 * states.density[-1])
    top = float(states.energy[0, -1] - states.energy[0, 0])
    energies = st.floats(0.0, top)
    rho, E = sorted([data.draw(places), data.draw(places)]), data.draw(energies)
    low, high = (tabulated(x, E, row)[0] for x in rho)
    scale = 1e-9 * float(np.abs(states.pressure).max() + 1e-300)
    assert low <= high + scale
    E2, x = sorted([data.draw(energies), E]), data.draw(places)
    at_nodes = [tabulated(rho_i, e, row)[0] for rho_i in states.density for e in E2]
    assert all(
        a <= b + scale for a, b in zip(at_nodes[::2], at_nodes[1::2], strict=True)
    )
    assert tabulated(x, E, row)[1] >= -scale


def test_cubic_r20_and_its_slope_are_those_of_the_ends():
    def f(x):
        return 2.0 + x - 3.0 * x**2 + 0.5 * x**3

    def slope(x):
        return 1.0 - 6.0 * x + 1.5 * x**2

    for s in (0.0, 0.3, 1.0):
        x = 1.0 + 2.0 * s
        got = cubic(s, 2.0, f(1.0), f(3.0), slope(1.0), slope(3.0))
        assert got == (approx(f(x), abs=1e-14), approx(slope(x), abs=1e-14))


def test_cells_are_found_also_outside_of_the_axis():
    axis = np.array([1.0, 2.0, 4.0, 8.0])
    found = [cell_of(x, axis, 3) for x in (0.0, 1.0, 1.9, 2.0, 7.0, 8.0, 99.0)]
    assert found == [0, 0, 0, 1, 2, 2, 2]


def test_a_table_knows_its_reference_state():
    solid = Tabulated(content=tables.mie_grueneisen().packed())
    gas = Tabulated(content=tables.ideal_gas().packed())
    assert tabulated(RHO0, 0.0, SOLID)[0] == approx(0.0, abs=1.0)
    assert solid.bulk_sound_speed(RHO0) == approx(tables.C0, rel=0.02)
    assert gas.bulk_sound_speed(1.0) == approx(
        np.sqrt(1.4 * 0.4 * tables.GAS_HEAT * 300.0), rel=1e-9
    )
    assert gas.is_gas(1.0)
    assert not solid.is_gas(RHO0)
    assert solid.mistake(RHO0) is None
    assert "rho0 = 9000 kg/m3 is no state of it" in solid.mistake(9000.0)
    cold = Tabulated(content=gas.content, reference_temperature=5.0)
    assert "reference_temperature = 5 K is no state of it" in cold.mistake(1.0)


def test_a_packed_table_keeps_every_bit():
    states = tables.mie_grueneisen()
    again = Tabulated(content=states.packed()).states
    for values, kept in zip(states, again, strict=True):
        np.testing.assert_array_equal(values, kept)
    assert again.digest() == states.digest()
    other = states._replace(pressure=np.nextafter(states.pressure, np.inf))
    assert other.digest() != states.digest()


def test_a_density_of_zero_is_left_to_the_continuation():
    gas = tables.ideal_gas()
    zero = States(
        np.append(0.0, gas.density),
        gas.temperature,
        np.vstack([np.zeros(5), gas.pressure]),
        np.vstack([gas.energy[0], gas.energy]),
    )
    row = row_of(zero, 1.0)
    assert row.cells == 4
    for rho in (1e-5, 0.5):
        assert tabulated(rho, 1e5, row) == tabulated(rho, 1e5, GAS)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({}, "file: required, the file of the table"),
        ({"content": "abc"}, "content: it is no packed table"),
        (
            {"content": tables.ideal_gas().packed(), "digest": "00"},
            "its numbers are not those of the digest",
        ),
        (
            {
                "content": tables.ideal_gas()
                ._replace(temperature=np.array([1.0, 3.0, 2.0, 4.0, 5.0]))
                .packed()
            },
            "temperature: 2 follows 3",
        ),
    ],
)
def test_what_is_no_table_is_refused(data, message):
    with pytest.raises(ValidationError, match=message):
        TABLES["table"](**data)
