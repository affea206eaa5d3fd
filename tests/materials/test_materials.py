"""Materials: reading them, and which models a material is used with."""

from types import SimpleNamespace

import pytest
from pydantic import ValidationError

from mpisph.core.errors import CaseError
from mpisph.materials import Material, load_card, read_card
from mpisph.materials.choice import chosen_models
from mpisph.materials.library import card_data
from mpisph.materials.model import TABLES
from mpisph.physics.eos.tillotson import Tillotson
from mpisph.physics.failure.minimum_pressure import MinimumPressure

DEFAULTS = SimpleNamespace(
    eos="mie-grueneisen",
    thermal="none",
    strength="elastic-plastic",
    failure="minimum-pressure",
    ductile="none",
    porosity="none",
    p_min=MinimumPressure(value=-5e8),
)


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
    chosen = chosen_models(load_card("al-lee2003"), DEFAULTS)
    assert chosen.names == {
        "eos": "mie-grueneisen",
        "thermal": "none",
        "strength": "elastic-plastic",
        "failure": "minimum-pressure",
        "ductile": "none",
        "porosity": "none",
    }
    assert chosen.constants["minimum-pressure"].value == -5e8
    assert chosen.bulk_sound_speed == 5350.0


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


def test_an_elongation_is_above_zero():
    assert Material(rho0=2700.0).elongation is None
    assert Material(rho0=2700.0, elongation="12 %").elongation == 0.12
    for value in (0.0, -0.1):
        with pytest.raises(ValidationError, match="greater than 0"):
            Material(rho0=2700.0, elongation=value)


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
    path.write_text(path.read_text() + "gamma0 = -2\n")
    with pytest.raises(CaseError, match=r"gamma0 = -2.0: expected at least 0"):
        read_card(path)
    path.write_text(path.read_text().replace("-2", "2"))
    assert (read_card(path).name, read_card(path).rho0) == ("steel", 7850.0)
