"""Claims: every check tells what is claimed from what is not."""

import math

import pytest
from launch import CASES
from mpi4py import MPI
from rich.console import Console
from studies import ALPHA, small_study

from mpisph.core.errors import CaseError, MpisphError
from mpisph.study.model import load_study
from mpisph.study.paper.checks import CHECKS, Verdict, decide
from mpisph.study.paper.claims import Answer, answer_claims, as_markdown, as_table
from mpisph.study.paper.claims_file import Claim, Try, load_claims
from mpisph.study.runner import run_study

SHIPPED = CASES / "studies" / "claims.toml"


def row(status="completed", **values):
    """A row of a study over `variant`, `nph` and `alpha`."""
    settings = {"variant": "", "nph": 2.0, "alpha": 1.0}
    here = {name: values.pop(name, default) for name, default in settings.items()}
    return {"case": 0, **here, "run": "key", "status": status, **values}


def verdict(rows, **attempt):
    return decide(Try(name="try", study="study", **attempt), None, rows)


def grid(L_b, unstable=()):
    """A grid of 3 x 3 whose L_b is a function of both parameters."""
    return [
        row(
            "unstable" if (nph, alpha) in unstable else "completed",
            nph=nph,
            alpha=alpha,
            L_b=L_b(nph, alpha),
        )
        for nph in (1.0, 2.0, 3.0)
        for alpha in (1.0, 2.0, 3.0)
    ]


def test_unstable_regions():
    regions = (
        {"at_most": {"alpha": 1.0}},
        {"at": {"nph": 1.0}, "at_most": {"alpha": 2}},
    )
    claimed = {(1.0, 1.0), (2.0, 1.0), (3.0, 1.0), (1.0, 2.0)}

    def words(unstable):
        return verdict(
            grid(lambda *_: 1.0, unstable), check="unstable", regions=regions
        )

    assert words(claimed) == Verdict(
        "reproduced",
        "4 of the 4 cases said to be unstable are, and 0 of the 5 others",
    )
    assert words(claimed | {(3.0, 3.0)}).word == "in part"
    assert words({(1.0, 1.0)}).word == "in part"
    assert words({(3.0, 3.0)}).word == "not reproduced"
    assert words(set()).word == "not reproduced"


def test_a_front_that_is_too_fast_counts_as_unstable():
    rows = [row(alpha=1.0, front=7.0), row(alpha=2.0, front=6.0)]
    attempt = {"check": "unstable", "regions": ({"at": {"alpha": 1.0}},)}
    assert verdict(rows, **attempt).word == "not reproduced"
    fast = verdict(rows, **attempt, columns=("front",), limit=6.5)
    assert fast.word == "reproduced"


@pytest.mark.parametrize(("check", "sign"), [("falls", -1.0), ("grows", 1.0)])
def test_monotone(check, sign):
    def word(L_b):
        return verdict(grid(L_b), check=check, along="nph", columns=("L_b",), limit=0.9)

    assert word(lambda nph, alpha: 10.0 + sign * nph + alpha).word == "reproduced"
    assert word(lambda nph, alpha: 10.0 - sign * nph).word == "not reproduced"
    assert word(lambda nph, alpha: 10.0).word == "not reproduced"
    # Right for two of the three values of alpha.
    mixed = word(lambda nph, alpha: 10.0 + sign * nph * (1.0 if alpha < 3.0 else -1.0))
    assert mixed.word == "in part"
    assert "4 of 6 steps" in mixed.figure


def test_a_line_goes_along_its_parameter_past_what_is_unstable():
    rows = grid(lambda nph, alpha: 10.0 - nph, unstable={(2.0, 1.0)})
    found = verdict(rows[::-1], check="falls", along="nph", columns=("L_b",), limit=1.0)
    assert found == Verdict(
        "reproduced",
        "falls in 5 of 5 steps; from the first value to the last by -22.2 %",
    )


@pytest.mark.parametrize(
    ("values", "word"),
    [
        ((1.0, 2.0, 2.5, 2.7), "reproduced"),
        ((1.0, 2.0, 3.1, 3.2), "in part"),
        ((1.0, 2.0, 3.0, 4.1), "not reproduced"),
        ((4.0, 3.0, 2.5, 2.4), "not reproduced"),
    ],
)
def test_growth_by_less(values, word):
    rows = [row(nph=float(k), L_b=value) for k, value in enumerate(values)]
    found = verdict(rows, check="grows_by_less", along="nph", columns=("L_b",))
    assert found.word == word
    assert f"steps of {values[1] - values[0]:+.2f}," in found.figure


def test_the_step():
    def word(change, unstable):
        return verdict(
            grid(lambda nph, alpha: 10.0 + change * nph, unstable),
            check="step",
            along="nph",
            regions=({"at_least": {"nph": 3.0}},),
            columns=("L_b",),
            limit=2.0,
        )

    assert word(0.05, {(3.0, 1.0)}).word == "reproduced"
    assert word(0.05, set()).word == "in part"  # none is unstable
    assert word(0.05, {(1.0, 1.0)}).word == "in part"  # not where it is claimed
    assert word(1.0, {(3.0, 1.0)}).word == "in part"
    assert word(1.0, {(1.0, 1.0)}).word == "not reproduced"
    everywhere = {(nph, alpha) for nph in (1.0, 2.0, 3.0) for alpha in (1.0, 2.0, 3.0)}
    assert word(1.0, everywhere).word == "not reproduced"
    assert "1.0 % (median), 1.0 % (largest)" in word(0.05, set()).figure


def against(variant_value, **attempt):
    rows = [
        row(variant=variant, alpha=alpha, R_b=value * alpha)
        for variant, value in (("base", 10.0), ("other", variant_value))
        for alpha in (1.0, 2.0)
    ]
    rows += attempt.pop("more", [])
    return verdict(
        rows,
        reference={"variant": "base"},
        regions=({"at": {"variant": "other"}},),
        columns=("R_b",),
        **attempt,
    )


def test_alike_compares_with_the_case_that_differs_in_the_reference_alone():
    assert against(10.4, check="alike", limit=5.0) == Verdict(
        "reproduced", "4.0 % from the reference"
    )
    assert against(9.4, check="alike", limit=5.0).word == "not reproduced"
    lost = row("unstable", variant="other", alpha=3.0, R_b=None)
    base = row(variant="base", alpha=3.0, R_b=30.0)
    found = against(10.4, check="alike", limit=5.0, more=[lost, base])
    assert found.figure.endswith("1 comparisons lack a stable run")


def test_smaller_and_larger():
    assert against(6.0, check="smaller", limit=0.7).word == "reproduced"
    assert against(8.0, check="smaller", limit=0.7).word == "not reproduced"
    assert against(13.0, check="larger", limit=1.2).word == "reproduced"
    assert against(11.0, check="larger", limit=1.2).word == "not reproduced"
    lost = row("unstable", variant="other", alpha=3.0, R_b=None)
    base = row(variant="base", alpha=3.0, R_b=30.0)
    assert against(6.0, check="smaller", limit=0.7, more=[lost, base]).word == "in part"
    assert against(6.0, check="smaller", limit=0.7).figure == "60.0 % of the reference"


def test_all_unstable():
    rows = [row("unstable"), row("unstable")]
    assert verdict(rows, check="all_unstable").word == "reproduced"
    assert verdict([*rows, row()], check="all_unstable").word == "in part"
    assert verdict([row()], check="all_unstable").word == "not reproduced"


def test_errors():
    def word(*errors):
        rows = [row(error=error) for error in errors]
        return verdict(rows, check="errors", columns=("error",), limit=6.0)

    assert word(5.9, -5.9, 0.0) == Verdict(
        "reproduced", "3 of 3 within 6 %: +5.9, -5.9, +0.0"
    )
    assert word(5.9, -6.1, 0.0).word == "in part"
    assert word(None, -6.1, 0.0).word == "not reproduced"


def test_outside_and_inside_of_bands():
    def word(check, *sizes):
        rows = [
            row(variant=v, hole=s) for v, s in zip(("one", "two"), sizes, strict=True)
        ]
        bands = {"one": (10.0, 12.0), "two": (20.0, 22.0)}
        return verdict(rows, check=check, columns=("hole",), bands=bands)

    for sizes, outside, inside in (
        ((9.0, 23.0), "reproduced", "not reproduced"),
        ((11.0, 23.0), "in part", "in part"),
        ((11.0, 21.0), "not reproduced", "reproduced"),
        ((None, 21.0), "in part", "in part"),
    ):
        assert word("outside", *sizes).word == outside
        assert word("inside", *sizes).word == inside
    assert word("outside", 11.0, 21.0).figure == (
        "0 of 2 outside: one 11.0 (10 to 12), two 21.0 (20 to 22) mm"
    )


def test_ranges_are_compared_cell_by_cell():
    study = load_study(CASES / "studies" / "table5.toml")
    ranges = {
        (r.at["npr"], r.at["nph"]): (r.low, r.high if r.high else math.inf)
        for r in study.file.paper.ranges
        if r.low is not None
    }

    def table(judge):
        return [
            {
                "case": c.number,
                "variant": "",
                **c.settings,
                "run": c.key,
                "status": "completed",
                "total_error_percent": 5.0 if judge(**c.settings) else 15.0,
            }
            for c in study.cases
        ]

    def as_paper(npr, nph, alpha):
        low, high = ranges.get((npr, nph), (math.inf, 0.0))
        return low <= alpha <= high

    attempt = Try(name="try", study="table5", check="ranges", limit=0.9)
    assert decide(attempt, study, table(as_paper)).word == "reproduced"
    nowhere = decide(attempt, study, table(lambda **_: False))
    assert nowhere.word == "not reproduced"
    fine = decide(attempt, study, table(lambda npr, **_: npr > 5))
    assert fine.word == "in part"
    offset = attempt.model_copy(update={"clock": "offset"})
    assert decide(offset, study, table(as_paper)).figure.startswith("0 of 0")


def test_what_has_not_been_run_is_said():
    rows = [row(), row("to do"), row("stopped"), row("failed")]
    found = verdict(rows, check="all_unstable")
    assert found == Verdict("not run", "3 of 4 cases have not been run")
    with pytest.raises(MpisphError, match="study study has no case for try"):
        verdict(rows, check="all_unstable", where={"at": {"nph": 9.0}})


def test_where_chooses_the_cases():
    rows = [
        row("unstable", nph=1.0),
        row(nph=2.0),
        row(nph=3.0, variant="x"),
    ]
    for where, word in (
        ({"at_most": {"nph": 1.5}}, "reproduced"),
        ({"at_least": {"nph": 1.5}}, "not reproduced"),
        ({"but": {"variant": "x"}}, "in part"),
        ({"at": {"variant": "x"}}, "not reproduced"),
    ):
        assert verdict(rows, check="all_unstable", where=where).word == word


def test_the_shipped_claims_are_the_papers_eleven():
    file = load_claims(SHIPPED)
    assert [claim.number for claim in file.claims] == list(range(1, 12))
    for claim in file.claims:
        for attempt in claim.tries:
            study = load_study(SHIPPED.with_name(f"{attempt.study}.toml"))
            blank = [
                {"variant": c.variant, **c.settings, "status": "to do"}
                for c in study.cases
            ]
            # Each try means some cases, and each of its regions too.
            meant = [r for r in blank if attempt.where.holds(r)]
            assert meant
            assert all(any(c.holds(r) for r in meant) for c in attempt.regions)


def test_an_unknown_check_or_key_is_named(tmp_path):
    text = SHIPPED.read_text()
    path = tmp_path / "claims.toml"
    path.write_text(text.replace('check = "step"', 'check = "steps"'))
    with pytest.raises(CaseError, match="claim 5: no check steps; expected one of"):
        load_claims(path)
    path.write_text(text.replace("number = 3", "nummer = 3"))
    with pytest.raises(CaseError, match=r"claims\.toml:\d+: .*unknown key"):
        load_claims(path)


def test_a_claim_is_answered_from_runs(tmp_path):
    text = small_study("6 us", nph=(2.5,)) + ALPHA.replace("2.5, 5.0", "1.0, 9.0")
    (tmp_path / "small.toml").write_text(text)
    claims = tmp_path / "claims.toml"
    claims.write_text(
        'title = "claims"\nsource = "nobody"\n[[claims]]\nnumber = 1\n'
        'text = "L_b falls"\n[[claims.tries]]\nname = "here"\nstudy = "small"\n'
        'check = "falls"\nalong = "alpha"\ncolumns = ["L_b_6us_mm"]\nlimit = 1.0\n'
    )
    root = tmp_path / "runs"
    ((_, before),) = answer_claims(claims, root)
    assert before[0].word == "not run"
    study = load_study(tmp_path / "small.toml")
    run_study(study, MPI.COMM_SELF, root, Console(quiet=True))
    ((_, after),) = answer_claims(claims, root)
    assert after[0].word == "reproduced"
    assert "falls in 1 of 1 steps" in after[0].figure


def test_tables():
    attempt = Try(name="as printed", study="s", check="errors")
    second = attempt.model_copy(update={"name": "otherwise"})
    claim = Claim(number=3, text="it falls", tries=(attempt, second))
    verdicts = (Verdict("in part", "a little"), Verdict("reproduced", "a lot"))
    answers = [Answer(claim, verdicts)]
    assert as_markdown(answers).splitlines()[2:] == [
        "| 3. it falls | as printed: **in part** | a little |",
        "|  | otherwise: **reproduced** | a lot |",
    ]
    console = Console(width=120, record=True)
    with console.capture() as captured:
        console.print(as_table(answers))
    assert "otherwise: reproduced" in captured.get()
    assert set(CHECKS) >= {attempt.check}
