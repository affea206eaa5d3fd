"""Figures of studies, from made-up tables: what is drawn is what the rows say."""

import math

import numpy as np
import pytest
from click.testing import CliRunner
from launch import CASES

from mpisph.cli.study import study_group
from mpisph.core.errors import CaseError
from mpisph.run.signals import SignalHandler
from mpisph.study.model import load_study
from mpisph.study.plots import draw
from mpisph.study.plots.convergence import convergence_panels
from mpisph.study.plots.draw import draw_study
from mpisph.study.plots.lines import lines_figure
from mpisph.study.plots.map import map_figure
from mpisph.study.plots.shots import shots_figure

STUDIES = CASES / "studies"
BASE = CASES / "piekutowski-4-1353.toml"

SMALL = f"""
title = "small"
base = "{BASE}"

[[parameters]]
name = "nph"
label = "NPH"
key = "resolution.nph"
values = [1.5, 2.0]

[[parameters]]
name = "alpha"
key = "scheme.viscosity.alpha"
values = [5.0, 1.0, 2.5]
"""


def small(tmp_path, figure, text=SMALL):
    path = tmp_path / "small.toml"
    path.write_text(text + figure)
    return load_study(path)


def table(study, value, status=lambda row: "completed"):
    """Rows with sizes and errors by a function of the row and the column's name."""
    rows = []
    for case in study.cases:
        row = {"case": case.number, "variant": case.variant, **case.settings}
        row["status"] = status(row)
        if row["status"] == "completed":
            row |= {
                f"{q}_{t}us{clock}_{ending}": value(row, q, t, clock, ending)
                for q in ("R_b", "L_b")
                for t in (6, 19)
                for clock in ("", "_offset")
                for ending in ("mm", "error_percent", "robust_mm")
            }
            for clock in ("", "_offset", "_fitted"):
                row[f"total_error{clock}_percent"] = value(row, "total", 0, clock, "")
        rows.append(row)
    return rows


def made_up(row, q, t, clock, ending):
    """A number that tells where it comes from."""
    number = 10.0 * t + (q == "L_b") + 0.1 * bool(clock) + row.get("alpha", 0.0) / 100
    return number + row.get("nph", 0.0) / 1000


# Lines

LINES = """
[figure]
kind = "lines"
x = "alpha"
lines = "nph"
quantities = ["L_b"]
"""


def test_lines_are_the_sizes_of_both_clocks(tmp_path):
    study = small(tmp_path, LINES)
    data = lines_figure(study, study.file.figure, table(study, made_up))
    assert data.x.numbers() == [5.0, 1.0, 2.5]
    assert (data.lines.names, data.lines.label) == (("1.5", "2.0"), "NPH")
    assert data.lines.numeric
    (band,) = data.bands
    titles = [panel.title for panel in band.panels]
    assert titles == ["nominal exposure time", "+0.89 µs clock offset"]
    for panel, clock in zip(band.panels, (0.0, 0.1), strict=True):
        wanted = [
            [
                [10 * t + 1 + clock + a / 100 + h / 1000 for a in data.x.values]
                for h in (1.5, 2.0)
            ]
            for t in (19, 6)
        ]
        np.testing.assert_allclose(panel.values, wanted, rtol=1e-12)
    assert [row.label for row in data.rows] == [
        "$L_b$ at 19 µs [mm]",
        "$L_b$ at 6 µs [mm]",
    ]
    assert [row.thick for row in data.rows] == [True, False]
    assert [row.measured for row in data.rows] == pytest.approx([98.0, 31.7])
    assert data.note.startswith(
        "Thin lines, open markers: 6 µs; thick, filled: 19 µs. "
    )


def test_unstable_and_missing_runs_have_no_point(tmp_path):
    study = small(tmp_path, LINES)

    def status(row):
        chosen = {(1.5, 1.0): "unstable", (2.0, 5.0): "failed"}
        return chosen.get((row["nph"], row["alpha"]), "completed")

    data = lines_figure(study, study.file.figure, table(study, made_up, status))
    panel = data.bands[0].panels[0]
    assert panel.unstable.tolist() == [[False, True, False], [False] * 3]
    assert np.isnan(panel.values[0]).tolist() == [
        [False, True, False],
        [True, False, False],
    ]
    assert data.note.endswith("6 runs, 1 unstable, 1 missing.")


def test_an_unstable_run_has_no_point_where_it_had_come_to_an_exposure(tmp_path):
    study = small(tmp_path, LINES)
    rows = table(study, made_up)
    rows[0]["status"] = "unstable"
    panel = lines_figure(study, study.file.figure, rows).bands[0].panels[0]
    assert np.isnan(panel.values[:, 0, 0]).all()


def test_clocks_and_exposures_can_be_chosen(tmp_path):
    study = small(tmp_path, LINES + 'clocks = ["offset"]\nexposures = [6.0]\n')
    data = lines_figure(study, study.file.figure, table(study, made_up))
    (band,) = data.bands
    assert [panel.title for panel in band.panels] == ["+0.89 µs clock offset"]
    assert [row.measured for row in data.rows] == pytest.approx([31.7])
    assert data.note == "Outermost particles. 6 runs."


@pytest.mark.parametrize("name", ["pair-forms", "fig3", "fig5"])
def test_many_panels_stand_below_each_other_for_each_clock(name):
    study = load_study(STUDIES / f"{name}.toml")
    data = lines_figure(study, study.file.figure, table(study, made_up))
    headings = [band.heading for band in data.bands]
    assert headings == ["nominal exposure time", "+0.89 µs clock offset"]
    titles = [panel.title for panel in data.bands[1].panels]
    if name == "fig3":
        forms = ["with self-term", "without self-term", "without, (21) as printed"]
        assert titles == forms
        assert [row.measured for row in data.rows] == pytest.approx([98.0, 31.7])
    elif name == "pair-forms":
        assert titles == ["4-1283", "4-1291", "4-1352", "4-1353"]
    else:
        assert titles == [f"NPH {h}" for h in (1.0, 1.2, 1.5, 1.8, 2.0, 2.5)]
        assert data.log_x
        assert data.x.values == (5.0, 2.0, 1.0, 0.5, 0.2)


def test_names_are_categories(tmp_path):
    text = SMALL.replace('key = "resolution.nph"', 'key = "scheme.smoothing"').replace(
        "[1.5, 2.0]", '["fixed", "classic"]'
    )
    figure = LINES.replace('x = "alpha"', 'x = "nph"').replace(
        '= "nph"\nq', '= "alpha"\nq'
    )
    study = small(tmp_path, figure, text)
    rows = table(study, lambda *_: 1.0)
    data = lines_figure(study, study.file.figure, rows)
    assert data.x.names == ("fixed", "classic")
    assert data.lines.names == ("5.0", "1.0", "2.5")


# Maps

MAP = """
[figure]
kind = "map"
x = "nph"
lines = "alpha"

[paper]
parameter = "alpha"
limit_percent = 8.0
ranges = [
    { at = { nph = 1.5 }, low = 1.0 },
    { at = { nph = 2.0 } },
]
"""


def total(row, q, t, clock, ending):
    return row["alpha"] + 10 * (row["nph"] == 2.0) + 100 * (clock == "_offset")


def test_a_map_is_in_ascending_order_beside_the_papers_ranges(tmp_path):
    study = small(tmp_path, MAP)
    data = map_figure(study, study.file.figure, table(study, total))
    assert data.x.names == ("1.5", "2.0")
    assert data.y.names == ("1.0", "2.5", "5.0")
    assert (data.y.numbers(), data.limit) == ([1.0, 2.5, 5.0], 8.0)
    nominal, offset = data.bands
    wanted = np.array([[1.0, 11.0], [2.5, 12.5], [5.0, 15.0]])
    np.testing.assert_array_equal(nominal.panels[0].values, wanted)
    np.testing.assert_array_equal(offset.panels[0].values, wanted + 100.0)
    assert nominal.panels[0].ranges == [(1.0, math.inf), ()]
    # All six as in the paper; with the offset the three of the second column.
    assert nominal.heading == "nominal exposure time: 100 % of 6 cells as in the paper"
    assert offset.heading == "+0.89 µs clock offset: 50 % of 6 cells as in the paper"


def test_a_map_without_ranges_has_none(tmp_path):
    study = small(tmp_path, MAP.partition("[paper]")[0])
    data = map_figure(study, study.file.figure, table(study, total))
    assert data.limit == 10.0
    assert data.bands[0].panels[0].ranges == [None, None]
    assert data.bands[0].heading == "nominal exposure time"


def test_unstable_runs_have_no_error_in_a_map(tmp_path):
    study = small(tmp_path, MAP)
    rows = table(study, total)
    rows[0]["status"] = "unstable"
    panel = map_figure(study, study.file.figure, rows).bands[0].panels[0]
    assert panel.unstable.tolist() == [[False] * 2, [False] * 2, [True, False]]
    assert np.isnan(panel.values[2, 0])


def test_table_5_has_a_panel_for_each_npr_with_all_ranges():
    study = load_study(STUDIES / "table5.toml")
    rows = table(study, lambda *_: 5.0)
    band, _ = map_figure(study, study.file.figure, rows).bands
    assert [panel.title for panel in band.panels] == [f"NPR {n}" for n in range(4, 11)]
    assert all(panel.values.shape == (19, 6) for panel in band.panels)
    assert band.panels[0].ranges == [(), (), (0.5, 1.0), (0.3, 0.6), (), ()]
    assert band.panels[2].ranges[2:4] == [(3.0, 9.5), (2.0, 7.0)]
    assert band.panels[6].ranges[4] == (5.0, math.inf)


# Shots


def test_shots_stand_beside_the_papers_own_errors():
    study = load_study(STUDIES / "table7.toml")
    rows = table(
        study,
        lambda row, q, t, clock, ending: (
            row["case"] + 20 * (q == "L_b") + 100 * bool(clock) + 1000 * (t == 19)
        ),
    )
    data = shots_figure(study, study.file.figure, rows)
    assert data.shots == [
        "4-1283, 6 µs",
        "4-1291, 6 µs",
        "4-1352, 6 µs",
        "4-1353, 6 µs",
        "4-1353, 19 µs",
    ]
    measured = [[22.3, 20.8, 17.7, 15.3, 37.5], [47.7, 43.6, 36.4, 31.7, 98.0]]
    np.testing.assert_allclose(data.measured, measured, rtol=1e-12)
    with_term, without, paper = data.series
    assert (with_term.name, without.name) == ("with self-term", "without self-term")
    np.testing.assert_array_equal(with_term.nominal[0], [0, 2, 4, 6, 1006])
    np.testing.assert_array_equal(without.offset[1], [121, 123, 125, 127, 1127])
    assert paper.paper
    # Facts of Lee's table 7: -4.9 -4.8 0.0 % and +5.2 +0.7 +5.8 %.
    errors = [[-4.9, -4.8, 0.0, np.nan, np.nan], [5.2, 0.7, 5.8, np.nan, np.nan]]
    np.testing.assert_allclose(paper.nominal, errors, atol=0.05)
    assert np.isnan(paper.offset).all()


# Convergence


def test_quantities_over_resolution_are_at_the_offset_time():
    study = load_study(STUDIES / "convergence.toml")

    def value(row, q, t, clock, ending):
        return (
            row["npr"]
            + 100 * (q == "L_b")
            + 1000 * bool(clock)
            + ending.startswith("r")
        )

    rows = table(study, value, lambda row: "to do" if row["npr"] == 80 else "completed")
    for row in rows[:3]:
        row["front_velocity_6us_offset_km_per_s"] = 6.0 + row["npr"]
        row["hole_opening_6us_offset_mm"] = 20.0 + row["npr"]
    panels = convergence_panels(study, study.file.figure, rows)
    assert [(panel.quantity, panel.unit) for panel in panels] == [
        ("$R_b$ at 6.89 µs, outermost", "mm"),
        ("$R_b$ at 6.89 µs, robust", "mm"),
        ("$L_b$ at 6.89 µs, outermost", "mm"),
        ("$L_b$ at 6.89 µs, robust", "mm"),
        ("front velocity", "km/s"),
        ("hole through the lips", "mm"),
    ]
    first = [panel.series[0] for panel in panels]
    assert [s.name for s in panels[0].series] == [
        "4-1283",
        "4-1291",
        "4-1352",
        "4-1353",
    ]
    assert [s.convergence.npr.tolist() for s in first] == [[10.0, 20.0, 40.0]] * 6
    values = [s.convergence.values.tolist() for s in first]
    levels = np.array([10.0, 20.0, 40.0])
    wanted = [1000, 1001, 1100, 1101, 6, 20]
    np.testing.assert_allclose(values, [levels + x for x in wanted], rtol=1e-12)
    assert [s.measured for s in first] == pytest.approx(
        [22.3, 22.3, 47.7, 47.7, None, None]
    )


# All kinds, into a file


SHIPPED = sorted(p for p in STUDIES.glob("*.toml") if p.stem != "claims")


@pytest.mark.parametrize("path", SHIPPED, ids=lambda p: p.stem)
def test_every_shipped_study_with_a_figure_is_drawn(path, tmp_path, monkeypatch):
    study = load_study(path)
    rows = table(
        study, made_up, lambda r: "unstable" if r["case"] == 1 else "completed"
    )
    made = []
    for kind in ("lines", "map", "shots", "convergence"):
        monkeypatch.setattr(draw, f"draw_{kind}", lambda *given: made.append(given))
    out = draw_study(study, rows, tmp_path)
    if study.file.figure is None:
        assert (out, made) == (None, [])
    else:
        assert out == tmp_path / "studies" / study.name / "figure.png"
        assert len(made) == 1


@pytest.mark.parametrize("figure", [LINES, MAP], ids=["lines", "map"])
def test_a_figure_is_written_into_the_studys_folder(figure, tmp_path):
    study = small(tmp_path, figure)
    rows = table(study, total, lambda r: "failed" if r["case"] else "completed")
    out = draw_study(study, rows, tmp_path)
    assert out.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("status", ["to do", "failed", "unstable"])
def test_nothing_is_drawn_before_a_run_is_complete(status, tmp_path):
    study = small(tmp_path, LINES)
    assert draw_study(study, table(study, made_up, lambda _: status), tmp_path) is None
    assert not (tmp_path / "studies").exists()


def test_a_study_without_figure_draws_nothing(tmp_path):
    study = small(tmp_path, "")
    assert draw_study(study, table(study, made_up), tmp_path) is None


def test_draw_says_why_it_draws_nothing(tmp_path):
    for figure, why in ((LINES, "no run is complete in"), ("", "expected [figure]")):
        study = small(tmp_path, figure)
        arguments = ["draw", str(study.path), "-o", str(tmp_path / "runs")]
        result = CliRunner().invoke(study_group, arguments, obj=SignalHandler())
        assert f"nothing to draw: {why}" in str(result.exception)


def test_draw_writes_the_figure_and_collect_all_tables(tmp_path, monkeypatch):
    study = small(tmp_path, MAP)
    rows = table(study, total)
    monkeypatch.setattr("mpisph.study.table.collect", lambda *_: rows)
    root = tmp_path / "runs"
    folder = root / "studies" / "small"
    arguments = [str(study.path), "-o", str(root)]
    result = CliRunner().invoke(study_group, ["draw", *arguments], obj=SignalHandler())
    assert result.output.split() == [str(folder / "figure.png")]
    assert {path.name for path in folder.iterdir()} == {"figure.png"}
    result = CliRunner().invoke(
        study_group, ["collect", *arguments], obj=SignalHandler()
    )
    assert result.output.split() == [str(folder / "table.csv")]
    names = {"figure.png", "table.csv", "times.csv", "ranges.csv", "ranges.md"}
    assert {path.name for path in folder.iterdir()} == names


# What a study file may say

WRONG = [
    (LINES.replace('x = "alpha"\n', ""), "a figure of kind lines needs x"),
    (LINES.replace('lines = "nph"', ""), "no axis stands for nph, which is varied"),
    (LINES.replace('lines = "nph"', 'lines = "npr"'), "figure.lines: no parameter npr"),
    (LINES + 'panels = "alpha"\n', "two axes stand for the same"),
    (LINES + "exposures = [7.0]\n", "no case has a measured exposure that is to be"),
    (MAP.replace('parameter = "alpha"', ""), "ranges need parameter and limit_percent"),
    (MAP.replace("nph = 2.0", "npr = 2.0"), "paper: no parameter npr with numbers"),
    (MAP.replace("nph = 2.0", "alpha = 2.0"), "paper: all ranges need the same"),
]


@pytest.mark.parametrize(("figure", "message"), WRONG, ids=lambda x: x[:20].strip())
def test_mistakes_of_the_figure_are_reported(figure, message, tmp_path):
    with pytest.raises(CaseError, match=message):
        small(tmp_path, figure)


def test_clock_from_must_be_a_variant(tmp_path):
    text = SMALL.replace("title", 'clock_from = "shot"\ntitle')
    with pytest.raises(CaseError, match="clock_from: no variant shot"):
        small(tmp_path, "", text)


def test_runs_that_reach_no_exposure_make_no_convergence_figure(tmp_path):
    study = load_study(STUDIES / "convergence.toml")
    rows = table(study, lambda *_: None, lambda _: "completed")
    assert draw.draw_study(study, rows, tmp_path) is None
