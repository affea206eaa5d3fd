"""Curves of materials: closed forms, and shocks that were measured."""

import numpy as np
import pytest
from documents import table_rows, text_of

from mpisph.materials import Material, load_card
from mpisph.materials.curves import (
    equations_of_state,
    fracture_strains,
    isentrope,
    shocks,
    states_at,
    table_of,
    yield_stresses,
)

MARSH = "Marsh (1980), LASL Shock Hugoniot Data"
DUFFY = "Duffy and Ahrens (1997)"
MEASURED = {
    # u_p, U_s [km/s] behind shocks, in the order of the velocities.
    ("cu-ofhc", MARSH): ((0.562, 4.769), (1.480, 6.187), (2.425, 7.654)),
    ("cu-ofhc", MARSH + ", once more"): ((0.945, 5.332), (1.939, 6.875)),
    # On the line 5.349 + 1.338 u_p through 25 states from 7 to 108 GPa.
    ("al-6061-t6", MARSH): ((1.0, 6.687), (2.0, 8.025), (3.0, 9.363)),
    # On the lines 4.58 + 1.49 u_p and 3.31 + 1.306 u_p.
    ("steel-304", DUFFY): ((0.5, 5.325), (1.5, 6.815)),
    ("ta", "Ahrens and Johnson (1995)"): ((0.5, 3.963), (1.5, 5.269)),
    # On 3.994 + 1.2788 u_p - 0.004937 u_p^2 through the data of the IHED data base.
    ("w", "Levashov et al. (2004)"): ((0.5, 4.632), (2.0, 6.532)),
    # On 3.935 + 1.578 u_p, the dense phase.
    ("iron-armco", "Brown, Fritz and Hixson (2000)"): ((1.5, 6.302), (3.0, 8.669)),
}


def shock_velocity(card, eos, u_p):
    found = shocks(table_of(card, eos), 4e3)
    return np.interp(u_p, found.u_p, found.u_s)


@pytest.mark.parametrize(("name", "source"), MEASURED)
def test_shocks_hit_what_was_measured(name, source):
    card = load_card(name)
    u_p, u_s = 1e3 * np.array(MEASURED[name, source]).T
    for eos in equations_of_state(card):
        found = shock_velocity(card, eos, u_p)
        assert found == pytest.approx(
            u_s, rel=0.02 if eos == "mie-grueneisen" else 0.04
        )
    # Copper to the scatter of its data, in pressure and density too.
    if (name, source) == ("cu-ofhc", MARSH):
        found = shocks(table_of(card, "mie-grueneisen"), 4e3)
        P, rho = (
            np.interp(u_p, found.u_p, x) for x in (found.states.P, found.states.rho)
        )
        assert P == pytest.approx([23.934e9, 81.770e9, 165.731e9], rel=0.015)
        assert rho == pytest.approx([10123.0, 11738.0, 13070.0], rel=0.01)


def test_shocks_conserve_mass_momentum_and_energy():
    for name, eos in (("al-2024-t4", "mie-grueneisen"), ("basalt", "tillotson")):
        found = shocks(table_of(load_card(name), eos), 4e3)
        rho0, states = load_card(name).rho0, found.states
        assert found.u_p.size > 150
        assert 3.8e3 < found.u_p[-1] <= 4e3
        assert rho0 * found.u_s == pytest.approx(states.rho * (found.u_s - found.u_p))
        assert states.P == pytest.approx(rho0 * found.u_s * found.u_p)
        assert states.E == pytest.approx(0.5 * found.u_p**2)


def test_shocks_of_a_straight_line_lie_on_it():
    card = load_card("al-2024-t4")
    found = shocks(table_of(card, "mie-grueneisen"), 4e3)
    assert found.u_s == pytest.approx(5328.0 + 1.338 * found.u_p, rel=1e-9)


def test_the_isentrope_lies_below_the_shocks_and_begins_with_them():
    card = load_card("al-6061-t6")
    table = table_of(card, "mie-grueneisen")
    found = shocks(table, 3e3).states
    cold = isentrope(table, found.rho)
    assert np.all(cold.P[5:] < found.P[5:])
    assert np.all(cold.T[5:] < found.T[5:])
    assert cold.P[:3] == pytest.approx(found.P[:3], rel=1e-4)
    # Gamma rho is a constant without b: T = 300 K exp(Gamma0 x).
    raw = card.model_dump(by_alias=True, exclude_none=True)
    raw["mie-grueneisen"]["gamma_slope"] = 0.0
    cold = isentrope(
        table_of(Material.model_validate(raw), "mie-grueneisen"), found.rho
    )
    x = 1.0 - card.rho0 / found.rho
    assert cold.T == pytest.approx(300.0 * np.exp(1.97 * x), rel=1e-5)


def test_without_a_thermal_model_there_is_an_isentrope_but_no_temperature():
    card = load_card("al-lee2003")
    table = table_of(card, "mie-grueneisen")
    rho = card.rho0 * np.linspace(1.0, 1.5, 50)
    cold = isentrope(table, rho)
    assert not cold.T.any()
    work = np.trapezoid(cold.P / rho**2, rho)
    assert cold.E[-1] == pytest.approx(work, rel=1e-3)
    assert states_at(table, rho[:1], np.zeros(1)).P == pytest.approx(0.0, abs=1.0)


def test_yield_stresses_are_those_of_the_laws():
    card = load_card("cu-ofhc")
    strain = np.array([0.0, 0.2, 1.0])
    table = table_of(card, "mie-grueneisen", "johnson-cook")
    hardened = 90e6 + 292e6 * strain**0.31
    assert yield_stresses(table, strain, 0.0, 298.0) == pytest.approx(hardened)
    hot = 1.0 - ((800.0 - 298.0) / (1356.0 - 298.0)) ** 1.09
    fast = 1.0 + 0.025 * np.log(1e4)
    found = yield_stresses(table, strain[1:], 1e4, 800.0)
    assert found == pytest.approx(hardened[1:] * hot * fast)
    table = table_of(card, "mie-grueneisen", "steinberg-guinan")
    found = yield_stresses(table, strain, 0.0, 800.0)
    grown = np.minimum(0.12e9 * (1.0 + 36.0 * strain) ** 0.45, 0.64e9)
    assert found == pytest.approx(grown * (1.0 - 3.77e-4 * 500.0))


def test_fracture_strains_are_those_of_the_law():
    constants = load_card("steel-4340").constants("johnson-cook-damage")
    found = fracture_strains(constants, np.array([0.0, 1.0]), 1.0, 298.0)
    assert found == pytest.approx(0.05 + 3.44 * np.exp(-2.12 * np.array([0.0, 1.0])))


def test_a_bulk_modulus_that_follows_is_no_equation_of_state_of_its_own():
    assert equations_of_state(load_card("ta")) == ["mie-grueneisen"]
    assert equations_of_state(load_card("soda-lime-glass")) == ["linear"]
    assert "linear" in equations_of_state(load_card("al-lee2003"))


MELTED = {
    # Pressure [GPa] where melting behind shocks begins.
    "al-2024-t4": 125.0,  # Jin et al. (2025)
    "cu-ofhc": 237.0,  # arXiv 2503.01939
    "ta": 300.0,  # Akin et al. (2019)
    "mg-az31b": 55.5,  # Beason et al. (2021), of magnesium; an alloy from 40 to 57
    "iron-armco": 225.0,  # Singh et al. (2023)
}


@pytest.mark.parametrize("name", MELTED)
def test_melting_behind_shocks_begins_where_it_was_measured(name):
    card = load_card(name)
    found = shocks(table_of(card, equations_of_state(card)[0]), 5e3).states
    onset = found.P[np.argmax(found.melt > 0.0)] / 1e9
    assert onset == pytest.approx(MELTED[name], rel=0.2)


def test_the_page_of_the_cards_says_where_they_melt_behind_shocks():
    page = text_of("mpisph/materials/README.md").replace("\n  |", "\n|")
    rows = table_rows(page, "| card | behind shocks")
    assert len(rows) > 5
    for name, said, _ in rows:
        card = load_card(name.strip("`"))
        found = shocks(table_of(card, equations_of_state(card)[0]), 5e3, 1000).states
        ends = [np.argmax(found.melt > 0.0), np.argmax(found.melt >= 1.0)]
        expected = [float(number) for number in said.split(" to ")]
        assert found.P[ends] / 1e9 == pytest.approx(expected, rel=0.01), name


def test_temperatures_behind_shocks_are_those_measured():
    """Jin et al. (2025), aluminium, 4576 (235) K; arXiv 2503.01939, copper."""
    for name, P, T, error in (
        ("al-6061-t6", 125e9, 4576.0, 235.0),
        ("cu-ofhc", 237e9, 5750.0, 1130.0),
    ):
        found = shocks(table_of(load_card(name), "mie-grueneisen"), 5e3).states
        assert np.interp(P, found.P, found.T) == pytest.approx(T, abs=error)


def test_aluminium_melts_as_it_expands_from_shocks_of_some_six_km_per_s():
    """Handbooks have 5.6 km/s for the onset and 7 for the end."""
    card = load_card("al-6061-t6")
    heat = card.constants("heat-capacity")
    table = table_of(card, "mie-grueneisen")
    found = shocks(table, 4e3)
    cold = isentrope(table, found.states.rho)
    # Entropy is kept: the energy above the isentrope falls as its temperature does,
    # here to the reference density. Expansion to no pressure takes some more.
    left = (found.states.E - cold.E) * 300.0 / cold.T
    wanted = heat.heat_to_melting, heat.heat_to_melting + heat.heat_of_fusion
    onset, end = np.interp(wanted, left, 2e-3 * found.u_p)
    assert onset == pytest.approx(5.6, rel=0.1)
    assert end == pytest.approx(7.0, rel=0.1)
