"""Ranges of settings below an error: hand-made tables beside a paper's ranges."""

import csv
import io

import pytest
from launch import CASES

from mpisph.study.model import PaperRange, load_study
from mpisph.study.paper.ranges import (
    RANGES_TEXT_FILE,
    TOTALS,
    agreement,
    in_range,
    range_text,
    ranges_markdown,
    write_ranges,
)

ALPHAS = [0.5, 1.0, 1.5, 2.0, 2.5]

TEXT = f"""
title = "small"
base = "{CASES / "piekutowski-4-1353.toml"}"

[[parameters]]
name = "npr"
label = "NPR"
key = "resolution.npr"
values = [4, 5]

[[parameters]]
name = "alpha"
key = "scheme.viscosity.alpha"
values = {ALPHAS}

[paper]
parameter = "alpha"
limit_percent = 10.0
ranges = [
    {{ at = {{ npr = 4 }} }},
    {{ at = {{ npr = 5 }}, low = 1.0, high = 2.0 }},
]
"""


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TEXT)
    return load_study(path)


def table(study, errors, column="total_error_percent"):
    """Rows with the errors given in the order of the cases; a word is a status."""
    rows = []
    for case, error in zip(study.cases, errors, strict=True):
        row = {"variant": "", **case.settings, "status": "completed"}
        if isinstance(error, str):
            row["status"] = error
        else:
            row[column] = error
        rows.append(row)
    return rows


def test_cells_are_judged_one_by_one(study):
    errors = [9.9, 10.0, 12.0, 3.0, 3.0, 20.0, 5.0, "unstable", "to do", 5.0]
    four, five = agreement(study, table(study, errors), "nominal").cells
    assert four.at == {"npr": 4}
    assert (four.ours, four.paper) == ("0.5, 2.0-", "none")
    counts = (four.both, four.ours_only, four.paper_only, four.neither)
    assert counts == (0, 3, 0, 2)
    assert (five.ours, five.paper) == ("1.0, 2.5-", "1.0-2.0")
    counts = (five.both, five.ours_only, five.paper_only, five.neither)
    # 1.0; 2.5; the unstable 1.5; 0.5. What is still to do is not compared.
    assert counts == (1, 1, 1, 1)
    assert (five.alike, five.compared) == (2, 4)


def test_the_total_is_over_all_cells(study):
    errors = [9.9, 10.0, 12.0, 3.0, 3.0, 20.0, 5.0, "unstable", "to do", 5.0]
    found = agreement(study, table(study, errors), "nominal")
    assert (found.alike, found.compared) == (2 + 2, 5 + 4)
    assert found.fraction == pytest.approx(4 / 9)


@pytest.mark.parametrize("clock", TOTALS)
def test_each_clock_has_its_own_column(study, clock):
    rows = table(study, [1.0] * 10, TOTALS[clock])
    for other in TOTALS:
        found = agreement(study, rows, other)
        assert found.compared == (10 if other == clock else 0)
    # In five of five cells with the range, three are in it.
    assert agreement(study, rows, clock).alike == 3


def test_ranges_as_text(study):
    everything = agreement(study, table(study, [1.0] * 10), "nominal").cells[0]
    assert everything.ours == "0.5-"
    nothing = agreement(study, table(study, [50.0] * 10), "nominal").cells[0]
    assert nothing.ours == "none"
    unknown = agreement(study, table(study, ["to do"] * 10), "nominal").cells[0]
    assert (unknown.ours, unknown.compared) == ("not known", 0)
    middle = [50.0, 1.0, 1.0, "failed", 1.0]
    assert agreement(study, table(study, middle * 2), "nominal").cells[0].ours == (
        "1.0-1.5, 2.5-"
    )
    assert range_text(PaperRange(at={}, low=3.5)) == "3.5-"
    assert range_text(PaperRange(at={}, high=3.5)) == "-3.5"


@pytest.mark.parametrize(
    ("low", "high", "inside"),
    [
        (0.3, 0.6, [0.5]),
        (1.0, 2.0, [1.0, 1.5, 2.0]),
        (2.5, None, [2.5]),
        (None, 0.5, [0.5]),
        (None, None, []),
    ],
)
def test_the_ends_belong_to_a_range(low, high, inside):
    given = PaperRange(at={}, low=low, high=high)
    assert [alpha for alpha in ALPHAS if in_range(alpha, given)] == inside


def test_the_papers_example_is_in_its_range():
    """Lee 3.5 picks 5.0 at NPR 10 and NPH 2.0, where table 5 prints 5.0 < alpha."""
    paper = load_study(CASES / "studies" / "table5.toml").file.paper
    (given,) = (r for r in paper.ranges if r.at == {"npr": 10, "nph": 2.0})
    assert given.low == 5.0
    assert in_range(5.0, given)


def test_files_hold_all_clocks(study, tmp_path):
    rows = table(study, [1.0] * 5 + [20.0] * 5)
    path = write_ranges(study, tmp_path, rows)
    lines = list(csv.DictReader(io.StringIO(path.read_text())))
    assert [(x["npr"], x["clock"]) for x in lines] == [
        (npr, clock) for clock in TOTALS for npr in ("4", "5")
    ]
    first = {k: first for k, first in lines[0].items() if k != "clock"}
    assert first == {
        "npr": "4",
        "paper": "none",
        "ours": "0.5-",
        "both": "0",
        "ours_only": "5",
        "paper_only": "0",
        "neither": "0",
    }
    text = (path.parent / RANGES_TEXT_FILE).read_text()
    assert text == ranges_markdown(study, [agreement(study, rows, c) for c in TOTALS])
    assert "| NPR | paper | nominal | offset | fitted |" in text
    assert "| 5 | 1.0-2.0 | none (2/5) | not known (0/0) | not known (0/0) |" in text
    assert "| all |  | 2/10 = 20 % |" in text


def test_a_study_without_ranges_writes_none(study, tmp_path):
    bare = study._replace(
        file=study.file.model_copy(update={"paper": type(study.file.paper)()})
    )
    assert write_ranges(bare, tmp_path, table(study, [1.0] * 10)) is None
    assert not (tmp_path / "studies").exists()
