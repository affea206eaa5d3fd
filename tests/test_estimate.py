"""The size of a run, estimated before it starts."""

import subprocess
import sys

import pytest
from launch import CASES, environment
from mpi4py import MPI

from mpisph.case import load_case
from mpisph.estimate import RANK_BYTES, estimate
from mpisph.geometry import discretise
from mpisph.run import run

SHOT = CASES / "piekutowski-4-1353.toml"

PEAK = """
import resource, sys
from mpi4py import MPI
from mpisph.case import load_case
from mpisph.simulation import advance, start, survey
sim = start(load_case(sys.argv[1], ["resolution.npr=120"]), MPI.COMM_WORLD)
advance(sim, 1e-10, survey(sim).claims)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_particles_are_counted():
    case = load_case(SHOT)
    assert estimate(case, 1).particles == pytest.approx(discretise(case).id.size, abs=2)


def test_steps_are_foreseen_within_a_quarter(tmp_path):
    for overrides in (("resolution.npr=5",), ("time.step=fixed", "time.dt=5 ns")):
        settings = ("time.end=5us", "output.figures=false", *overrides)
        case = load_case(SHOT, settings)
        steps = run(case, MPI.COMM_SELF, tmp_path, force=True).step
        assert estimate(case, 1).steps == pytest.approx(steps, rel=0.25)


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
