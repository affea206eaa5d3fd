"""The table of a study: its figures are those of the runs."""

import csv
import math
import sys

import numpy as np
import pyarrow.parquet
import pytest
from mpi4py import MPI
from rich.console import Console
from studies import UNSTABLE, small_study

from mpisph.analysis.clock_offset import fit_clock
from mpisph.analysis.hole import measure_hole
from mpisph.core.errors import MpisphError
from mpisph.io.history import read_history
from mpisph.io.result import read_result
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.run.session import run
from mpisph.study.model import load_study
from mpisph.study.runner import run_study
from mpisph.study.store import case_folder
from mpisph.study.table import collect, columns, total_error, write_table

TEXT = small_study(
    "7.5 us",
    '"measured.exposures.1.time" = "7 us"',
    '"measured.clock_offset" = "0.25 us"',
    variants=(("sound", ""), ("unstable", UNSTABLE)),
)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A study of two sound and two unstable cases, one of each run, and its root."""
    root = tmp_path_factory.mktemp("study")
    (root / "small.toml").write_text(TEXT)
    study = load_study(root / "small.toml")
    quiet = Console(quiet=True)
    for case in (study.cases[0], study.cases[2]):
        run(case.case, MPI.COMM_SELF, case_folder(root, case), quiet)
    return study, root


def test_a_row_says_what_the_run_says(made):
    study, root = made
    row = collect(study, root)[0]
    folder = case_folder(root, study.cases[0])
    result = read_result(folder / "result.json")
    assert (row["case"], row["variant"], row["nph"]) == (0, "sound", 2.0)
    assert (row["run"], row["status"]) == (folder.name, "completed")
    assert (row["particles"], row["steps"]) == (result.particles, result.step)
    assert row["time_us"] == pytest.approx(7.5)
    clouds = {round(c.time * 1e6, 3): c for c in result.clouds}
    for column, time, field, factor in (
        ("R_b_6us_mm", 6.0, "radius", 1e3),
        ("L_b_6us_mm", 6.0, "length", 1e3),
        ("L_b_6us_offset_mm", 6.25, "length", 1e3),
        ("R_b_6us_robust_mm", 6.0, "radius_robust", 1e3),
        ("L_b_7us_offset_robust_mm", 7.25, "length_robust", 1e3),
        ("front_velocity_7us_km_per_s", 7.0, "front_velocity", 1e-3),
        ("cloud_mass_6us_offset_g", 6.25, "mass", 1e3),
    ):
        assert row[column] == pytest.approx(getattr(clouds[time], field) * factor)


def test_the_hole_is_that_of_the_snapshot(made):
    study, root = made
    row = collect(study, root)[0]
    folder = case_folder(root, study.cases[0])
    times = {f"{time * 1e6:.2f}": path for path, time in read_series(folder)}
    for where, time in (("6us", "6.00"), ("7us_offset", "7.25")):
        hole = measure_hole(read_snapshot(times[time]).arrays, study.cases[0].case)
        assert hole.diameter > 5e-3
        assert row[f"hole_{where}_mm"] == pytest.approx(hole.diameter * 1e3)
        assert row[f"hole_opening_{where}_mm"] == pytest.approx(hole.opening * 1e3)
    assert "hole_6us_mm" not in collect(study, root)[2]


def test_the_total_error_is_the_mean_of_the_absolute_errors(made):
    study, root = made
    row = collect(study, root)[0]
    for suffix in ("", "_offset"):
        errors = [
            100 * (row[f"{name}_{when}us{suffix}_mm"] / measured - 1)
            for name, when, measured in (
                ("R_b", 6, 15.3),
                ("L_b", 6, 31.7),
                ("R_b", 7, 37.5),
                ("L_b", 7, 98.0),
            )
        ]
        mean = sum(map(abs, errors)) / 4
        assert row[f"total_error{suffix}_percent"] == pytest.approx(mean)
        assert row[f"L_b_6us{suffix}_error_percent"] == pytest.approx(errors[1])
    assert total_error([1.0, -3.0]) == 2.0
    assert total_error([1.0, None]) is None
    assert total_error([]) is None


def test_the_fitted_offset_is_that_of_the_run(made):
    study, root = made
    row = collect(study, root)[0]
    assert "fitted_offset_us" not in row  # its best offset lies past the end
    history = read_history(case_folder(root, study.cases[0]) / "history.csv")
    # Told that the experiment found what the run has half a microsecond later.
    case = study.cases[0].case
    then = [
        e.model_copy(
            update={
                "radius": at(history, "cloud_radius", e.time + 0.3e-6),
                "length": at(history, "cloud_length", e.time + 0.3e-6),
            }
        )
        for e in case.measured.exposures
    ]
    measured = case.measured.model_copy(update={"exposures": tuple(then)})
    told = study.cases[0]._replace(case=case.model_copy(update={"measured": measured}))
    row = collect(study._replace(cases=(told,)), root)[0]
    assert row["fitted_offset_us"] == pytest.approx(0.3, abs=2e-3)
    assert row["total_error_fitted_percent"] < 0.05
    fit = fit_clock(history, told.case)
    assert row["fitted_offset_us"] == pytest.approx(fit.offset * 1e6)


def at(history, column, time):
    return float(np.interp(time, history["time"], history[column]))


def test_unstable_and_missing_runs_are_rows(made):
    study, root = made
    rows = collect(study, root)
    assert [row["status"] for row in rows] == [
        "completed",
        "to do",
        "unstable",
        "to do",
    ]
    assert rows[2]["reason"] == "energy_drift"
    assert rows[2]["total_error_percent"] is None
    assert rows[2]["R_b_6us_mm"] is None
    assert "steps" not in rows[1]


def test_the_files_hold_the_rows(made):
    study, root = made
    rows = collect(study, root)
    path = write_table(study, root, rows, parquet=True)
    with path.open(newline="") as file:
        read = list(csv.DictReader(file))
    assert [list(row) for row in read] == [columns(rows)] * 4
    for row, text in zip(rows, read, strict=True):
        for name, value in row.items():
            wanted = "" if value is None else str(value)
            assert text[name] == wanted
    table = pyarrow.parquet.read_table(path.with_suffix(".parquet")).to_pylist()
    assert [row["L_b_6us_mm"] for row in table] == [
        row.get("L_b_6us_mm") for row in rows
    ]
    assert not math.isnan(table[0]["total_error_percent"])


def test_a_missing_library_and_a_spoilt_result_are_named(made, monkeypatch, tmp_path):
    study, root = made
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(MpisphError, match=r"pip install 'mpisph\[parquet\]'"):
        write_table(study, root, collect(study, root), parquet=True)
    run_study(
        study._replace(cases=study.cases[2:3]),
        MPI.COMM_SELF,
        tmp_path,
        Console(quiet=True),
    )
    result = case_folder(tmp_path, study.cases[2]) / "result.json"
    result.write_text("{}")
    with pytest.raises(MpisphError, match=r"result\.json: not a result"):
        collect(study, tmp_path)
