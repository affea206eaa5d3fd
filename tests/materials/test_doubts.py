"""Constants that no matter has: slips of units and signs."""

import numpy as np
import pytest
import tables

from mpisph.materials import Material, card_names, load_card
from mpisph.materials.doubts import card_doubts


def doubts(name, changes):
    card = load_card(name)
    raw = card.model_dump(by_alias=True, exclude_none=True)
    if "linear" not in card.given:  # it follows from what is changed
        raw.pop("linear", None)
    for key, value in changes.items():
        raw[key] = {**raw.get(key, {}), **value} if isinstance(value, dict) else value
    return list(card_doubts(Material.model_validate(raw)))


def test_no_shipped_card_is_doubtful():
    for name in card_names():
        assert doubts(name, {}) == []


PORES = {"initial_distension": 1.5, "elastic_pressure": 0.0, "solid_pressure": 1e9}


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"rho0": 2.703}, "rho0", "2.703 kg/m3"),
        ({"mie-grueneisen": {"c0": 5.24}}, "eos", "5.24 m/s"),
        ({"spall": {"strength": 1.2e6}}, "spall.strength", "1.6e-05 of the bulk"),
        ({"spall": {"strength": 1.2e10}}, "spall.strength", "is the unit right?"),
        ({"spall": {"crack_energy": 1e9}}, "spall.crack_energy", "1.7 m wide"),
        (
            {"spall": {"relaxation_time": 0.01}},
            "spall.relaxation_time",
            "is the unit right?",
        ),
        ({"elongation": 12}, "elongation", "13 times as long when it breaks"),
        ({"elongation": 12}, "elongation", "write 0.12"),
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
            {"heat-capacity": {"heat_capacity": 0.885e6, "heat_to_melting": 0.0}},
            "heat-capacity.heat_capacity",
            "2.39e+03 MJ/m3/K",
        ),
        (
            {"heat-capacity": {"heat_capacity": 8.85}},
            "heat-capacity.heat_capacity",
            "is the unit right?",
        ),
        (
            {"p-alpha": PORES | {"elastic_pressure": 50.0}},
            "p-alpha.elastic_pressure",
            "50 Pa",
        ),
        (
            {"p-alpha": PORES | {"solid_pressure": 5e10}},
            "p-alpha.solid_pressure",
            "0.67 of",
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


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"steinberg-guinan": None}, "strength", "no steinberg-guinan constants"),
        ({"failure": "grady-kipp"}, "failure", "no grady-kipp constants"),
        ({"thermal": None, "ductile": None}, "strength", 'set thermal = "heat-capaci'),
        ({"thermal": "none", "strength": None}, "ductile", "depends on the temperat"),
    ],
)
def test_a_choice_that_every_case_refuses_is_named(changes, key, words):
    (text,) = doubts("al-6061-t6", changes)
    assert text.startswith(f"al-6061-t6.{key}: ")
    assert words in text


def test_the_schemes_minimum_pressure_may_be_chosen():
    assert doubts("al-6061-t6", {"failure": "minimum-pressure"}) == []


@pytest.mark.parametrize(("density", "doubted"), [(2600.0, False), (2850.0, True)])
def test_a_pressure_that_falls_is_doubted_above_the_reference_density(density, doubted):
    states = tables.mie_grueneisen()
    i, P = np.searchsorted(states.density, density), states.pressure.copy()
    P[i, 3] = P[i - 1, 3] - 1e6
    content = states._replace(pressure=P).packed()
    found = doubts("al-6061-t6", {"eos": "table", "table": {"content": content}})
    assert [text.partition(":")[0] for text in found] == ["al-6061-t6.table"] * doubted
    assert (
        not doubted or f"at {states.temperature[3]:g} K the pressure falls" in found[0]
    )
