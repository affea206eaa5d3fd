"""A search over runs that are judged at once, and its tables and figure."""

import csv
import json

import pytest
from click.testing import CliRunner
from mpi4py import MPI
from rich.console import Console
from shields import shield_case

import mpisph.study.limit.run as limit_run
from mpisph.case import CaseSource
from mpisph.cli.main import cli
from mpisph.core.errors import CaseError
from mpisph.run.signals import SignalHandler
from mpisph.study.assess.published import read_tests
from mpisph.study.limit.figure import alike, limit_figure
from mpisph.study.limit.outcome import limit_rows, limits
from mpisph.study.limit.plan import QUANTITIES, make_plan, parse_points
from mpisph.study.limit.run import Judged, search

LIMIT = {3e3: 2.6e-3, 7e3: 3.9e-3}
"""Diameters that just fail, by velocity."""


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(shield_case().to_toml())
    return CaseSource(path)


@pytest.fixture
def judged(monkeypatch):
    """Let runs be made by a table of limits; return the keys of those made."""
    made = {}

    def run_cases(cases, *_args, **_options):
        made.update({case.key: case for case in cases})
        return False

    def verdict(trial, _root):
        if trial.key not in made:
            return None
        projectile = trial.case.shield.projectile
        fails = projectile.diameter >= LIMIT[projectile.velocity]
        return Judged(trial, "perforated" if fails else "holds", 1.0, "by the table")

    monkeypatch.setattr(limit_run, "run_cases", run_cases)
    monkeypatch.setattr(limit_run, "_judged", verdict)
    return made


def search_of(plan, folder, **options):
    return search(plan, MPI.COMM_SELF, folder, Console(quiet=True), 0.05, **options)


def two_points(source):
    along = parse_points("velocity=3,7km/s")
    return make_plan(source, [], QUANTITIES["diameter"], along, None)


def test_each_point_finds_its_limit(source, judged, tmp_path):
    plan = two_points(source)
    found = search_of(plan, tmp_path / "runs")
    assert (found.left, found.stopped) == (0, False)
    assert found.runs() == len(judged)
    for limit, edge in zip(limits(plan, found), LIMIT.values(), strict=True):
        assert limit.holds < edge <= limit.fails
        assert limit.fails / limit.holds <= 1.051
        assert limit.note() == ""


def test_a_search_goes_on_without_repeating_a_run(source, judged, tmp_path):
    plan = two_points(source)
    first = search_of(plan, tmp_path, collect_only=True)
    assert (first.runs(), first.left) == (0, 2)
    whole = search_of(plan, tmp_path)
    before = dict(judged)
    again = search_of(plan, tmp_path)
    assert again.runs() == whole.runs()
    assert judged == before


def test_a_stop_keeps_what_is_there(source, judged, monkeypatch, tmp_path):
    rounds = []

    def stopping(cases, *_args, **_options):
        judged.update({case.key: case for case in cases})
        rounds.append(len(cases))
        return len(rounds) == 2

    monkeypatch.setattr(limit_run, "run_cases", stopping)
    plan = two_points(source)
    found = search_of(plan, tmp_path)
    assert found.stopped
    assert found.runs() == sum(rounds) == 4


def test_rows_are_in_the_units_of_their_names(source, judged, tmp_path):
    plan = two_points(source)
    listed = limits(plan, search_of(plan, tmp_path))
    rows, tries = limit_rows(plan, listed)
    assert [row["velocity_km_per_s"] for row in rows] == [3.0, 7.0]
    assert rows[0]["diameter_holds_mm"] < 2.6 <= rows[0]["diameter_fails_mm"]
    assert rows[0]["diameter_equation_mm"] == pytest.approx(
        1e3 * listed[0].equation, rel=1e-5
    )
    assert len(tries) == sum(row["runs"] for row in rows)
    assert {t["verdict"] for t in tries} == {"holds", "perforated"}


def test_the_figure_shows_tries_bars_curve_and_tests(source, judged, tmp_path):
    plan = two_points(source)
    listed = limits(plan, search_of(plan, tmp_path))
    path = tmp_path / "tests.csv"
    head = "row,proj_mat,proj_diam,velocity,bumper_mat,bumper_thick,standoff,"
    path.write_text(
        f"{head}wall_mat,wall_thick,result\n"
        "1,AA2017-T4,0.3175,6.5,AA6061-T6,0.0787,5.08,AA6061-T6,0.318,P\n"
        "2,AA2017-T4,0.3175,6.5,AA6061-T6,0.0787,5.08,AA6061-T6,0.400,NP\n"
        "3,AA2017-T4,0.2500,6.0,AA6061-T6,0.0787,5.08,AA6061-T6,0.318,NP\n"
    )
    tests = alike(plan, read_tests(path))
    assert [test.row for test in tests] == ["1", "3"]  # the second has another wall
    axes = limit_figure(plan, listed, tests).axes[0]
    labels = axes.get_legend_handles_labels()[1]
    for label in ("computed: holds", "computed: fails", "test: held", "test: failed"):
        assert label in labels
    assert "Christiansen’s equation" in labels
    assert "computed limit" in labels
    x, y = axes.collections[0].get_offsets().T
    held = [
        j.trial.value for limit in listed for j in limit.tries if j.outcome == "holds"
    ]
    assert sorted(y) == pytest.approx(sorted(1e3 * v for v in held))
    assert set(x) <= {3.0, 7.0}
    regimes = {text.get_text() for text in axes.texts}
    assert "shatters" in regimes


def test_what_is_refused_says_so(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(shield_case().to_toml())
    for options, words in (
        (["--tolerance", "0.1%"], "0.5% to 100%"),
        (["--at", "speed=3km/s"], "expected one of"),
        (["--between", "3mm"], "expected two values"),
        (["--find", "mass"], "mass"),
    ):
        result = CliRunner().invoke(
            cli, ["limit", str(path), *options], obj=SignalHandler()
        )
        assert result.exit_code == 2, result.output
        assert words in result.output
    made = CliRunner().invoke(
        cli,
        ["limit", str(path), "--at", "diameter=3mm"],
        obj=SignalHandler(),
    )
    assert isinstance(made.exception, CaseError)


@pytest.mark.slow
def test_a_limit_of_two_real_runs(tmp_path):
    path = tmp_path / "near.toml"
    near = shield_case(
        projectile={"velocity": "4 km/s"},
        bumpers={"standoff": "8 mm", "radius": "6 mm"},
        wall={"radius": "9 mm"},
        resolution={"npr": 4},
        time={"end": "10 us"},
        output={"figures": False},
    )
    path.write_text(near.to_toml())
    folder = tmp_path / "limit"
    options = ["--find", "thickness", "--between", "1.6,12mm", "--tolerance", "100%"]
    arguments = ["limit", str(path), *options, "-o", str(folder)]
    brief = [*arguments, "--walltime", "1s"]
    first = CliRunner().invoke(cli, brief, obj=SignalHandler())
    assert first.exit_code in {0, 75}, first.output
    result = CliRunner().invoke(cli, arguments, obj=SignalHandler())
    assert result.exit_code == 0, result.output
    with (folder / "limit.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert 1.6 <= float(row["thickness_fails_mm"]) < float(row["thickness_holds_mm"])
    assert float(row["thickness_holds_mm"]) <= 12.0
    assert (folder / "limit.png").stat().st_size > 10_000
    keys = [p.name for p in (folder / "cases").iterdir()]
    verdicts = [
        json.loads((folder / "cases" / key / "result.json").read_text())["verdict"]
        for key in keys
    ]
    assert len(verdicts) == int(row["runs"])
