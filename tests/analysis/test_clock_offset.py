"""The fit of the experiment's clock."""

import shutil
import tracemalloc
from io import StringIO
from pathlib import Path

import numpy as np
import pytest
from launch import CASES
from rich.console import Console

from mpisph.analysis.clock_offset import (
    PREDICTIONS,
    ClockFit,
    ClockRun,
    clock_errors,
    clock_run,
    clock_table,
    conclude,
    conclusion_text,
    fit_clock,
)
from mpisph.case import load_case
from mpisph.core.errors import MpisphError
from mpisph.io.status import Status

OFFSET = 0.83e-6


def history(case, end, error=0.0, offset=OFFSET):
    """A cloud that passes through all measured sizes at the offset times."""
    time = np.linspace(0.0, end, 4001)
    rows = np.zeros(
        time.size, [(n, "f8") for n in ("time", "cloud_radius", "cloud_length")]
    )
    first, last = case.measured.exposures
    rows["time"] = time
    for column, a, b in (
        ("cloud_radius", first.radius, last.radius),
        ("cloud_length", first.length, last.length),
    ):
        speed = (b - a) / (last.time - first.time)
        rows[column] = a + speed * (time - offset - first.time)
    rows["cloud_radius"] *= 1.0 + error
    return rows


@pytest.fixture(scope="module")
def case():
    return load_case(CASES / "piekutowski-4-1353.toml")


def test_the_offset_that_was_put_in_is_found(case):
    fit = fit_clock(history(case, 22e-6), case)
    assert fit.offset == pytest.approx(OFFSET, abs=2e-9)
    assert fit.errors == pytest.approx(np.zeros(4), abs=1e-3)
    assert fit.separate == pytest.approx([OFFSET] * 4, abs=2e-9)
    assert fit.names[:2] == ("R_b at 6 us", "L_b at 6 us")


def test_an_offset_may_be_negative(case):
    fit = fit_clock(history(case, 22e-6, offset=-0.4e-6), case)
    assert fit.offset == pytest.approx(-0.4e-6, abs=1e-9)


def test_a_figure_that_disagrees_shows_in_its_own_offset(case):
    fit = fit_clock(history(case, 23e-6, error=0.05), case)
    assert fit.separate[[1, 3]] == pytest.approx([OFFSET] * 2, abs=2e-9)
    assert (fit.separate[[0, 2]] < OFFSET - 0.3e-6).all()
    assert OFFSET - 0.3e-6 < fit.offset < OFFSET


def test_what_cannot_be_fitted_is_refused(case):
    with pytest.raises(ValueError, match="let it run past"):
        fit_clock(history(case, 19.5e-6), case)
    with pytest.raises(ValueError, match="ends before"):
        fit_clock(history(case, 12e-6), case)
    bare = case.model_copy(update={"measured": None})
    with pytest.raises(ValueError, match="no measured exposure"):
        fit_clock(history(case, 22e-6), bare)
    with pytest.raises(ValueError, match="ends before"):
        fit_clock(history(case, 22e-6)[:0], case)


def wavering(case, end):
    """A cloud whose outermost particle changes: with corners, jumps and wiggles."""
    rows = history(case, end)
    rng = np.random.default_rng(5)
    for column, scale in (("cloud_radius", 0.05), ("cloud_length", 0.02)):
        steps = np.repeat(rng.normal(size=81), 50)[: rows.size]
        rows[column] *= 1.0 + scale * np.sin(9e6 * rows["time"]) + 0.01 * steps
    return rows


def by_enumeration(rows, case):
    """Offsets on a grid of 1 ns over the whole run: sum of squares, and each alone."""
    offsets = np.arange(-6e-6, rows["time"][-1] - 19e-6, 1e-9)
    squares = np.array(
        [
            (np.interp(e.time + offsets, rows["time"], rows[column]) / size - 1.0) ** 2
            for e in case.measured.exposures
            for column, size in (("cloud_radius", e.radius), ("cloud_length", e.length))
        ]
    )
    return offsets[squares.sum(axis=0).argmin()], squares


@pytest.mark.parametrize("end", [21e-6, 22e-6, 30e-6])
@pytest.mark.parametrize("make", [history, wavering])
def test_the_search_finds_what_an_enumeration_finds(case, make, end):
    rows = make(case, end)
    best, squares = by_enumeration(rows, case)
    fit = fit_clock(rows, case)
    assert fit.offset == pytest.approx(best, abs=1e-9)
    # A figure may pass through its measured size more than once.
    assert ((fit.errors**2).sum() <= squares.sum(axis=0).min() + 1e-12).all()
    for k, alone in enumerate(fit.separate):
        left = clock_errors(rows, case, np.array([alone]))[k, 0]
        assert left**2 <= squares[k].min() + 1e-12


def test_memory_does_not_grow_with_the_run(case):
    """On a grid of 1 ns this run would take 640 MB."""
    rows = history(case, 20e-3)
    tracemalloc.start()
    fit = fit_clock(rows, case)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 3e6
    assert fit.offset == pytest.approx(OFFSET, abs=1e-9)


def test_errors_are_those_of_the_cloud_at_the_shifted_times(case):
    rows = history(case, 22e-6)
    errors = clock_errors(rows, case, np.array([0.0, OFFSET]))
    first = case.measured.exposures[0]
    nominal = np.interp(first.time, rows["time"], rows["cloud_length"])
    assert errors[1, 0] == pytest.approx(nominal / first.length - 1.0)
    assert errors[:, 1] == pytest.approx(np.zeros(4), abs=1e-6)


def test_a_figure_that_the_run_does_not_reach_is_marked(case):
    fit = fit_clock(history(case, 21e-6, error=-0.08), case)
    assert fit.beyond.tolist() == [False, False, True, False]
    assert fit.separate[2] == pytest.approx(2e-6, abs=2e-9)


NAMES = ("R_b at 6 us", "L_b at 6 us", "R_b at 19 us", "L_b at 19 us")


def run_at(case, npr, offset, separate=(1.0, 2.0, 3.0, 4.0), **changes):
    """A run at NPR with an offset and separate offsets [us]."""
    resolution = case.resolution.model_copy(update={"npr": npr})
    case = case.model_copy(update={"resolution": resolution, **changes})
    alone = np.array(separate) * 1e-6
    errors = np.array([0.03, -0.04, 0.0, 0.0])
    fit = ClockFit(offset * 1e-6, errors, alone, alone > 3.5e-6, NAMES)
    return ClockRun(Path(f"runs/{npr}"), case, npr, npr**2, np.zeros(0), fit)


def test_the_rms_is_over_all_figures(case):
    assert run_at(case, 10, 1.0).fit.rms == pytest.approx(0.025)


def test_one_run_knows_how_its_figures_disagree(case):
    found = conclude([run_at(case, 10, 1.2)])
    assert found.offset == pytest.approx(1.2e-6)
    assert np.isnan(found.numerical)
    # Of 1, 2, 3, 4: the root of 5/3.
    assert found.figures == pytest.approx((5 / 3) ** 0.5 * 1e-6)
    text = conclusion_text(found)
    assert "clock offset 1.20 µs, of NPR 10\n" in text
    assert "unknown from one run" in text
    assert "±1.29 µs: at least the standard deviation of 4 separate" in text
    assert text.endswith(PREDICTIONS)


def test_two_runs_give_half_of_their_spread(case):
    runs = [run_at(case, 20, 1.0), run_at(case, 10, 1.4)]
    found = conclude(runs)
    assert found.run is runs[0]
    assert found.numerical == pytest.approx(0.2e-6)
    assert found.spread == pytest.approx(0.4e-6)
    assert "±0.20 µs: half of the spread of two runs, 0.40 µs" in conclusion_text(found)


def test_three_runs_give_a_grid_convergence_index(case):
    # 0.8 + 4/NPR us: of first order, with an error of 0.1 us left at NPR 40.
    runs = [run_at(case, npr, 0.8 + 4.0 / npr) for npr in (20, 40, 10)]
    found = conclude(runs)
    assert found.run is found.finest is runs[1]
    assert found.numerical == pytest.approx(1.25 * 0.1e-6)
    assert found.convergence.extrapolated == pytest.approx(0.8e-6)
    text = conclusion_text(found)
    assert "0.90 µs, of NPR 40 (the finest)" in text
    assert "observed order 1.00, safety factor 1.25); extrapolated 0.80 µs" in text
    assert "spread of 3 runs 0.30 µs" in text


def test_a_coarser_run_is_as_much_more_uncertain_as_it_is_off(case):
    runs = [
        run_at(case, npr, 0.8 + 4.0 / npr, separate=(1, 1, 2, 2 + npr / 20))
        for npr in (10, 20, 40)
    ]
    found = conclude(runs, npr=20.0)
    assert found.offset == pytest.approx(1.0e-6)
    assert found.numerical == pytest.approx(0.1e-6 + 1.25 * 0.1e-6)
    assert found.figures == pytest.approx(np.std([1, 1, 2, 3], ddof=1) * 1e-6)
    text = conclusion_text(found)
    assert "of NPR 20 (as asked)" in text
    assert "±0.22 µs: 0.10 µs off NPR 40, and its 0.12 µs: grid" in text
    assert "µs: the standard deviation" in text
    with pytest.raises(MpisphError, match="no run at NPR 15; they are at 10, 20, 40"):
        conclude(runs, npr=15)


def test_offsets_that_diverge_have_no_limit(case):
    offsets = {10: 1.0, 20: 1.1, 40: 1.4}
    found = conclude([run_at(case, n, x) for n, x in offsets.items()])
    assert found.numerical == pytest.approx(3 * 0.4e-6)
    text = conclusion_text(found)
    assert "no bound" in text
    assert "extrapolated" not in text


def test_runs_of_another_shot_are_refused(case):
    other = load_case(CASES / "piekutowski-4-1352.toml")
    with pytest.raises(
        MpisphError, match="runs/20: a run of another shot than runs/10"
    ):
        conclude([run_at(case, 10, 1.0), run_at(other, 20, 1.0)])


def test_runs_may_differ_in_resolution_alone(case):
    scheme = case.scheme.model_copy(update={"eos": "tillotson"})
    resolution = case.resolution.model_copy(update={"nph": 1.5, "npr": 20})
    runs = [run_at(case, 10, 1.0), run_at(case, 20, 1.0, scheme=scheme)]
    runs[1] = runs[1]._replace(
        case=runs[1].case.model_copy(update={"resolution": resolution})
    )
    text = r"runs/20: differs from runs/10 in scheme, resolution\.nph;"
    with pytest.raises(MpisphError, match=text):
        conclude(runs)
    with pytest.raises(MpisphError, match="has NPR 10, as runs/10 has"):
        conclude([run_at(case, 10, 1.0)] * 2)


def test_what_moves_no_cloud_may_differ(case):
    measured = case.measured.model_copy(update={"clock_offset": 0.5e-6})
    output = case.output.model_copy(update={"figures": False})
    more = {"measured": measured, "output": output, "title": "finer"}
    assert conclude([run_at(case, 10, 1.0), run_at(case, 20, 1.0, **more)]).spread == 0


def test_the_table_has_a_row_for_each_run_in_order(case):
    console = Console(width=100, file=StringIO())
    console.print(clock_table([run_at(case, n, n / 10) for n in (20, 10)]))
    text = console.file.getvalue()
    assert text.index("1.00 µs") < text.index("2.00 µs")
    for words in ("at 19 µs", "+3.0 %", "-4.0 %", ">4.00 µs", " 400 "):
        assert words in text


@pytest.mark.parametrize(
    ("files", "text"),
    [
        ({}, "not begun"),
        (
            {"state": "stopped", "reason": "walltime"},
            r"not a completed run \(stopped, t = 3.00 us\)",
        ),
        ({"state": "unstable"}, "unstable"),
        ({"state": "completed"}, "history"),
    ],
)
def test_a_run_that_is_not_complete_is_refused(tmp_path, case, files, text):
    if files:
        write_status(tmp_path, **files)
        (tmp_path / "history.csv").write_text("no history\n")
    with pytest.raises(MpisphError, match=text) as found:
        clock_run(tmp_path, case)
    assert str(tmp_path) in str(found.value)


def test_a_history_that_was_cut_short_is_named(finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "cut")
    lines = (folder / "history.csv").read_text().splitlines(keepends=True)
    (folder / "history.csv").write_text("".join(lines[: len(lines) // 2]))
    with pytest.raises(MpisphError, match=r"history.csv is damaged: it ends at step"):
        clock_run(folder, load_case(folder / "case.toml"))


def write_status(folder, **changes):
    status = Status(
        **{"state": "completed", "step": 3, "time": 3e-6, "end_time": 22e-6, **changes},
        starts=1,
        ranks=1,
        host="here",
        pid=1,
        started="",
        updated="",
    )
    (folder / "status.json").write_text(status.model_dump_json())
