import math
import tomllib

import pytest
from pydantic import ValidationError
from shields import shield_case

from mpisph.case import Case, case_from_dict, case_schema
from mpisph.core.particles import FIELDS


def test_defaults_are_those_of_the_base_case(data):
    scheme = case_from_dict(data).scheme
    assert scheme.self_term is True
    assert scheme.kappa == 3.0
    assert scheme.eos == "mie-grueneisen"
    assert scheme.strength == "elastic-plastic"
    viscosity = scheme.viscosity
    assert (viscosity.alpha, viscosity.beta, viscosity.epsilon) == (1.5, 2.0, 0.001)
    assert viscosity.form == "derived"
    assert (scheme.heat.enabled, scheme.heat.g1, scheme.heat.g2) == (True, 0.0, 1.0)
    assert (scheme.p_min.value, scheme.p_min.mode) == (0.0, "clamp")
    assert scheme.smoothing == "axisymmetric"


def test_spacing_is_the_radius_of_the_first_sphere_over_npr(data):
    case = case_from_dict(data)
    assert case.resolution.reference == "ball"
    assert case.spacing == pytest.approx(5e-4)
    assert case.smoothing_length == pytest.approx(7.5e-4)


def test_spacing_follows_the_named_body(data):
    data["resolution"] = {"npr": 10, "reference": "wall"}
    assert case_from_dict(data).spacing == pytest.approx(2e-3)


def test_spacing_may_be_given_itself(data):
    data["resolution"] = {"spacing": "0.25 mm", "nph": 1.5}
    case = case_from_dict(data)
    assert case.spacing == 2.5e-4
    assert case.smoothing_length == pytest.approx(3.75e-4)


def test_output_times_merge_all_requests_and_end_with_the_end(data):
    data["time"] = {"end": "2.05 us"}
    data["output"] = {"times": ["0.6 us", "1.7 us"], "every": "0.3 us"}
    data["measured"] = {
        "clock_offset": "1.05 us",
        "exposures": [
            {"time": "1 us", "radius": "9 mm", "source": "a"},
            {"time": "19 us", "length": "9 mm", "source": "a"},
        ],
    }
    expected = (0.3, 0.6, 0.9, 1.0, 1.2, 1.5, 1.7, 1.8, 2.05)
    times = case_from_dict(data).output_times
    assert times == pytest.approx([1e-6 * t for t in expected])
    assert times[-1] == 2.05e-6


def test_end_is_the_last_requested_time_by_default(data):
    del data["time"]
    data["output"] = {"times": ["1 us"], "every": "0.4 us"}
    data["measured"] = {
        "clock_offset": "1 us",
        "exposures": [{"time": "6 us", "radius": "9 mm", "source": "a"}],
    }
    case = case_from_dict(data)
    assert case.time.end == case.end_time == pytest.approx(7e-6)
    assert case.output_times[-1] == case.time.end


def test_measured_plate_is_the_first_by_default(data):
    data["measured"] = {}
    case = case_from_dict(data)
    assert case.measured.plate == "wall"
    assert case.measured_plate is case.bodies[1]
    assert case.measured_plate.rear_face == pytest.approx(2e-3)


def test_materials_hold_exactly_what_the_bodies_use(data):
    softer = {"elastic-plastic": {"yield_strength": "0.2 GPa"}}
    data["materials"] = {"cu-ofhc": softer, "al-6061-t6": softer}
    case = case_from_dict(data)
    assert list(case.materials) == ["al-lee2003", "cu-ofhc"]
    copper = case.body_material(case.bodies[1])
    strength = copper.constants("elastic-plastic")
    assert (strength.yield_strength, strength.shear_modulus) == (0.2e9, 47.7e9)
    assert copper.rho0 == 8930.0
    assert "yield_strength" not in strength.sources
    assert "shear_modulus" in strength.sources


def test_one_tillotson_constant_may_be_changed(data):
    data["materials"] = {"al-lee2003": {"tillotson": {"b": 1.5}}}
    tillotson = case_from_dict(data).materials["al-lee2003"].constants("tillotson")
    assert (tillotson.a, tillotson.b) == (0.5, 1.5)


def test_a_complete_table_does_not_rest_on_the_card_of_its_name(data):
    card = case_from_dict(data).materials["al-lee2003"]
    own = card.model_dump(exclude_none=True, by_alias=True)
    del own["tillotson"]
    data["materials"] = {"al-lee2003": own}
    assert case_from_dict(data).materials["al-lee2003"].constants("tillotson") is None


def test_material_table_pairs_material_and_equation_of_state(data):
    data["bodies"][1]["material"] = "al-lee2003"
    data["bodies"][1]["eos"] = "tillotson"
    rod = {"shape": "cylinder", "name": "rod", "radius": "1 mm", "length": "9 mm"}
    data["bodies"].append({**rod, "material": "al-lee2003", "position": "1 m"})
    case = case_from_dict(data)
    table = case.material_table
    assert [(models.material, models.names["eos"]) for models in table] == [
        ("al-lee2003", "mie-grueneisen"),
        ("al-lee2003", "tillotson"),
    ]
    assert case.material_indices == (0, 1, 0)


@pytest.mark.parametrize(
    ("scheme", "own", "changed"),
    [
        ({}, {}, {}),
        ({"strength": "johnson-cook"}, {}, {"strength": "johnson-cook"}),
        ({"ductile": "none"}, {}, {"ductile": "none"}),
        ({"p_min": {"value": -1e9}}, {}, {"failure": "minimum-pressure"}),
        ({"p_min": {}, "failure": "none"}, {}, {"failure": "none"}),
        (
            {"strength": "none"},
            {"strength": "johnson-cook"},
            {"strength": "johnson-cook"},
        ),
        ({}, {"failure": "none"}, {"failure": "none"}),
    ],
)
def test_a_scheme_goes_before_a_card_and_a_material_of_the_case_before_both(
    data, scheme, own, changed
):
    data["bodies"][0]["material"] = data["bodies"][1]["material"] = "al-6061-t6"
    data |= {"scheme": scheme, "materials": {"al-6061-t6": own}}
    card = {
        "thermal": "heat-capacity",
        "strength": "steinberg-guinan",
        "failure": "spall",
        "ductile": "johnson-cook-damage",
    }
    case = case_from_dict(data)
    for each in (case, case_from_dict(tomllib.loads(case.to_toml()))):
        names = each.body_models(each.bodies[1]).names
        assert {kind: names[kind] for kind in card} == card | changed


def test_materials_have_limits_and_models_of_their_own(data):
    """A copper rod on aluminium need not share one limit."""
    data["scheme"] = {"p_min": {"value": "-1 GPa"}}
    data["materials"] = {
        "cu-ofhc": {
            "strength": "none",
            "minimum-pressure": {"value": "-3 GPa", "mode": "zero"},
        }
    }
    case = case_from_dict(data)
    ball, wall = case.material_table
    assert ball.constants["minimum-pressure"].value == -1e9
    assert wall.constants["minimum-pressure"].value == -3e9
    assert (ball.names["strength"], wall.names["strength"]) == (
        "elastic-plastic",
        "none",
    )
    again = case_from_dict(tomllib.loads(case.to_toml()))
    assert again == case


MODEL_FIELDS = {
    "T", "melt", "plastic_work", "damage", "opening", "ductile_damage", "distension"
}  # fmt: skip
NO_MODELS = {
    "strength": "none",
    **dict.fromkeys(("thermal", "failure", "ductile", "porosity"), "none"),
}


@pytest.mark.parametrize(
    ("models", "given"),
    [
        ({}, set()),
        ({"thermal": "heat-capacity"}, {"T", "melt", "plastic_work"}),
        ({"failure": "spall"}, {"damage", "opening"}),
        ({"failure": "grady-kipp"}, {"damage"}),
        ({"thermal": "heat-capacity", "ductile": "johnson-cook-damage"},
         {"T", "melt", "plastic_work", "damage", "ductile_damage"}),
        ({"porosity": "p-alpha"}, {"distension"}),
    ],
)  # fmt: skip
def test_snapshots_carry_the_fields_of_the_models_in_use(data, models, given):
    """Though it be in the material of one body alone."""
    materials = ["al-6061-t6", "al-lee2003"]
    for body, material in zip(data["bodies"], materials, strict=True):
        body["material"] = material
    data["materials"] = {
        "al-6061-t6": {
            **NO_MODELS,
            **models,
            "grady-kipp": {"k": 1e30, "m": 8.0},
            "p-alpha": {
                "initial_distension": 1.5,
                "elastic_pressure": 1e8,
                "solid_pressure": 1e9,
            },
        }
    }
    saved = case_from_dict(data).saved_fields
    assert saved & MODEL_FIELDS == given
    always = {f.name for f in FIELDS if f.saved} - MODEL_FIELDS - {"retired"}
    assert saved - MODEL_FIELDS == always >= {"rho", "E", "P", "plastic_strain"}


def test_snapshots_say_what_has_left_the_game_of_a_shield(data):
    assert "retired" not in case_from_dict(data).saved_fields
    assert "retired" in shield_case().saved_fields


def test_toml_round_trip_is_exact_and_complete(data):
    data["scheme"] = {"p_min": {"value": "-inf"}, "heat": {"g1": 0.1}}
    data["output"] = {"every": "0.3 us"}
    data["measured"] = {
        "exposures": [{"time": "1 us", "radius": "9 mm", "source": "\u00fc"}]
    }
    case = case_from_dict(data)
    assert case.scheme.p_min.value == -math.inf
    text = case.to_toml()
    again = case_from_dict(tomllib.loads(text))
    assert again == case
    assert again.to_toml() == text
    assert tomllib.loads(text)["scheme"]["viscosity"]["alpha"] == 1.5
    assert tomllib.loads(text)["bodies"][0]["radius"] == 0.005


def test_case_is_immutable(data):
    case = case_from_dict(data)
    with pytest.raises(ValidationError):
        case.title = "other"


def test_rules_hold_for_the_bare_model_too(data):
    data["bodies"][0]["position"] = 0
    with pytest.raises(ValidationError, match="overlap"):
        Case.model_validate(data)


def test_a_case_made_of_its_own_parts_is_the_same(data):
    case = case_from_dict(data)
    assert Case.model_validate(dict(case)) == case


def test_schema_describes_every_field_and_gives_units():
    schema = case_schema()
    parts = {"Case": schema, **schema["$defs"]}
    fields = {
        f"{name}.{key}": field
        for name, part in parts.items()
        for key, field in part.get("properties", {}).items()
    }
    assert [key for key, field in fields.items() if not field.get("description")] == []
    assert fields["Sphere.radius"]["unit"] == "m"
    assert fields["TimeStepping.end"]["unit"] == "s"
    assert fields["MinimumPressure.value"]["unit"] == "Pa"
    assert fields["Viscosity.alpha"]["unit"] == "1"
    numbers = [key for key, field in fields.items() if '"number"' in str(field)]
    assert [key for key in numbers if "unit" not in fields[key]] == []
