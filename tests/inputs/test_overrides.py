import pytest

from mpisph.case import case_from_dict, load_case
from mpisph.core.errors import CaseError


@pytest.fixture
def path(tmp_path, data):
    path = tmp_path / "case.toml"
    path.write_text(case_from_dict(data).to_toml())
    return path


def test_numbers_strings_and_choices(path):
    case = load_case(
        path,
        [
            "scheme.viscosity.alpha=2",
            "scheme.strength = none",
            "scheme.self_term=false",
            'time.end="3 us"',
            "scheme.p_min.value=-inf",
            "title=a = b",
        ],
    )
    assert case.scheme.viscosity.alpha == 2.0
    assert case.scheme.strength == "none"
    assert case.scheme.self_term is False
    assert case.end_time == 3e-6
    assert case.scheme.p_min.value == float("-inf")
    assert case.title == "a = b"


@pytest.mark.parametrize("body", ["0", "ball"])
def test_bodies_by_index_and_by_name(path, body):
    case = load_case(path, [f"bodies.{body}.velocity=7 km/s"])
    assert case.bodies[0].velocity == 7000.0


def test_the_last_override_wins(path):
    case = load_case(path, ["time.end=1us", "time.end=4us"])
    assert case.end_time == 4e-6


def test_missing_sections_are_made(path):
    assert load_case(path, ["measured.clock_offset=1us"]).measured is not None


def test_an_empty_value_removes_a_key(path):
    removals = ["resolution.npr=", "resolution.reference="]
    case = load_case(path, [*removals, "resolution.spacing=1mm"])
    assert case.spacing == 1e-3


def test_materials_from_cards_can_be_changed(tmp_path, path):
    case = load_case(path, ["materials.cu-ofhc.elastic-plastic.yield_strength=0.3 GPa"])
    strength = case.materials["cu-ofhc"].constants("elastic-plastic")
    assert strength.yield_strength == 0.3e9


def test_bad_values_name_the_override(path):
    with pytest.raises(CaseError) as caught:
        load_case(path, ["bodies.ball.velocity=7 kg"])
    (problem,) = caught.value.problems
    assert str(problem).startswith("--set bodies.ball.velocity=7 kg: ")
    assert problem.key == "bodies.0.velocity"
    assert problem.line is None


def test_typos_name_the_override_and_the_nearest_key(path):
    with pytest.raises(
        CaseError, match=r"--set tim\.end=1us: .*: unknown key"
    ) as caught:
        load_case(path, ["tim.end=1us"])
    assert caught.value.problems[0].suggestion == "time"


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("title=" + "[" * 300 + "]" * 300, "nested too deeply"),
        ("title=" + "9" * 5000, "at most 200 characters"),
        ("time.end=" + "9" * 5000, "a string of 5000 characters"),
        (".".join("a" * 30) + "=1", "a key of at most 20 parts"),
        ("title=" + "x" * 200_000, "expected at most 100000 characters"),
        ("bodies." + "9" * 5000 + ".velocity=1", "has no element"),
        ("bodies.\u00b2.velocity=1", "has no element"),
        ("title=a\udcffb", "expected UTF-8"),
        ("title=a\n[b]\nc=1", "one line without control characters"),
    ],
)
def test_absurd_overrides_are_told_on_one_short_line(path, override, message):
    with pytest.raises(CaseError) as caught:
        load_case(path, [override])
    (problem,) = caught.value.problems
    assert problem.file.startswith("--set ")
    assert message in problem.expected
    assert str(problem).isprintable()
    assert len(str(problem)) < 1000


@pytest.mark.parametrize(
    "override",
    [
        "",
        "time.end",
        "=3",
        "time..end=3",
        "bodies.7.velocity=1",
        "bodies.-1.velocity=1",
        "bodies.bal.velocity=1",
        "title.x=1",
        "title.x.y=1",
        "bodies.x=",
    ],
)
def test_overrides_that_cannot_be_applied(path, override):
    with pytest.raises(CaseError) as caught:
        load_case(path, [override])
    (problem,) = caught.value.problems
    assert problem.file == f"--set {override}"


def test_a_mistyped_body_gets_a_suggestion(path):
    with pytest.raises(CaseError, match="did you mean ball"):
        load_case(path, ["bodies.bal.velocity=1"])


def test_all_overrides_and_the_file_are_reported_together(path):
    with pytest.raises(CaseError) as caught:
        load_case(path, ["foo", "time.end=-1", "scheme.kappa=9"])
    assert len(caught.value.problems) == 3
