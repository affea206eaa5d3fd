"""Constants that no matter has: slips of units and signs."""

import pytest

from mpisph.materials import Material, card_names, load_card
from mpisph.materials.doubts import card_doubts


def doubts(name, changes):
    raw = load_card(name).model_dump(by_alias=True, exclude_none=True)
    raw.pop("linear", None)
    for key, value in changes.items():
        raw[key] = {**raw[key], **value} if isinstance(value, dict) else value
    return list(card_doubts(Material.model_validate(raw)))


def test_no_shipped_card_is_doubtful():
    for name in card_names():
        assert doubts(name, {}) == []


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"rho0": 2.703}, "rho0", "2.703 kg/m3"),
        ({"mie-grueneisen": {"c0": 5.24}}, "eos", "5.24 m/s"),
        ({"spall": {"strength": 1.2e6}}, "spall.strength", "1.6e-05 of the bulk"),
        ({"spall": {"strength": 1.2e10}}, "spall.strength", "is the unit right?"),
        ({"spall": {"crack_energy": 1e9}}, "spall.crack_energy", "1.7 m wide"),
        ({"steinberg-guinan": {"A": 6.52e-9}}, "steinberg-guinan.A", "484-fold"),
        ({"steinberg-guinan": {"A": 6.52e-13}}, "steinberg-guinan.A", "per Mbar"),
        ({"steinberg-guinan": {"B": 6.16e-3}}, "steinberg-guinan.B", "925 K"),
        (
            {"johnson-cook": {"shear_modulus": 2.76e9}},
            "johnson-cook.shear_modulus",
            "Poisson's ratio of 0.48",
        ),
        (
            {"elastic-plastic": {"shear_modulus": 276e9}},
            "elastic-plastic.shear_modulus",
            "is the unit right?",
        ),
        ({"johnson-cook": {"A": 32.4e9}}, "johnson-cook.A", "of the shear modulus"),
        (
            {"johnson-cook": {"melting_temperature": 652.0}},
            "johnson-cook.melting_temperature",
            "in kelvins",
        ),
        (
            {"johnson-cook-damage": {"melting_temperature": 1800.0}},
            "johnson-cook-damage.melting_temperature",
            "heat-capacity has 925 K",
        ),
        ({"johnson-cook-damage": {"D3": 0.47}}, "johnson-cook-damage.D3", "other sign"),
        (
            {"heat-capacity": {"heat_of_fusion": 397.0}},
            "heat-capacity.heat_of_fusion",
            "is the unit right?",
        ),
        (
            {"heat-capacity": {"heat_to_melting": 6.6e8}},
            "heat-capacity.heat_to_melting",
            "1.19e+03 times",
        ),
        (
            {"heat-capacity": {"melting_gamma": 0.2}},
            "heat-capacity.melting_gamma",
            "falls with compression;",
        ),
        (
            {"heat-capacity": {"melting_slope": 20.0}},
            "heat-capacity.melting_gamma",
            "falls with compression of 30%",
        ),
    ],
)
def test_a_slip_is_seen(changes, key, words):
    (text,) = doubts("al-6061-t6", changes)
    assert text.startswith(f"al-6061-t6.{key}: ")
    assert words in text
