"""Materials: cards, their sources, and which models a material is used with."""

from types import SimpleNamespace

import pytest
from pydantic import ValidationError

from mpisph.core.errors import CaseError
from mpisph.materials import Material, card_names, load_card, read_card
from mpisph.materials.choice import chosen_models
from mpisph.materials.library import card_data
from mpisph.materials.model import TABLES
from mpisph.physics.eos.tillotson import Tillotson
from mpisph.physics.failure.minimum_pressure import MinimumPressure

DEFAULTS = SimpleNamespace(
    eos="mie-grueneisen",
    strength="elastic-plastic",
    failure="minimum-pressure",
    p_min=MinimumPressure(value=-5e8),
)


def test_shipped_cards():
    assert card_names() == ("al-2024-t4", "al-6061-t6", "al-lee2003", "cu-ofhc")


@pytest.mark.parametrize("name", card_names())
def test_every_number_of_a_card_has_a_source(name):
    card = load_card(name)
    assert card.name == name
    tables = [card.constants(model) for model in TABLES]
    assert sum(table is not None for table in tables) >= 3
    for part in (card, *filter(None, tables)):
        numbers = {key for key, value in part if isinstance(value, float)}
        numbers |= {"composition"} & {key for key, value in part if value}
        assert numbers == set(part.sources)
        assert all(part.sources.values())


@pytest.mark.parametrize("name", card_names())
def test_constants_of_a_card_are_consistent(name):
    card = load_card(name)
    # Only the source paper's bulk modulus is independent; it is 7 % less.
    tolerance = 0.08 if name == "al-lee2003" else 1e-3
    linear, strength = card.constants("linear"), card.constants("elastic-plastic")
    c0 = card.constants("mie-grueneisen").c0
    assert linear.bulk_modulus == pytest.approx(card.rho0 * c0**2, rel=tolerance)
    assert 1000.0 < card.rho0 < 20000.0
    assert 0.0 < strength.yield_strength < strength.shear_modulus < linear.bulk_modulus


def numbers(card, model):
    return card.constants(model).model_dump(exclude={"sources"})


def test_aluminium_of_the_source_paper():
    card = load_card("al-lee2003")
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


def test_unknown_card_suggests_the_nearest():
    with pytest.raises(CaseError, match='did you mean "al-6061-t6"'):
        load_card("Al-6061-T5")


def test_bare_and_sourced_numbers_may_be_mixed():
    raw = load_card("cu-ofhc").model_dump(by_alias=True, exclude_none=True)
    raw["rho0"] = {"value": "8.9 g/cm3", "source": "here"}
    raw["mie-grueneisen"] = {
        "c0": {"value": "3.9 km/s", "source": "there"},
        "slope": 1.5,
        "gamma0": 2,
    }
    material = Material.model_validate(raw)
    assert material.rho0 == 8900.0
    assert material.sources["rho0"] == "here"
    assert material.constants("mie-grueneisen").c0 == 3900.0
    assert material.constants("mie-grueneisen").sources == {"c0": "there"}


def test_tillotson_energies_are_ordered():
    constants = load_card("al-lee2003").constants("tillotson").model_dump()
    with pytest.raises(ValidationError, match="Es_prime must exceed Es"):
        Tillotson.model_validate({**constants, "Es": 2e7})


def test_a_yield_strength_above_the_shear_modulus_is_refused():
    with pytest.raises(ValidationError, match="must not exceed shear_modulus"):
        TABLES["elastic-plastic"](shear_modulus=1e9, yield_strength=2e9)
    fluid = TABLES["elastic-plastic"](shear_modulus=0.0, yield_strength=2e9)
    assert fluid.yield_strength == 2e9


def test_the_scheme_chooses_for_materials_that_choose_nothing():
    chosen = chosen_models(load_card("cu-ofhc"), DEFAULTS)
    assert chosen.names == {
        "eos": "mie-grueneisen",
        "strength": "elastic-plastic",
        "failure": "minimum-pressure",
    }
    assert chosen.constants["minimum-pressure"].value == -5e8
    assert chosen.bulk_sound_speed == 3940.0


def test_a_material_may_choose_its_own_models_and_a_body_its_equation_of_state():
    raw = load_card("cu-ofhc").model_dump(by_alias=True, exclude_none=True)
    own = Material.model_validate(
        {
            **raw,
            "eos": "linear",
            "strength": "none",
            "minimum-pressure": {"value": "-1.2 GPa", "mode": "zero"},
        }
    )
    chosen = chosen_models(own, DEFAULTS)
    assert chosen.names["eos"] == "linear"
    assert chosen.names["strength"] == "none"
    assert chosen.constants["minimum-pressure"].value == -1.2e9
    assert chosen.constants["minimum-pressure"].mode == "zero"
    assert chosen_models(own, DEFAULTS, "mie-grueneisen").names["eos"] == (
        "mie-grueneisen"
    )


@pytest.mark.parametrize(
    ("composition", "words"),
    [
        ({"Xx": 1.0}, "Xx: no chemical element"),
        ({"Al": 0.5}, "the fractions make 0.5; expected 1"),
        ({"Al": 0.5, "Cu": 0.6}, "the fractions make 1.1; expected 1"),
    ],
)
def test_a_composition_is_of_elements_and_makes_a_whole(composition, words):
    with pytest.raises(ValidationError, match=words):
        Material(rho0=2700.0, composition=composition)


def test_a_bulk_modulus_that_is_not_given_is_computed():
    raw = {"rho0": 2000.0, "mie-grueneisen": {"c0": 3e3, "slope": 1.5, "gamma0": 2.0}}
    linear = Material.model_validate(raw).constants("linear")
    assert linear.bulk_modulus == 2000.0 * 3e3**2
    assert "rho0 c^2" in linear.sources["bulk_modulus"]
    given = {**raw, "linear": {"bulk_modulus": 7e9}}
    assert Material.model_validate(given).constants("linear").bulk_modulus == 7e9
    # Of Tillotson's constants, A is the bulk modulus.
    constants = load_card("al-lee2003").constants("tillotson").model_dump()
    alone = Material.model_validate({"rho0": 2710.0, "tillotson": constants})
    assert alone.constants("linear").bulk_modulus == pytest.approx(78.5e9)
    beyond = {
        **raw,
        "rho0": 1e6,
        "mie-grueneisen": {**raw["mie-grueneisen"], "c0": 1e6},
    }
    assert Material.model_validate(beyond).constants("linear") is None


def test_a_gas_has_no_bulk_modulus():
    raw = {"rho0": 1.0, "ideal-gas": {"gamma": 1.4, "c0": 1.2}}
    gas = Material.model_validate(raw)
    assert gas.constants("linear") is None
    assert gas.sound_speed == 1.2


def test_a_changed_sound_speed_changes_the_computed_bulk_modulus():
    """No card repeats what follows from its other constants."""
    raw = card_data("al-6061-t6")
    raw["mie-grueneisen"] = {**raw["mie-grueneisen"], "c0": 5000.0}
    changed = Material.model_validate(raw).constants("linear")
    assert changed.bulk_modulus == pytest.approx(2703.0 * 5000.0**2)


def test_a_card_of_ones_own_is_read(tmp_path):
    path = tmp_path / "steel.toml"
    path.write_text("rho0 = 7850\n[mie-grueneisen]\nc0 = 4600\nslope = 1.49\n")
    with pytest.raises(CaseError, match=r"steel\.toml:2: mie-grueneisen\.gamma0: req"):
        read_card(path)
    path.write_text(path.read_text() + "gamma0 = 2\n")
    assert (read_card(path).name, read_card(path).rho0) == ("steel", 7850.0)
