"""The material cards that come with mpisph: sources, and numbers that fit together."""

import numpy as np
import pytest

from mpisph.materials import card_names, load_card
from mpisph.materials.curves import equations_of_state, melting_line, thermal_of
from mpisph.materials.model import TABLES
from mpisph.physics.response import KINDS

CARDS = {name: load_card(name) for name in card_names()}

every_card = pytest.mark.parametrize("card", CARDS.values(), ids=CARDS)


def tables(card):
    """The tables of constants that a card has."""
    found = {name: card.constants(name) for name in TABLES}
    return {name: table for name, table in found.items() if table is not None}


def test_shipped_cards():
    aluminium = "1100-o 2017-t4 2024-t3 2024-t4 2219-t87 5083-h116 6061-t6 7075-t6"
    metals = "cu-ofhc iron-armco mg-az31b steel-304 steel-4340 ta ti-6al-4v w w-ni-fe"
    others = "basalt ice nylon pmma polycarbonate soda-lime-glass"
    wanted = {f"al-{alloy}" for alloy in [*aluminium.split(), "lee2003"]}
    assert {*card_names()} == wanted | {*metals.split(), *others.split()}


@every_card
def test_every_number_of_a_card_has_a_source(card):
    assert card.description
    assert card.composition
    given = {"rho0", "composition"} | {"elongation"} & card.model_fields_set
    assert set(card.sources) == given
    for table in tables(card).values():
        numbers = {key for key, value in table if isinstance(value, float)}
        assert set(table.sources) == numbers & table.model_fields_set
        assert all(table.sources.values())


@every_card
def test_a_card_chooses_a_model_only_where_it_has_no_other(card):
    if "mie-grueneisen" in tables(card):
        assert card.eos is None
    else:
        assert card.eos == equations_of_state(card)[0]
        assert len(equations_of_state(card)) == 1
    assert (card.strength == "none") is not any(
        name in tables(card) for name in KINDS["strength"]
    )


APART = {"nylon": 1.85, "polycarbonate": 2.1}
"""Tillotson's constants of polymers fit high pressures alone."""


@every_card
def test_bulk_moduli_of_a_card_agree(card):
    """Within 9 %, the source paper's own discrepancy, but for polymers."""
    speeds = [
        card.constants(name).bulk_sound_speed(card.rho0)
        for name in KINDS["eos"]
        if card.constants(name) is not None
    ]
    moduli = card.rho0 * np.square(speeds)
    assert moduli.max() / moduli.min() < APART.get(card.name, 1.0905)
    for table in tables(card).values():
        if hasattr(table, "shear_modulus"):
            ratio = table.shear_modulus / moduli[0]
            poisson = (3.0 - 2.0 * ratio) / (6.0 + 2.0 * ratio)
            assert 0.05 < poisson < 0.45


@every_card
def test_strength_models_of_a_card_agree(card):
    found = tables(card)
    moduli = {t.shear_modulus for t in found.values() if hasattr(t, "shear_modulus")}
    assert len(moduli) <= 1
    yields = [t.yield_strength for t in found.values() if hasattr(t, "yield_strength")]
    yields += [t.A for name, t in found.items() if name == "johnson-cook"]
    if yields:
        assert max(yields) < 0.2 * min(moduli)
        # Tempers, and the way to take a yield strength from a curve, differ.
        assert max(yields) < 2.0 * min(yields)
    steinberg = found.get("steinberg-guinan")
    if steinberg is not None:
        assert steinberg.largest_yield_strength < 0.1 * steinberg.shear_modulus
        assert 1.0 < steinberg.A * found["linear"].bulk_modulus < 6.0


@every_card
def test_melting_begins_above_room_temperature_and_rises_with_compression(card):
    if not thermal_of(card):
        return
    T = melting_line(card, card.rho0 * np.array([0.9, 1.0, 1.1, 1.3, 1.6]))
    heat = card.constants("heat-capacity")
    own = heat.melting_temperature
    assert T[0] == T[1] == own > heat.reference_temperature
    if "melting_gamma" in heat.sources:
        assert np.all(np.diff(T[1:]) > 0.0)
        assert T[-1] > 1.8 * own
    if heat.heat_to_melting:
        mean = heat.heat_to_melting / heat.span
        assert 1.1 < mean / heat.heat_capacity < 1.65
    for name in ("johnson-cook", "johnson-cook-damage"):
        if name in tables(card):
            # Where strength vanishes: of some alloys where melting begins.
            assert 0.75 * own < card.constants(name).melting_temperature < 1.01 * own


def test_heats_of_fusion_are_those_of_the_elements():
    for name, kilojoules, mass in (("cu-ofhc", 13.26, 63.546), ("ta", 36.57, 180.948)):
        heat = CARDS[name].constants("heat-capacity").heat_of_fusion
        assert heat == pytest.approx(1e6 * kilojoules / mass, rel=2e-3)


def test_cards_of_walls_have_their_elongation():
    """Typical ones of the Aluminum Association [1]."""
    found = {name: card.elongation for name, card in CARDS.items() if name[:3] == "al-"}
    assert found == {
        "al-1100-o": 0.35,
        "al-2017-t4": 0.22,
        "al-2024-t3": 0.18,
        "al-2024-t4": 0.20,
        "al-2219-t87": 0.10,
        "al-5083-h116": 0.16,
        "al-6061-t6": 0.12,
        "al-7075-t6": 0.11,
        "al-lee2003": None,
    }


def test_aluminium_that_spalls_takes_its_time():
    for name, card in CARDS.items():
        if spall := card.constants("spall"):
            assert spall.relaxation_time == (1e-8 if name[:3] == "al-" else 0.0)


def test_a_stand_in_says_so():
    """2219 and 5083 break as 2024-T351 does; 2017 by spall alone."""
    lent = CARDS["al-2024-t3"].constants("johnson-cook-damage")
    for name in ("al-2219-t87", "al-5083-h116"):
        damage = CARDS[name].constants("johnson-cook-damage")
        for key in ("D1", "D2", "D3", "D4", "D5"):
            assert getattr(damage, key) == getattr(lent, key)
            assert "2024-T351 as a stand-in" in damage.sources[key]
        assert CARDS[name].ductile == "johnson-cook-damage"
    assert CARDS["al-2017-t4"].constants("johnson-cook-damage") is None
    assert CARDS["al-2017-t4"].ductile is None


def test_moduli_per_megabar_are_converted():
    steinberg = CARDS["al-6061-t6"].constants("steinberg-guinan")
    assert steinberg.A == 6.52e-11
    assert steinberg.shear_modulus * steinberg.A == pytest.approx(1.8, rel=1e-3)


def numbers(card, model):
    return card.constants(model).model_dump(exclude={"sources"}, exclude_unset=True)


def test_aluminium_of_the_source_paper():
    card = CARDS["al-lee2003"]
    assert card.rho0 == 2710.0
    assert numbers(card, "mie-grueneisen") == {
        "c0": 5350.0,
        "slope": 1.49,
        "gamma0": 1.7,
    }
    assert numbers(card, "linear") == {"bulk_modulus": 72e9}
    assert numbers(card, "elastic-plastic") == {
        "shear_modulus": 25e9,
        "yield_strength": 55e6,
    }
    assert numbers(card, "tillotson") == {
        "a": 0.5,
        "b": 1.63,
        "A": 78.5e9,
        "B": 65e9,
        "E0": 5e6,
        "Es": 2.76e6,
        "Es_prime": 14.1e6,
        "alpha": 5.0,
        "beta": 5.0,
    }
    assert set(tables(card)) == {
        "mie-grueneisen",
        "linear",
        "tillotson",
        "elastic-plastic",
    }
