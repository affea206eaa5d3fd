"""Study files: which cases they make, and what is said of mistakes."""

import pytest
from launch import CASES

from mpisph.case import load_case
from mpisph.case.identity import case_key
from mpisph.core.errors import CaseError
from mpisph.study.model import load_study

BASE = CASES / "piekutowski-4-1353.toml"
SHIPPED = sorted(
    path for path in (CASES / "studies").glob("*.toml") if path.stem != "claims"
)

GRID = f"""
title = "a grid"
base = "{BASE}"

[set]
"output.every" = ""
"output.figures" = false

[[parameters]]
name = "nph"
key = "resolution.nph"
values = [1.5, 2.0]

[[parameters]]
name = "alpha"
key = "scheme.viscosity.alpha"
values = [1.0, 2.5, 5.0]

[[derived]]
key = "scheme.viscosity.beta"
parameter = "alpha"
factor = 2.0
"""


def study_of(tmp_path, text):
    path = tmp_path / "grid.toml"
    path.write_text(text)
    return load_study(path)


def test_a_grid_has_every_combination_with_what_follows(tmp_path):
    study = study_of(tmp_path, GRID)
    assert study.name == "grid"
    assert [c.number for c in study.cases] == list(range(6))
    made = [
        (
            c.settings,
            c.case.resolution.nph,
            c.case.scheme.viscosity.alpha,
            c.case.scheme.viscosity.beta,
        )
        for c in study.cases
    ]
    assert made == [
        ({"nph": nph, "alpha": alpha}, nph, alpha, 2.0 * alpha)
        for nph in (1.5, 2.0)
        for alpha in (1.0, 2.5, 5.0)
    ]
    assert all(c.case.output.every is None for c in study.cases)
    assert study.cases[1].name() == "nph = 1.5, alpha = 2.5"


def test_the_overrides_make_the_case_by_hand(tmp_path):
    for c in study_of(tmp_path, GRID).cases:
        assert load_case(BASE, c.overrides) == c.case


def test_variants_bring_their_own_base_and_settings(tmp_path):
    text = GRID.replace(f'base = "{BASE}"', "") + (
        f'[[variants]]\nname = "one"\nbase = "{BASE}"\n'
        f'[[variants]]\nname = "two"\nbase = "{CASES / "paper-base-case.toml"}"\n'
        'set = { "scheme.self_term" = false }\n'
    )
    cases = study_of(tmp_path, text).cases
    assert [c.variant for c in cases] == ["one"] * 6 + ["two"] * 6
    assert [c.case.scheme.self_term for c in cases] == [True] * 6 + [False] * 6
    assert {c.case.resolution.npr for c in cases[6:]} == {6}


def test_values_have_the_unit_of_their_parameter(tmp_path):
    text = GRID.replace('key = "resolution.nph"', 'key = "time.dt"\nunit = "ns"')
    cases = study_of(tmp_path, text).cases
    assert {c.case.time.dt for c in cases} == {1.5e-9, 2e-9}


def test_the_key_is_of_what_a_case_computes(tmp_path):
    keys = [c.key for c in study_of(tmp_path, GRID).cases]
    assert len(set(keys)) == 6
    again = [c.key for c in study_of(tmp_path, GRID).cases]
    assert again == keys
    case = load_case(BASE)
    same = ("title=another", "output.figures=false", "checkpoints.interval=1us")
    for change in (*same, 'parallel.cut="z"'):
        assert case_key(load_case(BASE, [change])) == case_key(case)
    for change in ("time.end=21us", "scheme.kappa=2.9", "output.every=2us"):
        assert case_key(load_case(BASE, [change])) != case_key(case)


@pytest.mark.parametrize(
    ("old", "new", "line", "expected"),
    [
        ('title = "a grid"', "", None, "title: required"),
        ('name = "nph"', 'name = "alpha"', None, "two parameters are called alpha"),
        ('parameter = "alpha"', 'parameter = "beta"', None, "no parameter beta"),
        ('name = "nph"', 'name = "variant"', None, "may not be called variant"),
        ("values = [1.5, 2.0]", "values = []", 12, "at least 1 item"),
        ("factor = 2.0", "factors = 2.0", 22, "unknown key"),
        ('name = "nph"', 'name = "resolution.nph"', 10, "letters, digits, - and _"),
        ("title =", "title", 2, "not valid TOML"),
        ("values = [1.5, 2.0]", f"values = [1{'0' * 40}]", 12, "64 bits"),
    ],
)
def test_a_mistake_is_named_with_its_line(tmp_path, old, new, line, expected):
    with pytest.raises(CaseError, match=expected) as caught:
        study_of(tmp_path, GRID.replace(old, new))
    place = f"grid.toml:{line}:" if line else "grid.toml"
    assert place in str(caught.value)


def test_a_study_without_a_base_is_refused(tmp_path):
    with pytest.raises(CaseError, match="the case file that is varied"):
        study_of(tmp_path, 'title = "nothing"')
    with pytest.raises(CaseError, match="no such file"):
        study_of(tmp_path, GRID.replace("4-1353", "4-1354"))


def test_a_case_is_no_study():
    with pytest.raises(CaseError, match=r"4-1353\.toml:\d+: is a case, not a study"):
        load_study(BASE)


def test_too_many_cases_are_refused(tmp_path):
    values = ", ".join(map(str, range(400)))
    text = GRID.replace("[1.5, 2.0]", f"[{values}]").replace(
        "[1.0, 2.5, 5.0]", f"[{values}]"
    )
    with pytest.raises(CaseError, match="160000 cases; expected at most 100000"):
        study_of(tmp_path, text)


def test_mistakes_of_the_cases_are_named_once(tmp_path):
    text = GRID.replace('"output.figures" = false', '"time.end" = "4 m"')
    with pytest.raises(CaseError) as caught:
        study_of(tmp_path, text)
    assert str(caught.value).count("another dimension") == 1
    assert len(caught.value.problems) == 2
    with pytest.raises(CaseError, match="nph=15"):
        study_of(tmp_path, GRID.replace("1.5, 2.0", "1.5, 15"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_a_shipped_study_makes_distinct_cases(path):
    study = load_study(path)
    assert len({c.key for c in study.cases}) == len(study.cases)
    assert not any(c.case.output.figures for c in study.cases)
    assert study.file.figure is not None


def test_the_shipped_studies_are_the_papers():
    by_name = {path.stem: load_study(path) for path in SHIPPED}
    numbers = {name: len(study.cases) for name, study in by_name.items()}
    # Figure 3 and 4 with and without self-term, figure 3 also with (21) as printed;
    # figure 4 goes on to NPR 10.
    assert numbers["fig3"] == 3 * 7 * 7
    assert numbers["fig4"] == 2 * 6
    assert numbers["fig5"] == 180
    tables = ("table5", "table5-no-self-term", "table5-printed")
    assert {numbers[name] for name in tables} == {798}
    fixed = {"fig3", "fig4", "fig5", "fig6", "fig7", "smoothing", "leads"}
    for name, study in by_name.items():
        steps = {c.case.time.step for c in study.cases}
        assert steps == ({"fixed"} if name in fixed else {"automatic"})
    paper = by_name["table5"].file.paper
    assert len(paper.ranges) == 42
    assert sum(r.low is None for r in paper.ranges) == 4
    assert all(by_name[name].file.paper.ranges == paper.ranges for name in tables)


def test_two_spellings_of_one_key_are_refused(tmp_path):
    text = GRID.replace('"resolution.nph"', '"bodies.1.thickness"')
    text = text.replace("[set]", '[set]\n"bodies.plate.thickness" = "1 mm"')
    with pytest.raises(CaseError, match="are the same key of the case"):
        study_of(tmp_path, text)
