"""Every field has bounds, and what is refused is told with its bound and its unit."""

import pytest

from mpisph.case import case_from_dict, case_schema
from mpisph.core.errors import CaseError

UNBOUNDED = {"MinimumPressure.value"}
"""Tension may be without limit; upwards it ends at zero."""


def problems_of(data):
    with pytest.raises(CaseError) as caught:
        case_from_dict(data)
    return caught.value.problems


def only_problem(data):
    (problem,) = problems_of(data)
    return problem


def fields():
    schema = case_schema()
    for part, node in {"Case": schema, **schema["$defs"]}.items():
        for key, field in node.get("properties", {}).items():
            yield f"{part}.{key}", field


def is_bounded(option):
    """Say whether a schema allows no value without limit."""
    if option.get("type") in {"number", "integer"}:
        text = str(list(option))
        return "inimum" in text and "aximum" in text
    if option.get("type") == "string":
        return "maxLength" in option or "enum" in option or "const" in option
    if option.get("type") == "array":
        return "maxItems" in option
    if option.get("type") == "object" and "properties" not in option:
        return "maxProperties" in option
    return True


def test_every_field_has_bounds():
    unbounded = set()
    for name, field in fields():
        # A string beside a number is a number with its unit; it has that one's bounds.
        quantity = "unit" in field
        for option in [field, *field.get("anyOf", [])]:
            if not is_bounded(option) and not (
                quantity and option.get("type") == "string"
            ):
                unbounded.add(name)
    assert unbounded == UNBOUNDED


@pytest.mark.parametrize(
    ("key", "value", "expected"),
    [
        ("title", "x" * 201, "at most 200 characters"),
        ("title", " ", "some text"),
        ("title", "a\nb", "one line without control characters"),
        ("title", "a\x1b[31m", "one line without control characters"),
        ("title", "a\u2028b", "one line without control characters"),
        ("title", "a\u202eb", "one line without control characters"),
        ("title", "a\u2066b", "one line without control characters"),
        ("title", "a\u200bb", "one line without control characters"),
        ("resolution.npr", 0, "at least 1"),
        ("resolution.npr", 2_000_000, "at most 1e+06"),
        ("resolution.npr", 10.0, "a whole number"),
        ("resolution.npr", True, "a whole number"),
        ("resolution.nph", 0.4, "at least 0.5"),
        ("resolution.nph", 11, "at most 10"),
        ("resolution.nph", "2 mm", "a number without a unit"),
        ("bodies.0.radius", "0.9 nm", "at least 1e-09 m"),
        ("bodies.0.radius", "1001 km", "at most 1e+06 m"),
        ("bodies.0.position", "-1001 km", "at least -1e+06 m"),
        ("bodies.0.velocity", "1001 km/s", "at most 1e+06 m/s"),
        ("bodies.0.name", "b" * 81, "at most 80 characters"),
        ("bodies.1.inner_radius", "-1 mm", "at least 0 m"),
        ("scheme.viscosity.alpha", -1, "at least 0"),
        ("scheme.viscosity.beta", 101, "at most 100"),
        ("scheme.viscosity.epsilon", 1.5, "at most 1"),
        ("scheme.heat.g1", 101, "at most 100"),
        ("scheme.p_min.value", "1 Pa", "at most 0 Pa"),
        ("scheme.sound_speed_floor", 2, "at most 1"),
        ("time.end", "0.1 fs", "at least 1e-15 s"),
        ("time.end", "12 days", "at most 1e+06 s"),
        ("time.cfl", 1e-5, "at least 0.0001"),
        ("output.every", -1, "at least 1e-15 s"),
        ("output.times", [1e-6] * 1001, "at most 1000 elements"),
        ("output.history_every", 2_000_000_000, "at most 1e+09"),
        ("measured.clock_offset", "2 s", "at most 1 s"),
        ("measured.min_velocity_fraction", 1.1, "at most 1"),
        ("measured.quantile", 0, "more than 0"),
        ("limits.density_ratio_max", 1, "more than 1"),
        ("limits.step_ratio_min", 2, "at most 1"),
        ("parallel.imbalance_threshold", -0.1, "at least 0"),
        ("materials.cu-ofhc.rho0", "1e10 g/cm3", "at most 1e+06 kg/m^3"),
        ("materials.cu-ofhc.mie-grueneisen.c0", 0.1, "at least 1 m/s"),
        ("materials.cu-ofhc.linear.bulk_modulus", "1e7 GPa", "at most 1e+15 Pa"),
        ("materials.cu-ofhc.mie-grueneisen.gamma0", 21, "at most 20"),
        ("materials.cu-ofhc.mie-grueneisen.slope", 0, "more than 0"),
        ("materials.cu-ofhc.description", "x" * 501, "at most 500 characters"),
        ("materials.al-lee2003.tillotson.E0", "1e10 MJ/kg", "at most 1e+15 J/kg"),
        ("materials.al-lee2003.tillotson.B", "-1e7 GPa", "at least -1e+15 Pa"),
    ],
)
def test_a_value_out_of_bounds_is_told_the_bound(data, key, value, expected):
    put(data, key, value)
    problem = only_problem(data)
    assert problem.key == key
    assert problem.expected.endswith(f"expected {expected}")


def put(data, key, value):
    """Set a dotted key, making tables on the way."""
    *path, last = (int(part) if part.isdecimal() else part for part in key.split("."))
    for part in path:
        data = data[part] if isinstance(part, int) else data.setdefault(part, {})
    data[last] = value


def test_too_many_bodies_exposures_and_materials(data):
    ball = data["bodies"][0]
    many = [{**ball, "name": f"b{i}", "position": 0.1 * i} for i in range(101)]
    problem = only_problem({**data, "bodies": many})
    assert (problem.key, problem.value) == ("bodies", None)
    assert problem.expected == "expected at most 100 elements"
    exposure = {"time": "1 us", "source": "a"}
    problem = only_problem({**data, "measured": {"exposures": 101 * [exposure]}})
    assert problem.key == "measured.exposures"
    full = (
        case_from_dict(data)
        .materials["cu-ofhc"]
        .model_dump(exclude_none=True, by_alias=True)
    )
    problem = only_problem({**data, "materials": {f"m{i}": full for i in range(101)}})
    assert problem.key == "materials"


def test_materials_have_names_that_bodies_could_use(data):
    own = (
        case_from_dict(data)
        .materials["cu-ofhc"]
        .model_dump(exclude_none=True, by_alias=True)
    )
    problem = only_problem({**data, "materials": {"my copper": own}})
    assert problem.key == "materials.my copper"
    assert problem.expected.startswith("expected letters, digits")


def test_a_solid_yields_before_it_shears(data):
    strength = {"yield_strength": "50 GPa"}
    data["materials"] = {"cu-ofhc": {"elastic-plastic": strength}}
    assert "must not exceed shear_modulus = 4.77e+10" in only_problem(data).expected
    strength["shear_modulus"] = 0.0
    assert case_from_dict(data)


def test_exposures_come_after_the_first_contact(data):
    exposures = [{"time": "6 us", "source": "a"}, {"time": "1 us", "source": "a"}]
    data["measured"] = {"exposures": exposures, "clock_offset": "-1 us"}
    problem = only_problem(data)
    assert problem.key == "measured.clock_offset"
    assert problem.expected.startswith("expected more than -1e-06 s")
    data["measured"]["clock_offset"] = "-0.99 us"
    assert case_from_dict(data)


@pytest.mark.parametrize(
    ("resolution", "key", "count"),
    [
        # The sphere's half disc and the plate over the area of a cell, in mm.
        ({"npr": 100_000}, "resolution.npr", (39.3 + 40.0) / 0.00005**2),
        ({"spacing": "0.1 um"}, "resolution.spacing", (39.3 + 40.0) / 0.0001**2),
    ],
)
def test_particles_are_counted_beforehand(data, resolution, key, count):
    data["resolution"] = resolution
    data["title"] = ""
    problems = {problem.key: problem for problem in problems_of(data)}
    assert set(problems) == {"title", key}
    expected = f"about {count:.1e} particles; expected at most 1e+09"
    assert problems[key].expected == expected


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"time": {"end": 20}}, "time.end"),
        ({"time": {"step": "fixed", "dt": "1 fs", "end": "2 us"}}, "time.end"),
        ({"time": {"dt": "1 fs", "end": "2 us"}}, "time.end"),
        ({"time": {}, "output": {"times": ["1 us", 30]}}, "output.times.1"),
        (
            {"time": {}, "measured": {"exposures": [{"time": 6, "source": "a"}]}},
            "measured.exposures.0.time",
        ),
    ],
)
def test_steps_are_counted_beforehand(data, change, key):
    data["bodies"][0]["velocity"] = 0.0
    if key.startswith("measured"):
        data["resolution"] = {"npr": 100}
    problem = only_problem({**data, **change})
    assert problem.key == key
    assert "steps of" in problem.expected
    assert problem.expected.endswith("expected at most 1e+08; is the unit right?")


def test_a_body_far_away_is_legal_while_the_search_can_hold_it(data):
    # The spacing is 0.5 mm.
    data["bodies"][0]["position"] = "-490 m"
    assert case_from_dict(data)
    data["bodies"][0]["position"] = "-510 m"
    problem = only_problem(data)
    assert problem.key == "bodies.0"
    assert "reaches 510.005 m from the origin" in problem.expected


def test_a_flight_beyond_the_search_is_a_slip_of_the_time(data):
    data["time"]["end"] = "0.08 s"
    assert case_from_dict(data)
    data["time"]["end"] = "0.09 s"
    problem = only_problem(data)
    assert problem.key == "time.end"
    assert '"ball" moves 540 m' in problem.expected


def test_a_plate_may_not_be_a_film(data):
    data["bodies"][1]["thickness"] = "0.06 mm"
    assert case_from_dict(data)
    data["bodies"][1]["thickness"] = "0.04 mm"
    problem = only_problem(data)
    assert problem.key == "bodies.1"
    assert "thinner than 0.1 of the particle spacing" in problem.expected


def test_a_thousand_mistakes_are_told_and_the_rest_counted(data):
    problems = problems_of({**data, **{f"k{i}": 1 for i in range(1500)}})
    assert len(problems) == 1001
    assert problems[-1].expected == "and 500 more mistakes"


def test_messages_stay_on_one_short_line(data):
    data["x\n\x1b[31m"] = 1
    data["y" * 5000] = 1
    data["bodies"][0]["material"] = "m\r" * 5000
    problems = problems_of(data)
    assert len(problems) == 3
    for problem in problems:
        assert str(problem).isprintable()
        assert len(str(problem)) < 500


@pytest.mark.parametrize(
    "key", ["resolution.npr", "scheme.eos", "bodies.0.shape", "time.end", "output.x"]
)
@pytest.mark.parametrize("power", [1, 1000])
def test_whole_numbers_have_the_64_bits_of_toml(data, key, power):
    put(data, key, -(2 ** (63 * power)) - 1)
    problem = only_problem(data)
    assert (problem.key, problem.value) == (key, None)
    assert "64 bits" in problem.expected


def test_the_largest_whole_number_is_judged_by_its_field(data):
    data["resolution"]["npr"] = 2**63 - 1
    assert only_problem(data).expected == "expected at most 1e+06"
