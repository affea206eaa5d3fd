"""What a user is told about a case that cannot be run."""

import math
import os
import pickle

import pytest

from mpisph.case import case_from_dict, load_case
from mpisph.core.errors import CaseError


def problems_of(data):
    with pytest.raises(CaseError) as caught:
        case_from_dict(data)
    return {problem.key: problem for problem in caught.value.problems}


def only_problem(data):
    (problem,) = problems_of(data).values()
    return problem


def test_wrong_dimension_names_the_expected_unit(data):
    data["bodies"][0]["radius"] = "5 kg"
    problem = only_problem(data)
    assert problem.key == "bodies.0.radius"
    assert problem.value == '"5 kg"'
    assert problem.expected.endswith("expected a length in m")


def test_typo_in_a_key_gets_a_suggestion(data):
    data["scheme"] = {"viscosity": {"alpho": 2}}
    problem = only_problem(data)
    assert problem.key == "scheme.viscosity.alpho"
    assert problem.suggestion == "alpha"


def test_unknown_key_without_a_neighbour_lists_the_keys(data):
    data["parallel"] = {"xyz": 1}
    assert "cut, rebalance_every, imbalance_threshold" in only_problem(data).expected


@pytest.mark.parametrize(
    ("section", "value", "suggestion"),
    [
        ({"eos": "tilotson"}, '"tilotson"', '"tillotson"'),
        ({"smoothing": "klassic"}, '"klassic"', '"classic"'),
        ({"strength": "xyz"}, '"xyz"', None),
    ],
)
def test_typo_in_a_choice_gets_a_suggestion(data, section, value, suggestion):
    data["scheme"] = section
    problem = only_problem(data)
    assert problem.value == value
    assert problem.suggestion == suggestion


def test_cut_is_one_of_three(data):
    data["parallel"] = {"cut": "rz"}
    problem = only_problem(data)
    assert (problem.key, problem.value) == ("parallel.cut", '"rz"')
    for choice in ("auto", "z", "r"):
        assert f'"{choice}"' in problem.expected
        assert case_from_dict({**data, "parallel": {"cut": choice}})


def test_missing_key_is_described_with_its_unit(data):
    del data["bodies"][1]["thickness"]
    problem = only_problem(data)
    assert problem.key == "bodies.1.thickness"
    assert problem.expected == "required: Thickness along z [m]"


def test_unknown_and_missing_shapes(data):
    data["bodies"][0]["shape"] = "sphera"
    del data["bodies"][1]["shape"]
    problems = problems_of(data)
    assert problems["bodies.0.shape"].suggestion == '"sphere"'
    assert problems["bodies.1.shape"].expected.startswith("required")


@pytest.mark.parametrize("radius", [0, -1, "-1 mm", math.nan, math.inf, True, "x", {}])
def test_sizes_are_positive_and_finite(data, radius):
    data["bodies"][0]["radius"] = radius
    assert only_problem(data).key == "bodies.0.radius"


@pytest.mark.parametrize("value", [1.0, "1 Pa", math.inf, math.nan])
def test_pressure_limit_is_negative_or_minus_infinity(data, value):
    data["scheme"] = {"p_min": {"value": value}}
    assert only_problem(data).key == "scheme.p_min.value"


@pytest.mark.parametrize("kappa", [1.0, 4.5])
def test_kernel_cut_off_is_bounded(data, kappa):
    data["scheme"] = {"kappa": kappa}
    assert only_problem(data).key == "scheme.kappa"


def test_inner_radius_is_less_than_outer(data):
    data["bodies"][1]["inner_radius"] = "20 mm"
    assert only_problem(data).key == "bodies.1.inner_radius"


def test_names_are_unique(data):
    data["bodies"][1]["name"] = "ball"
    assert only_problem(data).key == "bodies.1.name"


def test_a_case_has_bodies(data):
    data["bodies"] = []
    assert "bodies" in problems_of(data)


def test_overlapping_bodies_are_refused(data):
    data["bodies"][0]["position"] = "-4.99 mm"
    problem = only_problem(data)
    assert '"ball" and "wall" overlap' in problem.expected


@pytest.mark.parametrize(
    "resolution", [{}, {"npr": 3, "spacing": "1 mm"}, {"npr": 3, "reference": "bal"}]
)
def test_resolution_is_given_exactly_once(data, resolution):
    data["resolution"] = resolution
    assert only_problem(data).key in {"resolution", "resolution.reference"}


def test_reference_is_needed_without_a_sphere(data):
    del data["bodies"][0]
    assert only_problem(data).key == "resolution.reference"


def test_walls_hold_a_particle(data):
    ball = data["bodies"][0]
    ball.pop("radius")
    ball.update(shape="spherical_shell", outer_radius="5 mm", inner_radius="4.9 mm")
    assert "thinner than the particle spacing" in only_problem(data).expected


def test_unknown_material_gets_a_suggestion(data):
    data["bodies"][0]["material"] = "al-lee2004"
    assert only_problem(data).suggestion == '"al-lee2003"'


def test_incomplete_material_is_one_problem(data):
    data["materials"] = {"cu-ofch": {"elastic-plastic": {"yield_strength": "1 GPa"}}}
    problem = only_problem(data)
    assert problem.key == "materials.cu-ofch"
    assert problem.suggestion == '"cu-ofhc"'
    assert "rho0, elastic-plastic.shear_modulus missing" in problem.expected


def test_a_constant_beside_its_table_is_told_its_place(data):
    data["materials"] = {"cu-ofhc": {"yield_strength": "1 GPa"}}
    problem = only_problem(data)
    assert problem.key == "materials.cu-ofhc.yield_strength"
    assert problem.suggestion == "elastic-plastic.yield_strength"


@pytest.mark.parametrize(
    ("scheme", "body", "key"),
    [
        ({"eos": "ideal-gas"}, {}, "scheme.eos"),
        ({}, {"eos": "ideal-gas"}, "bodies.1.eos"),
        ({"thermal": "heat-capacity"}, {}, "scheme.thermal"),
        ({"failure": "grady-kipp"}, {}, "scheme.failure"),
        ({"strength": "steinberg-guinan"}, {}, "scheme.strength"),
        ({"ductile": "johnson-cook-damage"}, {}, "scheme.ductile"),
    ],
)
def test_a_model_needs_its_constants(data, scheme, body, key):
    data["scheme"] = scheme
    data["bodies"][1].update(body)
    assert only_problem(data).key == key


def test_a_materials_own_choice_needs_its_constants(data):
    data["materials"] = {"cu-ofhc": {"failure": "grady-kipp"}}
    problem = only_problem(data)
    assert problem.key == "materials.cu-ofhc.failure"
    words = "has no Grady-Kipp constants; it has those of minimum-pressure, spall"
    assert words in problem.expected


@pytest.mark.parametrize(
    ("choice", "key"),
    [
        ({"strength": "johnson-cook"}, "strength"),
        ({"strength": "steinberg-guinan"}, "strength"),
        ({"ductile": "johnson-cook-damage"}, "ductile"),
    ],
)
def test_what_softens_by_heat_needs_a_temperature(data, choice, key):
    cold = {"thermal": "none", "strength": "elastic-plastic", "ductile": "none"}
    data["materials"] = {"cu-ofhc": cold | choice}
    problem = only_problem(data)
    assert problem.key == f"materials.cu-ofhc.{key}"
    assert "has no temperature" in problem.expected
    assert 'set materials.cu-ofhc.thermal = "heat-capacity"' in problem.expected
    data["materials"]["cu-ofhc"]["thermal"] = "heat-capacity"
    assert case_from_dict(data)


def test_a_scheme_without_temperatures_is_told_once(data):
    data["scheme"] = {"thermal": "none"}
    data["bodies"][0]["material"] = "al-6061-t6"
    data["bodies"][1]["material"] = "cu-ofhc"
    problem = only_problem(data)
    assert problem.key == "scheme.thermal"
    for name in ("al-6061-t6", "cu-ofhc"):
        assert f'steinberg-guinan of "{name}"' in problem.expected
    del data["scheme"]["thermal"]
    assert case_from_dict(data)


def test_the_remedy_is_one_that_the_material_has(data):
    softening = {"shear_modulus": 48e9, "A": 9e7, "B": 0.0, "n": 1.0, "C": 0.0}
    softening |= {"m": 1.0, "melting_temperature": 1356.0}
    shock = {"c0": 3940.0, "slope": 1.489, "gamma0": 2.02}
    data["bodies"][1]["material"] = "mine"
    data["materials"] = {
        "mine": {
            "rho0": 8930.0,
            "strength": "johnson-cook",
            "johnson-cook": softening,
            "mie-grueneisen": shock,
        }
    }
    assert "give it the constants of a thermal model" in only_problem(data).expected


def test_what_heat_does_not_change_needs_no_temperature(data):
    data["materials"] = {
        "cu-ofhc": {
            "strength": "steinberg-guinan",
            "steinberg-guinan": {"B": 0.0},
            "ductile": "johnson-cook-damage",
            "johnson-cook-damage": {"D5": 0.0},
        }
    }
    assert case_from_dict(data)


@pytest.mark.parametrize(
    ("table", "changes", "words"),
    [
        ("heat-capacity", {"melting_temperature": "280 K"}, "must exceed reference_t"),
        ("johnson-cook", {"melting_temperature": "280 K"}, "must exceed reference_t"),
        # The constants of 7075-T6 as its authors' abstract prints them.
        ("johnson-cook-damage", {"D1": 0.451, "D2": -0.952, "D3": -0.068}, "D1, D2"),
        ("johnson-cook-damage", {"D1": -1.0, "D2": 0.9, "D3": 1.0}, "pure shear"),
        ("johnson-cook-damage", {"D4": -0.1}, "D4: matter would break at once"),
        ("johnson-cook-damage", {"D5": -1.5}, "D5: matter would break at once"),
        ("steinberg-guinan", {"yield_strength": "1 GPa"}, "largest_yield_strength"),
        ("steinberg-guinan", {"A": 2.83}, "expected at most 1e-06"),
        ("mie-grueneisen", {"gamma_slope": -1.0}, "expected at least 0"),
        ("spall", {"strength": "0 Pa"}, "expected at least 1"),
    ],
)
def test_a_bad_card_is_refused_with_key_and_reason(data, table, changes, words):
    data["materials"] = {"cu-ofhc": {table: changes}}
    problem = only_problem(data)
    assert problem.key.startswith(f"materials.cu-ofhc.{table}")
    assert words in problem.expected


def test_a_material_without_any_equation_of_state_is_refused(data):
    data["bodies"][1]["material"] = "mine"
    data["materials"] = {"mine": {"rho0": 2e3}}
    with pytest.raises(CaseError) as caught:
        case_from_dict(data)
    keys = {problem.key for problem in caught.value.problems}
    assert keys == {"scheme.eos", "scheme.strength"}


def test_a_gas_has_no_pores(data):
    gas = {"rho0": 1.2, "eos": "ideal-gas", "strength": "none", "porosity": "p-alpha"}
    gas["ideal-gas"] = {"gamma": 1.4, "c0": 340.0}
    gas["p-alpha"] = {"initial_distension": 2, "elastic_pressure": 0}
    gas["p-alpha"]["solid_pressure"] = "1 MPa"
    data["materials"] = {"air": gas}
    data["bodies"][1]["material"] = "air"
    problem = only_problem(data)
    assert problem.key == "materials.air.porosity"
    assert problem.expected == '"air" is a gas, which has no pores'


def test_tillotson_energies_are_in_order(data):
    data["materials"] = {"al-lee2003": {"tillotson": {"Es": "20 MJ/kg"}}}
    assert "Es_prime must exceed Es" in only_problem(data).expected


def test_fixed_step_needs_a_size(data):
    data["time"]["step"] = "fixed"
    assert only_problem(data).key == "time.dt"


def test_run_needs_an_end(data):
    del data["time"]
    data["output"] = {"every": "1 us"}
    assert only_problem(data).key == "time.end"


def test_output_after_the_end_is_refused(data):
    data["output"] = {"times": ["1 us", "3 us"]}
    assert only_problem(data).key == "output.times.1"


def test_snapshots_are_not_without_number(data):
    data["output"] = {"every": "1 fs"}
    assert only_problem(data).key == "output.every"


def test_measured_lengths_need_a_plate(data):
    data["measured"] = {"plate": "ball"}
    assert only_problem(data).key == "measured.plate"
    data["measured"] = {}
    del data["bodies"][1]
    assert only_problem(data).key == "measured"


def test_broken_rules_are_reported_beside_broken_fields(data):
    data["title"] = 3
    data["bodies"][0].update(radius="-5 mm", material="al-lee")
    data["bodies"][1]["name"] = "ball"
    data["resolution"] = {}
    assert set(problems_of(data)) == {
        "title",
        "bodies.0.radius",
        "bodies.0.material",
        "bodies.1.name",
        "resolution",
    }


@pytest.mark.parametrize(
    "change",
    [
        {"bodies": 3},
        {"bodies": [3]},
        {"bodies": {"a": 1}},
        {"bodies": [{"shape": ["sphere"], "name": 3, "material": {}}]},
        {"materials": 3},
        {"materials": {"al-lee2003": 3}},
        {"materials": {"al-lee2003": {"sources": 3}}},
        {"materials": {"al-lee2003": {"rho0": {"value": 3}}}},
        {"materials": {"al-lee2003": {"tillotson": 3}}},
        {"resolution": []},
        {"scheme": {"eos": []}},
        {"measured": {"exposures": [3]}},
        {"output": {"times": 3}},
        {"time": {"end": 10**400}},
    ],
)
def test_malformed_data_never_escapes_as_another_error(data, change):
    assert problems_of({**data, **change})


def test_lines_of_problems(tmp_path):
    path = tmp_path / "bad.toml"
    path.write_text(
        'title = "x"\n'  # 1
        "scheme.viscosity.alpha = -1\n"  # 2
        "resolution = { npr = 10, nph = 0 }\n"  # 3
        "[output]\n"  # 4
        "times = [1,\n"  # 5
        "  # a comment\n"  # 6
        "  -2]\n"  # 7
        "[[bodies]]\n"  # 8
        'shape = "sphere"\n'  # 9
        'name = "a"\n'  # 10
        'material = "cu-ofhc"\n'  # 11
        "[[bodies]]\n"  # 12
        'shape = "sphere"\n'  # 13
        "radius = -1\n"  # 14
        'name = "b"\n'  # 15
        'material = "cu-ofhc"\n'  # 16
    )
    with pytest.raises(CaseError) as caught:
        load_case(path)
    assert {problem.key: problem.line for problem in caught.value.problems} == {
        "scheme.viscosity.alpha": 2,
        "resolution.nph": 3,
        "output.times.1": 7,
        "bodies.0.radius": 8,
        "bodies.1.radius": 14,
    }
    assert all(problem.file == str(path) for problem in caught.value.problems)
    text = str(caught.value)
    assert text.startswith("5 problems:\n")
    assert f"{path}:14: bodies.1.radius = -1: expected at least 1e-09 m" in text


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("a = 1\nb = = 2\n", 2),
        ('title = "x', 1),
        ("a=1\na=2\n", 2),
        ("# \u2028 \x85 no ends of lines\nb = =\n", 2),
        ("a = 1\r\nb = 2\rc = 3\n", 2),
        ("a = 1\n\n\n[b", 4),
    ],
)
def test_syntax_errors_have_a_line(tmp_path, text, line):
    path = tmp_path / "bad.toml"
    path.write_bytes(text.encode())
    with pytest.raises(CaseError, match="not valid TOML") as caught:
        load_case(path)
    (problem,) = caught.value.problems
    assert problem.line == line


@pytest.mark.parametrize("deep", ["[" * 100_000, "[" * 150 + "]" * 150])
def test_deep_nesting_is_an_error_not_a_crash(tmp_path, deep):
    path = tmp_path / "deep.toml"
    path.write_text(f"\na = {deep}\n")
    with pytest.raises(CaseError, match="nested too deeply"):
        load_case(path)


@pytest.mark.parametrize("number", ["9" * 5000, "1_0" * 3000, "-" + "8" * 4301])
def test_numbers_too_long_to_read_have_a_line(tmp_path, number):
    path = tmp_path / "long.toml"
    path.write_text(f"a = 1\nb = {number}\n")
    with pytest.raises(CaseError, match=r"long\.toml:2: a whole number beyond"):
        load_case(path)


def test_large_files_are_refused_without_being_read(tmp_path):
    path = tmp_path / "large.toml"
    path.write_text("#" * 1_000_001)
    with pytest.raises(CaseError, match="is larger than 1000000 bytes"):
        load_case(path)


def test_devices_and_pipes_are_refused_at_once(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    for path in ("/dev/zero", tmp_path / "pipe.toml"):
        with pytest.raises(CaseError, match="is no regular file; expected a TOML"):
            load_case(path)


def test_missing_file_suggests_a_neighbour(tmp_path):
    (tmp_path / "impact.toml").write_text("")
    with pytest.raises(CaseError, match=r"no such file; did you mean .*impact\.toml"):
        load_case(tmp_path / "impakt.toml")


def test_directory_is_refused(tmp_path):
    with pytest.raises(CaseError, match="is a directory"):
        load_case(tmp_path)


def test_other_encodings_are_refused_with_a_line(tmp_path):
    path = tmp_path / "latin.toml"
    path.write_bytes(b'title = "x"\n# Gr\xfcneisen\n')
    with pytest.raises(CaseError, match=r"latin\.toml:2: byte 0xfc is no UTF-8"):
        load_case(path)


def test_byte_order_mark_and_dos_lines_are_accepted(tmp_path, data):
    path = tmp_path / "dos.toml"
    text = case_from_dict(data).to_toml()
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    assert load_case(path) == case_from_dict(data)


def test_errors_can_be_sent_between_ranks(data):
    data["title"] = 3
    with pytest.raises(CaseError) as caught:
        case_from_dict(data)
    again = pickle.loads(pickle.dumps(caught.value))
    assert again.problems == caught.value.problems


@pytest.mark.parametrize(
    ("given", "key", "expected", "suggestion"),
    [
        ({"value": 8960, "sources": "x"}, "sources", "unknown key", "source"),
        ({"val": 8960, "source": "x"}, "val", "unknown key", "value"),
        ({"value": 8960}, "source", "required", None),
        ({}, "value", "required", None),
        ({"value": 1, "source": "x", "unit": "g"}, "unit", "unknown key", None),
    ],
)
def test_a_wrong_key_of_a_sourced_number_is_told_where_it_is(
    data, given, key, expected, suggestion
):
    data["materials"] = {"cu-ofhc": {"rho0": given}}
    problem = only_problem(data)
    assert problem.key == f"materials.cu-ofhc.rho0.{key}"
    assert problem.expected.startswith(expected)
    assert "{ value = ..., source = ... }" in problem.expected
    assert problem.suggestion == suggestion
