"""A shield with a rear wall: the cloud's measures end when it comes to the wall."""

import json
import math

import numpy as np
import pytest
from launch import CASES
from small_runs import small_run

from mpisph.case import load_case
from mpisph.figures.view import measure_cloud
from mpisph.io.history import read_history
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.io.stored_run import read_run

WALL = """
[[bodies]]
name = "wall"
shape = "plate"
thickness = "3 mm"
radius = "20 mm"
position = "12 mm"
material = "al-lee2003"

[resolution]"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shield")
    text = (CASES / "piekutowski-4-1283.toml").read_text()
    case = folder / "shield.toml"
    case.write_text(text.replace("[resolution]", WALL, 1))
    overrides = (
        "resolution.npr=4",
        "time.end=5us",
        "output.figures=false",
        "measured.exposures.0.time=1.2us",
        "measured.clock_offset=2us",
    )
    small_run(folder / "run", *overrides, case=case)
    return folder / "run"


def test_measures_end_with_the_arrival_in_history_and_snapshots(folder):
    rows = read_history(folder / "history.csv")
    arrival = json.loads((folder / "result.json").read_text())["cloud_arrival"]
    # The front flies 11 mm from the rear face, at some 7.2 km/s.
    assert 1.2e-6 < arrival < 2.2e-6
    before = rows["time"] < arrival
    assert np.array_equal(rows["cloud_arrived"], 1.0 * ~before)
    assert np.all(np.diff(rows["cloud_length"][before]) >= 0.0)
    assert 0.0 < rows["cloud_length"][before].max() <= 12e-3 - 0.968e-3
    for name in ("cloud_radius", "cloud_length", "cloud_mass"):
        assert np.isfinite(rows[name][before]).all()
        assert np.isnan(rows[name][~before]).all()
    case = load_case(folder / "case.toml")
    for path, time in read_series(folder):
        measure = measure_cloud(read_snapshot(path), case)
        assert math.isnan(measure.length) == (time >= arrival)


def test_the_result_says_why_there_is_no_measure(folder):
    run = read_run(folder)
    late = [cloud for cloud in run.clouds if cloud.time > run.result.cloud_arrival]
    assert late
    for cloud in late:
        assert cloud.reason == "the cloud has reached wall"
        assert np.isnan(cloud.measure).all()
    outcomes = {c.clock: c.outcome for c in run.result.comparisons}
    assert outcomes == {"nominal": "compared", "offset": "arrived"}
    assert "the cloud has reached wall at t" in (folder / "log.txt").read_text()
