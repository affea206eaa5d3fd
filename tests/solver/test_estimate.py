"""The size of a run, estimated before it starts."""

import subprocess
import sys

import pytest
from launch import CASES, environment
from mpi4py import MPI

from mpisph.case import load_case
from mpisph.case.discretise import discretise
from mpisph.core.errors import CaseError
from mpisph.run.session import run
from mpisph.solver.estimate import PARTICLE_BYTES, RANK_BYTES, check_memory, estimate

SHOT = CASES / "piekutowski-4-1353.toml"

# VmHWM is of this program alone; ru_maxrss would count the process that started it.
PEAK = """
import re, sys
from pathlib import Path
from mpi4py import MPI
from mpisph.case import load_case
from mpisph.solver.start import start
from mpisph.solver.step import advance, reduce_state
sim = start(load_case(sys.argv[1], ["resolution.npr=120"]), MPI.COMM_WORLD)
advance(sim, 1e-10, reduce_state(sim).rank_boxes)
print(re.search(r"VmHWM:\\s*(\\d+) kB", Path("/proc/self/status").read_text())[1])
"""


def test_particles_are_counted():
    case = load_case(SHOT)
    assert estimate(case, 1).particles == pytest.approx(discretise(case).id.size, abs=2)


@pytest.mark.slow
def test_steps_are_foreseen_within_a_quarter(tmp_path):
    for overrides in (("resolution.npr=5",), ("time.step=fixed", "time.dt=5 ns")):
        settings = ("time.end=5us", "output.figures=false", *overrides)
        case = load_case(SHOT, settings)
        steps = run(case, MPI.COMM_SELF, tmp_path, force=True).step
        assert estimate(case, 1).steps == pytest.approx(steps, rel=0.25)


@pytest.mark.slow
def test_memory_is_foreseen_within_a_quarter():
    done = subprocess.run(
        [sys.executable, "-c", PEAK, SHOT],
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    case = load_case(SHOT, ["resolution.npr=120"])
    assert 1024 * int(done.stdout) == pytest.approx(estimate(case, 1).memory, rel=0.25)


def test_every_rank_brings_its_own_libraries():
    one, four = (estimate(load_case(SHOT), ranks) for ranks in (1, 4))
    assert four.memory - one.memory == 3 * RANK_BYTES
    assert "4 ranks" in four.text()
    assert str(four.particles) in four.text()


def test_many_ranks_take_no_more_for_the_particles_than_one():
    one, many = (estimate(load_case(SHOT), ranks) for ranks in (1, 64))
    assert many.memory - one.memory == pytest.approx(63 * RANK_BYTES)


def test_the_wall_time_is_near_what_runs_took():
    """4-1353 to 6 us: 69-73 s at NPR 40 on one rank, 617-654 s at NPR 100 on two."""
    for npr, ranks, took in ((40, 1, 71.0), (100, 2, 635.0)):
        settings = (f"resolution.npr={npr}", "time.end=6us", "measured=")
        wall = estimate(load_case(SHOT, settings), ranks).wall
        assert 0.5 * took < wall < 2.0 * took


def test_the_wall_time_is_told_in_a_unit_that_fits():
    one = estimate(load_case(SHOT), 1)
    for wall, words in ((0.2, "1 s"), (119.0, "119 s"), (500.0, "8.3 min"),
                        (7300.0, "2 h"), (1e6, "12 days")):  # fmt: skip
        assert f"about {words}, an estimate" in one._replace(wall=wall).text()


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize(
    ("overrides", "key"),
    [
        (["resolution.npr=2000"], "resolution.npr"),
        (["resolution.npr=", "resolution.spacing=2 um"], "resolution.spacing"),
    ],
)
def test_a_case_beyond_the_memory_is_refused_on_all_ranks(monkeypatch, overrides, key):
    """All ranks are on one node here; the last one may use less than the others."""
    comm = MPI.COMM_WORLD
    case = load_case(SHOT, overrides)
    # As much for each particle on however many ranks.
    needed = comm.size * RANK_BYTES + estimate(case, 1).particles * PARTICLE_BYTES
    enough, short = round(1.05 * needed), round(0.95 * needed)
    monkeypatch.setattr("mpisph.solver.estimate.total_memory", lambda: enough)
    check_memory(case, comm)
    mine = short if comm.rank == comm.size - 1 else enough
    monkeypatch.setattr("mpisph.solver.estimate.total_memory", lambda: mine)
    with pytest.raises(CaseError) as caught:
        check_memory(case, comm)
    (problem,) = caught.value.problems
    assert problem.key == key
    assert f"on a node of {short / 2**30:.3g} GiB" in problem.expected
    assert set(comm.allgather(str(caught.value))) == {str(caught.value)}


@pytest.mark.mpi(min_size=2)
def test_a_node_needs_memory_for_its_own_ranks_alone(monkeypatch):
    comm = MPI.COMM_WORLD

    class Alone(MPI.Intracomm):
        """Every rank is alone on its node."""

        def Split_type(self, kind):  # noqa: N802
            assert kind == MPI.COMM_TYPE_SHARED
            return self.Split(self.rank)

    case = load_case(SHOT, ["resolution.npr=500"])
    too_little = 0.9 * estimate(case, comm.size).memory
    monkeypatch.setattr("mpisph.solver.estimate.total_memory", lambda: too_little)
    check_memory(case, Alone(comm))
    with pytest.raises(CaseError):
        check_memory(case, comm)
