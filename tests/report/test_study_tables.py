"""Tables of studies, from hand-made rows, sets and panels."""

import math

import pytest
from launch import CASES

from mpisph.analysis.convergence import converge
from mpisph.report.paper_tables import best_table
from mpisph.report.study_tables import (
    cases_table,
    convergence_table,
    provenance_table,
    settings_text,
    setup_tables,
    trouble_tables,
)
from mpisph.study.model import load_study
from mpisph.study.paper.best import BestSet
from mpisph.study.plots.convergence import ConvergencePanel, ConvergenceSeries

TEXT = f"""
title = "small"
clock_from = "twice"

[[variants]]
name = "once"
label = "4-1352"
base = "{CASES / "piekutowski-4-1352.toml"}"

[[variants]]
name = "twice"
base = "{CASES / "piekutowski-4-1353.toml"}"
set = {{ "scheme.self_term" = false, "output.every" = "" }}

[[parameters]]
name = "alpha"
label = "α = β"
key = "scheme.viscosity.alpha"
values = [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 6.5, 7.0]

[[derived]]
key = "scheme.viscosity.beta"
parameter = "alpha"

[[parameters]]
name = "step"
unit = "ns"
key = "time.dt"
values = [1, 2]

[[derived]]
key = "time.cfl"
parameter = "step"
factor = 0.125
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "small.toml"
    path.write_text(TEXT)
    return load_study(path)


def row_of(study, number, **columns):
    case = study.cases[number]
    row = {"case": number, "variant": case.variant, **case.settings, "run": case.key}
    return row | {"status": "completed", "reason": None} | columns


def sets_of(study, errors):
    """Sets with the largest errors given, in the order of the values of alpha."""
    return [
        BestSet(
            settings={"alpha": 1.0 + 0.5 * k, "step": 1},
            offset_us=1.0 + 0.1 * k,
            fitted=k != 0,
            errors={
                "once_R_b_6us_error_percent": -error if error else None,
                "twice_L_b_19us_error_percent": 0.5,
            },
            max_percent=error,
            mean_percent=error and error / 2,
        )
        for k, error in enumerate(errors)
    ]


def best(study, errors):
    """The best table, of sets in the order of their errors, as `best_sets` has it."""
    sets = sets_of(study, errors)
    return best_table(study, sorted(sets, key=lambda s: s.max_percent or math.inf))


def test_the_ten_best_sets_and_the_papers(study):
    # alpha = 5 is the ninth value, and the worst of those that are known.
    errors = [3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 99.0, 11.0, 12.0, 13.0, None]
    table = best(study, errors)
    assert table.columns == (
        "rank", "α\xa0=\xa0β", "step [ns]", "offset [µs]", "largest error [%]",
        "mean error [%]", "4\u20111352 R_b 6\xa0µs", "twice L_b 19\xa0µs",
    )  # fmt: skip
    assert [row[0] for row in table.rows[:10]] == [str(k) for k in range(1, 11)]
    assert table.rows[0] == (
        "1", "1.0", "1", "1.00, not fitted", "3.0", "1.5", "−3.0", "+0.5"
    )  # fmt: skip
    assert table.rows[9][1] == "6.0"
    assert table.rows[10][:5] == ("12, the paper’s", "5.0", "1", "1.80", "99.0")
    assert len(table.rows) == 11
    assert "12 of 13 sets have all of their runs" in table.caption
    assert "fitted on twice alone" in table.caption


def test_the_papers_set_among_the_best_or_without_runs(study):
    errors = [20.0 + k for k in range(13)]
    table = best(study, [*errors[:8], 5.0, *errors[9:]])
    assert table.rows[0][:2] == ("1, the paper’s", "5.0")
    assert len(table.rows) == 10
    table = best(study, [3.0, *[None] * 12])
    assert [row[0] for row in table.rows] == ["1", "the paper’s"]
    assert table.rows[1][4:] == ("–", "–", "–", "+0.5")


def test_what_is_varied(study):
    parameters, variants, measured = setup_tables(study)
    assert parameters.rows == [
        ("α\xa0=\xa0β", "scheme.viscosity.alpha", "1.0 to 7.0 in steps of 0.5 (13)"),
        ("", "scheme.viscosity.beta", "the same"),
        ("step [ns]", "time.dt", "1, 2"),
        ("", "time.cfl", "0.125 times the same"),
    ]
    assert [row[2] for row in variants.rows] == [
        "–",
        "scheme.self_term = false; output.every removed",
    ]
    assert [row[:4] for row in measured.rows] == [
        ("4-1352", "6 µs", "17.7", "36.4"),
        ("twice", "6 µs", "15.3", "31.7"),
        ("twice", "19 µs", "37.5", "98.0"),
    ]


def test_settings_in_words(study):
    assert settings_text(study, row_of(study, 3)) == "4-1352, α = β = 1.5, step 2"


def test_columns_are_those_that_a_run_has(study):
    rows = [row_of(study, k, status="to do") for k in range(3)]
    heads = ("case", "variant", "α\xa0=\xa0β", "step [ns]", "state")
    table = cases_table(study, rows)
    assert table.columns == heads
    assert table.caption == ""
    rows[1] |= {
        "status": "completed",
        "L_b_6us_offset_mm": 36.44,
        "L_b_6us_offset_error_percent": -1.26,
        "fitted_offset_us": -0.123,
        "total_error_fitted_percent": 2.34,
        "energy_error": math.nan,
        "steps": 12345,
    }
    table = cases_table(study, rows)
    assert table.columns[5:] == (
        "total error fitted [%]", "fitted offset [µs]", "L_b 6 µs offset",
        "energy error", "steps",
    )  # fmt: skip
    assert table.rows[0] == ("0", "4-1352", "1.0", "1", "to do", *["–"] * 5)
    assert table.rows[1][5:] == ("2.3", "−0.12", "36.4 (−1.3)", "–", "12\u2009345")
    assert table.words == (1, 4)


def test_troubles_are_grouped_by_state_and_reason(study):
    states = ["unstable", "stopped", "unstable", "failed", "unstable", "completed"]
    reasons = ["heat", "killed", "drift", "no space", "drift", None]
    rows = [
        row_of(study, k, status=state, reason=reason)
        for k, (state, reason) in enumerate(zip(states, reasons, strict=True))
    ]
    rows[0] |= {"steps": 17, "time_us": 1.234}
    tables = trouble_tables(study, rows)
    assert [table.title for table in tables] == [
        "1 case failed (no space)",
        "2 cases unstable (drift)",
        "1 case unstable (heat)",
        "1 case stopped (killed)",
    ]
    assert [row[0] for row in tables[1].rows] == ["2", "4"]
    assert tables[2].rows[0][3:] == ("17", "1.23")


def test_extrapolated_values_and_where_there_are_none():
    npr = [10, 20, 40]

    def series(name, values, measured=None):
        return ConvergenceSeries(name, converge(npr, values), measured)

    panels = [
        ConvergencePanel(
            "$R_b$ there",
            "mm",
            [
                series("a", [24.0, 22.0, 21.0], 22.3),
                series("b", [24.0, 22.0, 23.0]),
                series("c", [24.0, None, 22.0]),
                series("d", [None, None, None]),
            ],
        ),
        ConvergencePanel("mass", "g", [series("a", [0.002] * 3, 1.0)], 1e3),
    ]
    table = convergence_table(panels, "there")
    assert table.columns[2:5] == ("NPR 10", "NPR 20", "NPR 40")
    assert table.rows[0] == (
        "R_b there [mm]", "a", "24.00", "22.00", "21.00", "monotone", "1.00", "20.00",
        f"{100 * 1.25 / 21:.1f}\xa0%", "22.30",
    )  # fmt: skip
    assert table.rows[1][5:8] == ("oscillatory", "1.00", "–")
    # With p = 1 over a ratio of 4: 22 - 2/3.
    assert table.rows[2][2:8] == (
        "24.00", "–", "22.00", "two levels", "assumed 1", "21.33"
    )  # fmt: skip
    assert [row[1] for row in table.rows] == ["a", "b", "c", "a"]
    assert table.rows[3][4:9] == ("2.000", "constant", "–", "2.000", "0.0\xa0%")
    assert table.rows[3][9] == "1000"


def test_programs_and_times(study):
    made = {"version": "1.2", "revision": "0123456789abcdef", "wall_s": 4000.0}
    rows = [row_of(study, k, **made) for k in range(3)]
    rows[1] |= {"revision": None, "wall_s": 3200.0}
    rows[2] |= {"run": rows[0]["run"]}  # the same run as another case's
    rows.append(row_of(study, 3, status="to do"))
    table = provenance_table(rows, {"study file": "there"})
    assert table.rows[0] == ("study file", "there")
    assert set(table.rows[1][1].split("; ")) == {
        "mpisph 1.2, revision 0123456789ab (1 run)",
        "mpisph 1.2 (1 run)",
    }
    assert table.rows[2] == ("time of all runs", "2.0 h")
    assert len(provenance_table(rows[3:], {}).rows) == 0
    for wall, words in ((119.0, "119 s"), (1500.0, "25 min")):
        table = provenance_table([rows[0] | {"wall_s": wall}], {})
        assert table.rows[1][1] == words
