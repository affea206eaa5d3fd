"""Claims: every check tells what is claimed from what is not."""

import math
import re
from functools import cache

import pytest
from launch import CASES, MPISPH, launch
from mpi4py import MPI
from rich.console import Console
from studies import ALPHA, small_study

from mpisph.core.errors import CaseError
from mpisph.study.model import load_study
from mpisph.study.paper.checks import CHECKS, decide
from mpisph.study.paper.claims import Answer, answer_claims, as_markdown, as_table
from mpisph.study.paper.claims_file import NEEDS, Claim, Try, load_claims
from mpisph.study.paper.verdict import Verdict
from mpisph.study.runner import run_study
from mpisph.study.table import collect

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
    assert word(1.0, everywhere).word == "undecided"
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
    assert found == Verdict(
        "in part", "4.0 % from the reference; 1 of 3 comparisons lacks a value"
    )


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
            row(variant=v, hole_mm=s)
            for v, s in zip(("one", "two"), sizes, strict=True)
        ]
        bands = {"one": (10.0, 12.0), "two": (20.0, 22.0)}
        return verdict(rows, check=check, columns=("hole_mm",), bands=bands)

    for sizes, outside, inside in (
        ((9.0, 23.0), "reproduced", "not reproduced"),
        ((11.0, 23.0), "in part", "in part"),
        ((11.0, 21.0), "not reproduced", "reproduced"),
        ((None, 21.0), "not reproduced", "in part"),
        ((None, 23.0), "in part", "not reproduced"),
        ((None, None), "undecided", "undecided"),
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
    assert decide(offset, study, table(as_paper)) == Verdict(
        "undecided", "no case has a total error that could be compared"
    )


def test_what_has_not_been_run_is_said():
    rows = [row(), row("to do"), row("stopped"), row("failed")]
    found = verdict(rows, check="all_unstable")
    assert found == Verdict("not run", "3 of 4 cases have not been run")


ATTEMPTS = {
    "unstable": {"regions": ({"at": {"nph": 1.0}},), "columns": ("L_b",), "limit": 1},
    "falls": {"along": "nph", "columns": ("L_b",), "limit": 0.9},
    "grows": {"along": "nph", "columns": ("L_b",), "limit": 0.9},
    "grows_by_less": {"along": "nph", "columns": ("L_b",)},
    "step": {
        "along": "nph",
        "regions": ({"at_least": {"nph": 2.0}},),
        "columns": ("L_b",),
        "limit": 2.0,
    },
    "alike": {"reference": {"nph": 1.0}, "columns": ("L_b",), "limit": 5.0},
    "all_unstable": {},
    "smaller": {"reference": {"nph": 1.0}, "columns": ("L_b",), "limit": 0.7},
    "larger": {"reference": {"nph": 1.0}, "columns": ("L_b",), "limit": 1.2},
    "errors": {"columns": ("L_b",), "limit": 6.0},
    "outside": {"columns": ("L_b",), "bands": {"shot": (1.0, 2.0)}},
    "inside": {"columns": ("L_b",), "bands": {"shot": (1.0, 2.0)}},
    "ranges": {"limit": 0.9},
}
"""What each check needs, for rows over nph."""

OF_INSTABILITY = {"unstable", "all_unstable"}


def two_rows(first, second, **values):
    """Two cases of one shot that end as is said; unstable ones keep their figures."""
    return [
        row(status, variant="shot", nph=nph, **values)
        for nph, status in ((1.0, first), (2.0, second))
    ]


@pytest.mark.parametrize("check", sorted(set(CHECKS) - OF_INSTABILITY))
def test_without_a_stable_run_nothing_is_decided(check):
    """A run that broke down may have come to an exposure: its figures say nothing."""
    rows = two_rows("unstable", "unstable", L_b=3.0, total_error_percent=3.0)
    study = load_study(CASES / "studies" / "table5.toml")
    attempt = Try(name="try", study="study", check=check, **ATTEMPTS[check])
    assert decide(attempt, study, rows) == Verdict(
        "undecided", "none of the 2 cases is stable"
    )


@pytest.mark.parametrize("check", sorted(set(CHECKS) - {"ranges", "all_unstable"}))
@pytest.mark.parametrize("value", [{}, {"L_b": None}], ids=["no column", "None"])
def test_runs_without_the_figure_decide_nothing(check, value):
    rows = two_rows("completed", "completed", **value)
    found = verdict(rows, check=check, **ATTEMPTS[check])
    assert found.word == "undecided"


@pytest.mark.parametrize("check", sorted(set(CHECKS) - {"ranges"}))
def test_no_case_decides_nothing(check):
    assert verdict([], check=check, **ATTEMPTS[check]).word == "undecided"


@pytest.mark.parametrize("check", ["falls", "grows", "grows_by_less", "step"])
def test_a_single_row_along_the_parameter_decides_nothing(check):
    found = verdict([row(nph=1.0, L_b=3.0)], check=check, **ATTEMPTS[check])
    assert found.word == "undecided"


def test_two_values_do_not_say_whether_the_growth_falls():
    rows = [row(nph=1.0, L_b=1.0), row(nph=2.0, L_b=2.0)]
    found = verdict(rows, check="grows_by_less", **ATTEMPTS["grows_by_less"])
    assert found.word == "undecided"


def test_lines_that_broke_down_keep_a_claim_from_being_reproduced_in_full():
    alone = {(1.0, 3.0), (2.0, 3.0)}
    for unstable, word in ((alone, "in part"), (set(), "reproduced")):
        rows = grid(lambda nph, alpha: 10.0 - nph, unstable)
        found = verdict(rows, check="falls", along="nph", columns=("L_b",), limit=0.9)
        assert found.word == word
        assert ("1 of 3 lines has too few stable cases" in found.figure) == bool(
            unstable
        )


def test_a_size_of_nothing_is_no_error():
    """A cloud that has not formed has a length of 0."""
    rows = [row(nph=float(k), L_b=float(k)) for k in range(3)]
    found = verdict(rows, check="grows", **ATTEMPTS["grows"])
    assert found.word == "reproduced"
    assert verdict(rows, check="step", **ATTEMPTS["step"]).word == "undecided"
    assert verdict(rows, check="larger", reference={"nph": 0.0}, columns=("L_b",),
                   limit=1.2).word == "undecided"  # fmt: skip


def test_what_a_run_had_come_to_before_it_broke_down_is_no_error_within_a_limit():
    rows = [row(error=1.0), row(error=2.0), row("unstable", error=1.0)]
    found = verdict(rows, check="errors", columns=("error",), limit=6.0)
    assert found == Verdict("in part", "2 of 3 within 6 %: +1.0, +2.0, none")


def test_the_unit_is_the_columns():
    rows = [row(nph=float(k), m_6us_g=m) for k, m in enumerate((1.0, 2.0, 2.5))]
    attempt = {"check": "grows_by_less", "along": "nph", "columns": ("m_6us_g",)}
    assert verdict(rows, **attempt).figure == "steps of +1.00, +0.50 g"


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


@cache
def shipped_study(name):
    return load_study(SHIPPED.with_name(f"{name}.toml"))


def test_the_shipped_claims_are_the_papers_eleven():
    file = load_claims(SHIPPED, shipped_study)
    assert [claim.number for claim in file.claims] == list(range(1, 12))


MISTAKES = [
    # What the file says, the mistake in its place, where it is found, and the message.
    ("alpha = 1.0 }", "alfa = 1.0 }", "regions.0.at_most.alfa = 1.0: claim 1, with "
     "self-term", "study fig3 has no parameter alfa; did you mean alpha?"),
    ('at = { variant = "self" } }', 'but = { varianz = "self" } }',
     'where.but.varianz = "self": claim 1, with self-term',
     "study fig3 has no parameter varianz; did you mean variant?"),
    ('variant = "self"', 'variant = "slef"',
     'where.at.variant = "slef": claim 1, with self-term',
     "no case of study fig3 has this value; did you mean self?"),
    ("alpha = 1.0 }", "variant = 1.0 }",
     "regions.0.at_most.variant = 1.0: claim 1, with self-term",
     "expected a parameter with numbers"),
    ("nph = 1.2 }", "nph = 0.2 }", "regions.1: claim 1, with self-term",
     "no case of study fig3 matches"),
    ("at = { nph = 1.5 }, at_most = { alpha = 2.5 }",
     "at = { nph = 1.5 }, at_least = { alpha = 99.0 }",
     "regions.2: claim 1, with self-term", "no case of study fig3 matches"),
    ('"L_b_6us_mm", "L_b_19us_mm"', '"L_b_6us_mn", "L_b_19us_mm"',
     'columns.0 = "L_b_6us_mn": claim 2, with self-term',
     "study fig3 has no column L_b_6us_mn; did you mean L_b_6us_mm?"),
    ('along = "nph"', 'along = "hnp"', 'along = "hnp": claim 2, with self-term',
     "study fig3 has no parameter hnp; did you mean nph?"),
    ('along = "nph"', 'along = "variant"',
     'along = "variant": claim 2, with self-term', "expected a parameter with numbers"),
    ("limit = 0.9", "",
     "limit: claim 2, with self-term", "required by the check falls"),
    ('columns = ["L_b_6us_mm", "L_b_19us_mm"]', "columns = []",
     "columns: claim 2, with self-term", "required by the check falls"),
    ('check = "step"', 'check = "stepp"', 'check = "stepp": claim 5, with self-term',
     "expected one of unstable, "),
    ('reference = { eos = "mie-grueneisen" }', 'reference = { eos = "mie" }',
     'reference.eos = "mie": claim 6, Tillotson\'s R_b within 5 %',
     "no case of study fig6 has this value"),
    ('at = { eos = "tillotson" } }]\ncol', 'at = { eos = "mie-grueneisen" } }]\ncol',
     "regions: claim 6, Tillotson's R_b within 5 %",
     "no case of study fig6 is to be compared with the reference"),
    ('where = { at = { variant = "self" } }\nreference',
     'where = { at = { smoothing = "classic" } }\nreference',
     "reference: claim 8, the hole at 19 us is 1.2 times that with (21)",
     "expected one reference case for each case that is compared"),
    ('study = "table5"', 'study = "fig3"',
     'check = "ranges": claim 9, with self-term, nominal',
     "study fig3 gives no ranges of a paper"),
    ("bands = { shot-1283", "bands = { shot-1238",
     "bands.shot-1238: claim 11, hole at nominal 6 us outside of the fits, NPR 10",
     "study convergence has no variant shot-1238; did you mean shot-1283?"),
    ("bands = { shot-1283 = [13.3, 19.0], ", "bands = { ",
     "bands: claim 11, hole at nominal 6 us outside of the fits, NPR 10",
     "required: a band for shot-1283"),
]  # fmt: skip


@pytest.mark.parametrize(("says", "instead", "place", "expected"), MISTAKES)
def test_a_mistake_of_a_try_is_named(tmp_path, says, instead, place, expected):
    text = SHIPPED.read_text()
    path = tmp_path / "claims.toml"
    path.write_text(text.replace(says, instead, 1))
    with pytest.raises(CaseError) as caught:
        load_claims(path, shipped_study)
    first = str(caught.value.problems[0])
    where = rf"{re.escape(str(path))}:\d+: claims\.\d+\.tries\.0\."
    assert re.match(f"{where}{re.escape(f'{place}: {expected}')}", first), first


def test_an_unknown_key_is_named(tmp_path):
    path = tmp_path / "claims.toml"
    path.write_text(SHIPPED.read_text().replace("number = 3", "nummer = 3"))
    with pytest.raises(CaseError, match=r"claims\.toml:\d+: .*unknown key"):
        load_claims(path, shipped_study)


def test_the_command_names_an_unknown_column_before_anything_is_run(tmp_path):
    for study in SHIPPED.parent.glob("*.toml"):
        text = study.read_text().replace("../", f"{CASES}/")
        (tmp_path / study.name).write_text(text)
    path = tmp_path / "claims.toml"
    path.write_text(path.read_text().replace("nph = 1.2", "nhp = 1.2", 1))
    line = path.read_text()[: path.read_text().index("nhp")].count("\n") + 1
    done = launch(1, MPISPH, "study", "claims", path, "-o", tmp_path / "runs")
    assert done.returncode == 2
    assert f"{path}:{line}: " in done.stderr
    assert "claim 1, with self-term" in done.stderr
    assert "did you mean nph?" in done.stderr
    assert "Traceback" not in done.stderr


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
    # A file of claims may name the columns that a run fills, and no others.
    found = collect(study, root)[0]
    filled = {name for name, value in found.items() if isinstance(value, int | float)}
    known = set(study.columns())
    assert filled - {"case", *study.cases[0].settings} <= known
    assert {n for n in known if "_6us_" in n and "offset" not in n} <= filled


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


def test_every_check_says_what_it_needs():
    assert CHECKS.keys() == NEEDS.keys()
