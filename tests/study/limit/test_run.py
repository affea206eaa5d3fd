"""A search over runs that are judged at once, and its tables and figure."""

import csv
import json

import pytest
from click.testing import CliRunner
from launch import MPISPH, launch
from mpi4py import MPI
from rich.console import Console
from shields import shield_case, shield_data

import mpisph.study.limit.run as limit_run
from mpisph.case import CaseSource, case_from_dict
from mpisph.cli.main import cli
from mpisph.core.errors import CaseError
from mpisph.io.status import StatusFile
from mpisph.run.signals import SignalHandler
from mpisph.study.assess.published import read_tests
from mpisph.study.limit.figure import alike, limit_figure
from mpisph.study.limit.outcome import limit_rows, limits
from mpisph.study.limit.plan import QUANTITIES, make_plan, make_try, parse_points
from mpisph.study.limit.run import Judged, search
from mpisph.study.store import case_folder

LIMIT = {3e3: 2.6e-3, 5e3: 3.3e-3, 7e3: 3.9e-3}
"""Diameters that just fail, by velocity."""


def by_table(projectile):
    fails = projectile.diameter >= LIMIT[projectile.velocity]
    return "perforated" if fails else "holds"


class Runs:
    """Runs that leave their case alone and are judged at once.

    Parameters
    ----------
    judge : callable
        The verdict on a projectile.
    rounds : int, optional
        How many rounds are run to the end before a stop.
    """

    def __init__(self, judge=by_table, rounds=100):
        self.judge, self.rounds = judge, rounds
        self.made = []

    def run(self, tries, _comm, root, *_args, **_options):
        for trial in tries:
            self.made.append(trial.key)
            folder = case_folder(root, trial)
            folder.mkdir(parents=True)
            (folder / "case.toml").write_text(trial.case.to_toml())
            StatusFile(MPI.COMM_SELF, folder, 1.0, 1).write("completed", 1, 1.0)
        self.rounds -= 1
        return self.rounds == 0

    def judged(self, trial, root):
        if not case_folder(root, trial).exists():
            return None
        outcome = self.judge(trial.case.shield.projectile)
        return Judged(trial, outcome, 1.0, "by the judge")


@pytest.fixture
def source(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(shield_case().to_toml())
    return CaseSource(path)


@pytest.fixture
def judged(monkeypatch):
    """Return a function that lets `Runs` be made; by default those of the table."""

    def make(*args, **options):
        runs = Runs(*args, **options)
        monkeypatch.setattr(limit_run, "run_cases", runs.run)
        monkeypatch.setattr(limit_run, "_judged", runs.judged)
        return runs

    make.of_table = make()
    return make


def search_of(plan, folder, **options):
    return search(plan, MPI.COMM_SELF, folder, Console(quiet=True), 0.05, **options)


def plan_of(source, at="velocity=3,7km/s", overrides=()):
    along = None if at is None else parse_points(at)
    return make_plan(source, overrides, QUANTITIES["diameter"], along, None)


def test_each_point_finds_its_limit(source, judged, tmp_path):
    plan = plan_of(source)
    found = search_of(plan, tmp_path / "runs")
    assert (found.left, found.stopped) == (0, False)
    assert found.runs() == len(judged.of_table.made)
    for limit in limits(plan, found):
        edge = LIMIT[limit.at]
        assert limit.holds < edge <= limit.fails
        assert limit.fails / limit.holds <= 1.051
        assert limit.note() == ""


def test_a_search_goes_on_without_repeating_a_run(source, judged, tmp_path):
    plan, made = plan_of(source), judged.of_table.made
    first = search_of(plan, tmp_path, collect_only=True)
    assert (first.runs(), first.left) == (0, 2)
    whole = search_of(plan, tmp_path)
    before = list(made)
    assert len(set(before)) == len(before)
    for collect_only in (False, True):
        again = search_of(plan, tmp_path, collect_only=collect_only)
        assert limits(plan, again) == limits(plan, whole)
        assert (again.left, made) == (0, before)


def test_a_stop_keeps_what_is_there(source, judged, tmp_path):
    plan = plan_of(source)
    first = judged(rounds=2)
    found = search_of(plan, tmp_path)
    assert found.stopped
    assert found.runs() == len(first.made) == 4
    second = judged()
    whole = search_of(plan, tmp_path)
    assert whole.runs() == 4 + len(second.made)
    assert not set(first.made) & set(second.made)


def test_all_runs_there_count(source, judged, tmp_path):
    """Those of a search on other ranks have divided its brackets elsewhere."""
    plan = plan_of(source)
    for point, value in ((0, 2.55e-3), (0, 2.61e-3), (1, 3.85e-3), (1, 3.95e-3)):
        judged.of_table.run([make_try(plan, point, value)], None, tmp_path)
    found = search_of(
        plan_of(source, "velocity=3,5,7km/s"), tmp_path, collect_only=True
    )
    assert [len(tries) for tries in found.tries] == [2, 0, 2]
    assert found.left == 1
    other = plan_of(source, overrides=["time.cfl=0.3"])
    assert search_of(other, tmp_path, collect_only=True).runs() == 0


def test_other_folders_are_no_tries(source, judged, tmp_path):
    for name, text in (("half", "[shield"), ("rod", 'title = "a rod"')):
        (tmp_path / "cases" / name).mkdir(parents=True)
        (tmp_path / "cases" / name / "case.toml").write_text(text)
    found = search_of(plan_of(source), tmp_path, collect_only=True)
    assert found.runs() == 0


def test_what_failed_is_shown_and_run_again(source, monkeypatch, tmp_path):
    ran = []

    def run_cases(tries, _comm, root, *_args, **_options):
        for trial in tries:
            ran.append(trial.key)
            folder = case_folder(root, trial)
            folder.mkdir(parents=True, exist_ok=True)
            (folder / "case.toml").write_text(trial.case.to_toml())
            StatusFile(MPI.COMM_SELF, folder, 1.0, 1).fail("no space left")
        return False

    monkeypatch.setattr(limit_run, "run_cases", run_cases)
    plan = plan_of(source, at=None)
    found = search_of(plan, tmp_path)
    (limit,) = limits(plan, found)
    assert limit.note() == "nothing is decided"
    assert "no space left" in limit.tries[0].reason
    shown = search_of(plan, tmp_path, collect_only=True)
    assert shown.runs() == found.runs() == len(ran) == len(set(ran))
    search_of(plan, tmp_path)
    assert len(ran) == 2 * len(set(ran))


def test_where_all_holds_it_ends_at_what_is_refused(source, judged, tmp_path):
    judged(lambda _: "holds")
    plan = plan_of(source, overrides=["shield.bumpers.0.radius=5mm"])
    for limit in limits(plan, search_of(plan, tmp_path)):
        assert limit.fails is None
        assert 9.5e-3 < limit.holds < 10e-3
        assert limit.note().startswith("nothing fails; 10")
        assert " mm is refused: shield.bumpers.0.radius: " in limit.note()


def test_what_is_undecided_makes_a_bar(source, judged, tmp_path):
    def judge(projectile):
        middle = 0.95 < projectile.diameter / LIMIT[projectile.velocity] < 1.15
        return "undecided" if middle else by_table(projectile)

    judged(judge)
    plan = plan_of(source)
    found = limits(plan, search_of(plan, tmp_path))
    for limit in found:
        assert limit.note() == "undecided between"
        assert limit.holds <= 0.95 * LIMIT[limit.at]
        assert limit.fails >= 1.15 * LIMIT[limit.at]
    rows, _ = limit_rows(plan, found)
    assert "undecided" in rows[0]["verdicts"]
    labels = limit_figure(plan, found, []).axes[0].get_legend_handles_labels()[1]
    assert "computed: undecided" in labels


def test_what_holds_beyond_a_failure_is_said(source, judged, tmp_path):
    judged(lambda p: "perforated" if 3e-3 < p.diameter < 4.3e-3 else "holds")
    plan = plan_of(source, "velocity=7km/s")
    for value in (4e-3, 5e-3, 6e-3):
        limit_run.run_cases([make_try(plan, 0, value)], None, tmp_path)
    (limit,) = limits(plan, search_of(plan, tmp_path))
    assert limit.holds <= 3e-3 < limit.fails
    assert limit.holds_beyond == (5e-3, 6e-3)
    assert limit.note() == "holds beyond a failure too"


@pytest.mark.parametrize(
    ("find", "at"),
    [
        ("diameter", "velocity=3,7km/s"),
        ("velocity", "diameter=3,4mm"),
        ("thickness", "velocity=3,7km/s"),
        ("diameter", "standoff=40,60mm"),
        ("diameter", None),
    ],
)
def test_every_figure_has_the_equation_and_the_limits(
    source, judged, tmp_path, find, at
):
    judged(lambda p: "perforated" if p.diameter * p.velocity**0.3 > 0.045 else "holds")
    along = None if at is None else parse_points(at)
    plan = make_plan(source, [], QUANTITIES[find], along, None)
    axes = limit_figure(plan, limits(plan, search_of(plan, tmp_path)), []).axes[0]
    labels = axes.get_legend_handles_labels()[1]
    assert "Christiansen’s equation" in labels
    assert plan.find.label in axes.get_ylabel()


def test_rows_are_in_the_units_of_their_names(source, judged, tmp_path):
    plan = plan_of(source)
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
    plan = plan_of(source)
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


def test_a_shield_of_two_bumpers_has_no_equation(judged, tmp_path):
    judged(lambda p: "perforated" if p.diameter > 3e-3 else "holds")
    data = shield_data()
    (bumper,) = data["shield"]["bumpers"]
    data["shield"]["bumpers"] = [bumper, bumper]
    path = tmp_path / "two.toml"
    path.write_text(case_from_dict(data).to_toml())
    tests = tmp_path / "tests.csv"
    tests.write_text(
        "row,proj_mat,proj_diam,velocity,bumper_mat,bumper_thick,standoff,"
        "wall_mat,wall_thick,result\n"
        "1,AA2017-T4,0.3175,6.5,AA6061-T6,0.0787,5.08,AA6061-T6,0.318,P\n"
    )
    result = CliRunner().invoke(
        cli,
        ["limit", str(path), "--tests", str(tests), "-o", str(tmp_path / "runs")],
        obj=SignalHandler(),
    )
    assert result.exit_code == 0, result.output
    assert "left out: the shield has 2 bumpers" in result.output
    assert "0 published tests of this shield" in result.output
    assert (tmp_path / "runs/limit.png").exists()


@pytest.mark.slow
def test_a_real_search_stopped_continued_on_two_ranks_and_collected_on_one(tmp_path):
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
    whole = launch(2, MPISPH, *arguments, timeout=300)
    assert whole.returncode == 0, whole.stderr
    table = (folder / "limit.csv").read_text()
    arguments.append("--collect-only")
    result = CliRunner().invoke(cli, arguments, obj=SignalHandler())
    assert result.exit_code == 0, result.output
    assert (folder / "limit.csv").read_text() == table
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
