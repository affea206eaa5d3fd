"""Tests as cases of a study."""

import pytest
from launch import CASES

from mpisph.core.errors import CaseError
from mpisph.study.assess.cases import STUDY_FILE, plan
from mpisph.study.assess.published import read_tests
from mpisph.study.model import load_study

TESTS = read_tests(CASES / "studies" / "whipple-tests.csv")


def test_each_test_is_a_shield(tmp_path):
    made = plan(TESTS[:9], tmp_path / "new", "nine", ["resolution.npr=4"])
    assert not made.refused
    assert made.study.file.title == "nine"
    for test, case in zip(made.computed, made.study.cases, strict=True):
        shield = case.case.shield
        assert shield.projectile.diameter == pytest.approx(test.diameter, rel=1e-11)
        assert shield.projectile.velocity == pytest.approx(test.velocity, rel=1e-11)
        assert shield.projectile.material == test.projectile.card
        (bumper,) = shield.bumpers
        assert bumper.thickness == pytest.approx(test.shield.bumper_thickness, 1e-11)
        assert bumper.standoff == pytest.approx(test.shield.standoff, rel=1e-11)
        assert bumper.material == test.bumper.card
        assert shield.wall.thickness == pytest.approx(test.shield.wall_thickness, 1e-11)
        assert shield.wall.material == test.wall.card
        assert case.case.title == f"test of {test.source} {test.shot}"
        assert case.case.resolution.npr == 4
        assert not case.case.output.figures


def test_it_is_a_study_like_any_other(tmp_path):
    made = plan(TESTS[:3], tmp_path, "three")
    again = load_study(tmp_path / STUDY_FILE)
    assert [c.key for c in again.cases] == [c.key for c in made.study.cases]


def test_what_cannot_be_computed_is_left_out_with_the_reason(tmp_path):
    foil = TESTS[0].shield._replace(bumper_thickness=1e-6)
    thin = TESTS[0]._replace(row="thin", shield=foil)
    made = plan([TESTS[0], thin, TESTS[1]], tmp_path, "one of three")
    assert [test.row for test in made.computed] == [TESTS[0].row, TESTS[1].row]
    assert len(made.study.cases) == 2
    assert "shield.bumpers.0" in made.refused["thin"]
    assert "thinner than" in made.refused["thin"]
    with pytest.raises(CaseError, match=r"none of the tests.*\n.*row thin"):
        plan([thin], tmp_path, "none")


@pytest.mark.parametrize(
    ("override", "text"),
    [
        ("shield.wall.thickness=3 mm", "each test gives its own"),
        ("shield . wall.material = al-6061-t6", "each test gives its own"),
        ("resolution.npr", "expected key=value"),
        ("resolution.nprr=4", "unknown key"),
        ("resolution.npr=-4", "resolution.npr = -4"),
    ],
)
def test_settings_of_no_use_are_refused(tmp_path, override, text):
    with pytest.raises(CaseError) as caught:
        plan(TESTS[:2], tmp_path, "x", [override])
    assert text in str(caught.value)
    assert "--set" in str(caught.value)
    assert len(caught.value.problems) == 1


def test_a_hostile_name_stays_a_title(tmp_path):
    names = ['"; x = [', "a,b\\tc", "#", "$x$ <b>"]
    tests = [
        TESTS[k]._replace(row=f"{k}", source=name, shot="")
        for k, name in enumerate(names)
    ]
    made = plan(tests, tmp_path, "hostile")
    titles = [case.case.title for case in made.study.cases]
    assert titles == [f"test of {name}" for name in names]
