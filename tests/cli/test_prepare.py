"""The commands before a run: materials and init."""

import re
import tomllib

import pytest
from click.testing import CliRunner

from mpisph.case import case_from_dict, load_case
from mpisph.case.draft import Draft, draft_case
from mpisph.case.plausibility import find_warnings
from mpisph.cli.main import cli
from mpisph.core.errors import CaseError
from mpisph.materials import card_names
from mpisph.materials.library import card_data

SIZES = ("--sphere", "3.2mm", "--plate", "1mm", "--velocity", "6.7km/s")


def invoke(*arguments, **options):
    return CliRunner().invoke(cli, [*map(str, arguments)], **options)


def test_all_cards_are_listed_with_their_models():
    output = invoke("materials").output
    rows = [line.split("│") for line in output.splitlines() if "│" in line]
    assert [row[1].strip() for row in rows if row[1].strip()] == [*card_names()]
    assert output.count("spall") == sum("spall" in card_data(c) for c in card_names())


def test_a_card_is_printed_wholly():
    output = invoke("materials", "al-6061-t6").output
    for text in ("2703 kg/m3", "5240 m/s", "2.9e+08 Pa", "UCRL-MA-106439", "rho0 c^2"):
        assert text in output
    assert re.search(r"elongation +│ 0.12 +│ Aluminum Association", output)
    numbers = [line for line in output.splitlines() if "heating_share" in line]
    assert "default" in numbers[0]


def test_the_curves_of_a_card_are_drawn(tmp_path):
    figure = tmp_path / "curves" / "al.png"
    result = invoke("materials", "al-6061-t6", "--plot", figure)
    assert result.exit_code == 0
    assert f"curves in {figure}" in result.output
    assert figure.read_bytes().startswith(b"\x89PNG")
    for names in ((), ("ta", "w")):
        result = invoke("materials", *names, "--plot", figure)
        assert result.exit_code == 2
        assert "--plot draws one CARD" in result.output


def test_cards_that_are_not_there_are_refused(tmp_path):
    error = invoke("materials", "al-6061").exception
    assert isinstance(error, CaseError)
    assert 'did you mean "al-6061-t6"?' in str(error)
    error = invoke("materials", tmp_path / "x.toml").exception
    assert "no such file" in str(error)


def test_init_writes_a_case_that_can_be_run(tmp_path):
    path = tmp_path / "impact.toml"
    result = invoke("init", path, *SIZES)
    assert result.exit_code == 0
    assert f"written to {path}" in result.output
    case = load_case(path)
    sphere, plate = case.bodies
    assert (sphere.radius, sphere.velocity) == (1.6e-3, 6700.0)
    assert sphere.position == -sphere.radius
    assert (sphere.material, plate.material) == ("al-2017-t4", "al-6061-t6")
    assert "al-2017-t4" in case.title
    assert (plate.thickness, plate.position) == (1e-3, 0.0)
    assert plate.thickness / case.spacing >= 4.0
    assert plate.radius >= 3.0 * 2.0 * sphere.radius
    # The cloud has flown some diameters of the sphere.
    assert 4.0 < case.end_time * 6700.0 / 3.2e-3 < 10.0
    assert 10 <= len(case.output_times) <= 14
    assert path.read_text().count("#") > 8


@pytest.mark.parametrize("velocity", [0.5e3, 2.9e3, 3e3, 7e3, 15e3])
@pytest.mark.parametrize("wall", [None, 5e-3, 0.3])
@pytest.mark.parametrize("thickness", [0.04, 0.1, 1.0, 3.0])
def test_no_draft_asks_for_what_is_hardly_meant(velocity, wall, thickness):
    """Thickness in diameters; no warning comes before the run."""
    draft = Draft(5e-3, thickness * 5e-3, velocity, "al-2024-t4", "cu-ofhc", wall=wall)
    case = case_from_dict(tomllib.loads(draft_case(draft)))
    assert find_warnings(case) == []


def test_init_takes_what_it_is_given(tmp_path):
    path = tmp_path / "wall.toml"
    more = ("--wall", "50mm", "--wall-thickness", "2mm", "--plate-radius", "2cm")
    more += ("--material", "cu-ofhc", "--plate-material", "al-6061-t6")
    more += ("--npr", 6, "--end", "20us")
    assert invoke("init", path, *SIZES, *more).exit_code == 0
    case = load_case(path)
    assert case.title.endswith(", wall at 50 mm")
    sphere, plate, wall = case.bodies
    materials = [body.material for body in case.bodies]
    assert materials == ["cu-ofhc", "al-6061-t6", "al-6061-t6"]
    assert wall.position == pytest.approx(51e-3)
    assert (wall.thickness, plate.radius) == (2e-3, 2e-2)
    assert (case.resolution.npr, case.end_time) == (6, 2e-5)
    assert sphere.name == case.resolution.reference


def test_with_a_wall_the_run_ends_after_the_arrival():
    case = Draft(3.2e-3, 1e-3, 6.7e3, "cu-ofhc", "cu-ofhc", wall=0.1)
    end = tomllib.loads(draft_case(case))["time"]["end"]
    assert float(end.removesuffix(" us")) * 1e-6 * 6.7e3 > 0.13


def test_the_materials_of_a_draft_choose_their_models():
    draft = Draft(3.2e-3, 1e-3, 2.5e3, "cu-ofhc", "al-6061-t6")
    case = case_from_dict(tomllib.loads(draft_case(draft)))
    for body in case.bodies:
        names = case.body_models(body).names
        assert (names["failure"], names["thermal"]) == ("spall", "heat-capacity")


def test_a_card_of_ones_own_counts_from_the_file(tmp_path):
    (tmp_path / "a b.toml").write_text(
        "rho0 = 7850\n[mie-grueneisen]\nc0 = 4600\nslope = 1.49\ngamma0 = 2\n"
        "[elastic-plastic]\nshear_modulus = 8e10\nyield_strength = 8e8\n"
    )
    (tmp_path / "a b.toml").rename(tmp_path / "steel.toml")
    path = tmp_path / "case.toml"
    assert invoke("init", path, *SIZES, "--material", "steel.toml").exit_code == 0
    assert list(load_case(path).materials) == ["steel"]


def test_init_replaces_no_file(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text("precious")
    error = invoke("init", path, *SIZES).exception
    assert isinstance(error, CaseError)
    assert "is there already" in str(error)
    assert path.read_text() == "precious"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--sphere", "3.2mm"), "expected --plate, --velocity"),
        ((*SIZES, "--sphere", "3.2 km/s"), "expected a length"),
        ((*SIZES, "--plate", "0mm"), "expected more than 0"),
        ((*SIZES, "--wall-thickness", "1mm"), "--wall-thickness without --wall"),
    ],
)
def test_wrong_options_are_named(tmp_path, arguments, message):
    result = invoke("init", tmp_path / "case.toml", *arguments)
    assert result.exit_code == 2
    assert message in result.output
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--material", "al-6061"), 'did you mean "al-6061-t6"?'),
        (("--material", 'a"b'), "bodies.0.material"),
        (("--plate", "0.01mm"), "give a resolution with --npr"),
        (("--wall", "1000km"), "expected at most"),
    ],
)
def test_what_is_no_sound_case_is_not_written(tmp_path, arguments, message):
    error = invoke("init", tmp_path / "case.toml", *SIZES, *arguments).exception
    assert isinstance(error, CaseError)
    assert message in str(error)
    assert not list(tmp_path.iterdir())


def test_on_a_terminal_init_asks_for_what_is_missing(tmp_path, monkeypatch):
    path = tmp_path / "case.toml"
    monkeypatch.setattr("mpisph.cli.prepare._on_terminal", lambda: True)
    given = ("--plate", "1mm")
    result = invoke("init", path, *given, input="3.2 m/s\n3.2mm\n6.7km/s\n")
    assert result.exit_code == 0
    assert result.output.count("diameter of the sphere") == 2
    assert "thickness" not in result.output
    assert load_case(path).bodies[0].radius == 1.6e-3


def test_a_missing_folder_is_named(tmp_path):
    done = invoke("init", tmp_path / "nowhere" / "case.toml", *SIZES)
    assert done.exit_code == 2
    assert f"there is no folder {tmp_path / 'nowhere'}" in done.output
