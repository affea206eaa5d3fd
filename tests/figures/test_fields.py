"""The table of fields that pictures show, and how they are chosen."""

from types import SimpleNamespace

import numpy as np
import pytest
from launch import CASES

from mpisph.case import load_case
from mpisph.core.errors import InputError
from mpisph.core.particles import FIELDS
from mpisph.figures.fields import (
    SHOWN_FIELDS,
    choose_fields,
    condition_fields,
    require_fields,
)
from mpisph.inputs.quantities import si_value
from mpisph.physics.response import MODEL_FIELDS

SAVED = {field.name: field for field in FIELDS if field.saved}


@pytest.mark.parametrize("field", SHOWN_FIELDS.values(), ids=SHOWN_FIELDS)
def test_each_field_is_made_of_what_snapshots_carry(field):
    units = {SAVED[name].unit for name in field.needs}
    assert {field.si.replace("^", "") or "1"} == units
    every = SimpleNamespace(fields=MODEL_FIELDS)
    case = SimpleNamespace(bodies=4 * [None], body_models=lambda body: every)
    arrays = {name: np.array([3.0]) for name in field.needs} | {"body": np.array([3])}
    want = np.hypot(3.0, 3.0) if field.name == "speed" else 3.0
    # The unit of the colour bar, as a case file would read it.
    si = si_value(f"1 {field.unit.replace('³', '3')}", field.si) if field.unit else 1.0
    assert field.shown(arrays, case) == pytest.approx(want / si)
    assert bool(field.names) != bool(field.colours)


def test_bodies_and_materials_have_their_names():
    path = CASES / "piekutowski-4-1353.toml"
    case = load_case(path, ["bodies.plate.eos=tillotson"])
    assert SHOWN_FIELDS["body"].names(case) == ["sphere", "plate"]
    names = ["al-lee2003, mie-grueneisen", "al-lee2003, tillotson"]
    assert SHOWN_FIELDS["material"].names(case) == names
    case = load_case(path, ["bodies.plate.material=al-6061-t6"])
    assert SHOWN_FIELDS["material"].names(case) == ["al-lee2003", "al-6061-t6"]


def test_ranges_are_those_of_the_first_fields():
    chosen = choose_fields(["pressure", "h"], [("-1 GPa", "2e9")])
    assert [each.field.name for each in chosen] == ["pressure", "h"]
    assert chosen[0].limits == pytest.approx((-1.0, 2.0))
    assert chosen[1].limits is None
    assert choose_fields([], []) == ()


@pytest.mark.parametrize(
    ("names", "ranges", "message"),
    [
        (["h", "speed", "melt"], [], "3 fields (h, speed, melt); a picture shows one"),
        ([], [("0", "1")], "--range: given 1 time for 0 fields"),
        (["body"], [("0", "1")], "body has names, and no range"),
        (["h"], [("1", "1")], "--range 1 1: the first must be less"),
        (["h"], [("0", "1 GPa")], "expected a length in m"),
        (["melt"], [("0", "nan")], "must be finite"),
        (["melt"], [("low", "1")], "--range low 1: melt: "),
    ],
)
def test_what_cannot_be_chosen_is_refused(names, ranges, message):
    with pytest.raises(InputError) as raised:
        choose_fields(names, ranges)
    assert message in str(raised.value)


def test_a_field_that_is_not_there_is_named_with_what_is():
    arrays = dict.fromkeys(("r", "z", "u_r", "u_z", "P", "T"))
    require_fields(choose_fields(["speed", "temperature"], []), arrays, "runs/x")
    message = "runs/x: no melt: .*; there are pressure, speed, temperature$"
    with pytest.raises(InputError, match=message):
        require_fields(choose_fields(["speed", "melt"], []), arrays, "runs/x")


@pytest.mark.parametrize(
    ("overrides", "names"),
    [
        ([], []),
        (["scheme.thermal=heat-capacity"], ["temperature"]),
        (["scheme.failure=spall"], ["damage"]),
        (
            ["scheme.thermal=heat-capacity", "scheme.failure=spall"],
            ["damage", "temperature"],
        ),
    ],
)
def test_the_condition_is_what_models_give(overrides, names):
    alloys = [f"bodies.{name}.material=al-6061-t6" for name in ("sphere", "plate")]
    none = [f"scheme.{kind}=none" for kind in ("thermal", "failure", "ductile")]
    overrides = [*alloys, *none, *overrides]
    case = load_case(CASES / "piekutowski-4-1353.toml", overrides)
    assert [each.field.name for each in condition_fields(case)] == names
