"""When two cases are the same."""

import pytest
from launch import CASES

from mpisph.case import case_from_dict, load_case
from mpisph.case.identity import case_key, differences

SHOT = CASES / "piekutowski-4-1353.toml"
CASE = load_case(SHOT, ["bodies.0.material=al-6061-t6", "scheme.eos=tillotson"])

ANOTHER = "somebody else's words"


def changed(change):
    """The case with a change to it as a dictionary."""
    data = CASE.model_dump(exclude_none=True, by_alias=True)
    change(data)
    return case_from_dict(data)


def describe_a_material(data):
    data["materials"]["al-6061-t6"]["description"] = ANOTHER


def source_a_constant(data):
    data["materials"]["al-6061-t6"]["sources"]["rho0"] = ANOTHER


def drop_the_sources(data):
    for material in data["materials"].values():
        material["sources"] = {}


def source_a_models_constant(data):
    material = data["materials"]["al-6061-t6"]
    next(x for x in material.values() if isinstance(x, dict) and "Es" in x)[
        "sources"
    ] = {"a": ANOTHER, "b.c": ANOTHER}


def lengthen_at_break(data):
    data["materials"]["al-6061-t6"]["elongation"] = 0.3


def source_an_exposure(data):
    data["measured"]["exposures"][0]["source"] = ANOTHER


def name_the_case(data):
    data["title"] = ANOTHER


@pytest.mark.parametrize(
    "change",
    [
        describe_a_material,
        source_a_constant,
        drop_the_sources,
        source_a_models_constant,
        lengthen_at_break,
        source_an_exposure,
        name_the_case,
    ],
)
def test_prose_is_no_part_of_what_a_case_is(change):
    other = changed(change)
    assert other != CASE
    assert differences(CASE, other) == []
    assert case_key(CASE) == case_key(other)


def change_a_constant(data):
    data["materials"]["al-6061-t6"]["rho0"] *= 1.01


def change_a_models_constant(data):
    material = data["materials"]["al-6061-t6"]
    next(x for x in material.values() if isinstance(x, dict) and "Es" in x)["Es"] /= 2


def change_a_measurement(data):
    data["measured"]["exposures"][0]["radius"] *= 1.01


def rename_a_body(data):
    data["bodies"][1]["name"] = "another"
    data["measured"]["plate"] = "another"


def rename_a_material(data):
    data["bodies"][0]["material"] = "description"
    data["materials"]["description"] = data["materials"].pop("al-6061-t6")


@pytest.mark.parametrize(
    ("change", "key"),
    [
        (change_a_constant, "materials.al-6061-t6.rho0: "),
        (change_a_models_constant, ".Es: "),
        (change_a_measurement, "measured.exposures.0.radius: "),
        (rename_a_body, "bodies.1.name: plate, now another"),
        (rename_a_material, "bodies.0.material: al-6061-t6, now description"),
    ],
)
def test_numbers_and_names_are(change, key):
    other = changed(change)
    assert any(key in text for text in differences(CASE, other))
    assert case_key(CASE) != case_key(other)


@pytest.mark.parametrize("name", ["sources", "source", "description", "title"])
def test_a_material_may_be_called_like_prose(name):
    """Its numbers count all the same."""

    def rename(data, factor):
        data["bodies"][0]["material"] = name
        data["materials"][name] = data["materials"].pop("al-6061-t6")
        data["materials"][name]["rho0"] *= factor

    one, two = (changed(lambda data, f=f: rename(data, f)) for f in (1.0, 1.01))
    assert [text.partition(":")[0] for text in differences(one, two)] == [
        f"materials.{name}.rho0"
    ]
