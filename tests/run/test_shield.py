"""A run of a shield: its wall is measured, judged, and the same on any ranks."""

import json

import pytest
from mpi4py import MPI
from rich.console import Console
from shields import coarse

from mpisph.io.result import read_result
from mpisph.run.session import resume, run
from mpisph.run.signals import SignalHandler


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("shield")
    run(coarse(), MPI.COMM_SELF, folder, Console(quiet=True))
    return folder


def test_the_wall_is_measured_at_each_output_time(folder):
    result = read_result(folder / "result.json")
    times = [wall.time for wall in result.walls]
    assert times == pytest.approx([0.0, 3e-6, 6e-6, 9e-6, 10e-6, 12e-6])
    first, last = result.walls[0], result.walls[-1]
    assert (first.shear, first.hole, first.ligament) == (0.0, 0.0, 1.0)
    assert last.bulge > 0.0
    assert result.verdict.wall == last


def test_a_thin_wall_fails_and_a_thick_one_holds(folder, tmp_path):
    thin = read_result(folder / "result.json").verdict
    assert thin.outcome == "perforated"
    assert thin.damage > 1.0
    case = coarse(wall={"thickness": "12 mm", "radius": "9 mm"})
    thick = run(case, MPI.COMM_SELF, tmp_path, Console(quiet=True)).verdict
    assert thick.outcome == "holds"
    assert thick.damage < 1.0


def test_momentum_by_body_adds_up(folder):
    result = read_result(folder / "result.json")
    momentum = sum(body.momentum_z for body in result.bodies)
    projectile = result.bodies[0]
    assert momentum == pytest.approx(projectile.mass * 4000.0, rel=1e-6)
    energy = sum(b.kinetic_energy + b.internal_energy for b in result.bodies)
    assert energy == pytest.approx(0.5 * projectile.mass * 4000.0**2, rel=1e-6)


def test_an_interrupted_run_has_the_same_walls(folder, tmp_path):
    case = coarse()
    signals = SignalHandler()
    signals.limit(0.0)
    stopped = run(case, MPI.COMM_SELF, tmp_path, Console(quiet=True), signals=signals)
    assert stopped.status == "stopped"
    assert stopped.verdict is None
    resume(MPI.COMM_SELF, tmp_path, Console(quiet=True))
    for name in ("walls", "verdict", "bodies"):
        mine, other = (
            json.loads((place / "result.json").read_text())[name]
            for place in (tmp_path, folder)
        )
        assert mine == other, name


def test_a_run_that_breaks_down_is_undecided(tmp_path):
    case = coarse(limits={"density_ratio_max": 1.2})
    result = run(case, MPI.COMM_SELF, tmp_path, Console(quiet=True))
    assert result.status == "unstable"
    assert result.verdict.outcome == "undecided"
    assert "broke down" in result.verdict.reason


@pytest.mark.mpi(min_size=2)
def test_walls_have_the_same_bits_on_any_ranks(tmp_path_factory):
    comm = MPI.COMM_WORLD
    place = comm.bcast(str(tmp_path_factory.mktemp("all")) if comm.rank == 0 else None)
    mine = comm.bcast(str(tmp_path_factory.mktemp("one")) if comm.rank == 0 else None)
    together = run(coarse(), comm, place, Console(quiet=True))
    alone = None
    if comm.rank == 0:
        alone = run(coarse(), MPI.COMM_SELF, mine, Console(quiet=True))
    alone = comm.bcast(alone)
    assert together.walls == alone.walls
    assert together.verdict == alone.verdict
    assert together.bodies == alone.bodies
