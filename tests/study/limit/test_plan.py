"""What `mpisph limit` seeks: options, cases of the tries, where it begins."""

import pytest
from shields import shield_case

from mpisph.analysis.ballistic import critical_diameter
from mpisph.case import CaseSource
from mpisph.core.errors import CaseError
from mpisph.study.limit.plan import (
    QUANTITIES,
    equation_limit,
    first_guess,
    make_plan,
    make_try,
    parse_between,
    parse_points,
    whipple,
)

FIND = QUANTITIES["diameter"]


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(shield_case().to_toml())
    return CaseSource(path)


def plan_of(source, find="diameter", at=None, between=None, overrides=()):
    along = None if at is None else parse_points(at)
    return make_plan(source, overrides, QUANTITIES[find], along, between)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("velocity=2,3.5,7km/s", [2e3, 3.5e3, 7e3]),
        ("velocity=2 , 3000 m/s, 4 km/s", [2e3, 3e3, 4e3]),
        ("velocity=2", [2e3]),
        ("thickness=1,2 mm", [1e-3, 2e-3]),
        ("standoff=5cm", [0.05]),
    ],
)
def test_numbers_take_the_last_unit(text, values):
    quantity, found = parse_points(text)
    assert quantity.name == text.partition("=")[0]
    assert found == pytest.approx(values)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("velocty=2km/s", "did you mean velocity"),
        ("velocity", "expected values"),
        ("velocity=2,,3km/s", "expected values"),
        ("velocity=2,3mm", "'2'"),
        ("velocity=-2km/s", "more than 0"),
        ("diameter=fast", "'fast'"),
    ],
)
def test_bad_points_are_refused(text, words):
    with pytest.raises(ValueError, match=words):
        parse_points(text)


def test_ends_are_two_values():
    assert parse_between("6,2mm", FIND) == (2e-3, 6e-3)
    for text in ("2mm", "1,2,3mm", "2,2mm", ",2mm"):
        with pytest.raises(ValueError, match="expected two"):
            parse_between(text, FIND)


def test_tries_are_cases_of_the_point_and_the_value(source):
    plan = plan_of(source, at="velocity=3,7km/s", overrides=["resolution.npr=5"])
    trial = make_try(plan, 1, 2.5e-3)
    assert trial.case.shield.projectile.diameter == 2.5e-3
    assert trial.case.shield.projectile.velocity == 7e3
    assert trial.case.resolution.npr == 5
    assert trial.key != make_try(plan, 0, 2.5e-3).key
    assert trial.key == make_try(plan, 1, 2.5e-3).key


def test_the_equation_is_where_it_begins(source):
    plan = plan_of(source, at="velocity=3,7km/s")
    wall = whipple(plan.case)
    for point, velocity in enumerate((3e3, 7e3)):
        want = float(critical_diameter(wall, velocity))
        assert equation_limit(plan, point) == pytest.approx(want, rel=1e-12)
        assert first_guess(plan, point) == pytest.approx(want, rel=1e-3)


def test_the_equation_is_solved_for_the_thickness(source):
    plan = plan_of(source, find="thickness", at="velocity=2.5,5,8km/s")
    wall = whipple(plan.case)
    diameter = plan.case.shield.projectile.diameter
    for point, velocity in enumerate((2.5e3, 5e3, 8e3)):
        t = equation_limit(plan, point)
        stopped = critical_diameter(wall._replace(wall_thickness=t), velocity)
        assert float(stopped) == pytest.approx(diameter, rel=1e-5)


def test_without_an_equation_it_begins_at_the_case(source):
    plan = plan_of(source, find="velocity")
    assert equation_limit(plan, 0) is None
    assert first_guess(plan, 0) == 6.5e3
    assert first_guess(plan_of(source, between=(2e-3, 8e-3)), 0) == pytest.approx(4e-3)


def test_a_case_without_a_shield_is_refused(tmp_path):
    path = tmp_path / "rod.toml"
    path.write_text(
        'title = "a rod"\n[[bodies]]\nname = "rod"\nshape = "cylinder"\n'
        'radius = 0.003\nlength = 0.008\nmaterial = "cu-ofhc"\n'
        '[resolution]\nspacing = 0.001\n[time]\nend = "1 us"\n'
    )
    with pytest.raises(CaseError, match="shield"):
        plan_of(CaseSource(path))


def test_what_is_sought_cannot_be_the_axis(source):
    with pytest.raises(CaseError, match="cannot be the axis"):
        plan_of(source, at="diameter=3,4mm")
    with pytest.raises(CaseError, match="shield"):
        plan_of(source, at="standoff=20km")
