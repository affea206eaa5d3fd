"""Compiled code: the same bits whether just compiled or loaded from the cache."""

import subprocess
import sys

import pytest
from launch import CASES, MPISPH, environment, launch

pytestmark = pytest.mark.slow

DIGEST = """
import hashlib
from mpi4py import MPI
from plates import plate_impact, states_at
case = plate_impact(3e3, 1e-3, 2e-3, 1e-4)
(sim,) = states_at(case, (5e-8,))
print(hashlib.sha256(sim.particles.values.tobytes()).hexdigest())
"""


def digest(cache, tests):
    done = subprocess.run(
        [sys.executable, "-c", DIGEST],
        env=environment(MPISPH_CACHE_DIR=str(cache), PYTHONPATH=str(tests)),
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return done.stdout


def test_compiled_and_loaded_code_give_the_same_bits(tmp_path, request):
    compiled = digest(tmp_path, request.path.parents[1])
    assert list(tmp_path.rglob("*.nbc")), "something was cached"
    assert digest(tmp_path, request.path.parents[1]) == compiled


@pytest.mark.parametrize(
    "overrides",
    [
        (),
        ("scheme.eos=tillotson", "scheme.strength=none", "scheme.smoothing=classic"),
        ("time.step=fixed", "time.dt=1 ns", "scheme.self_term=false"),
    ],
    ids=["default", "tillotson", "fixed"],
)
def test_a_run_compiles_nothing_that_the_warm_up_has_not(cache, tmp_path, overrides):
    """Ranks that compiled at once could spoil the cache."""
    before = compiled_files(cache)
    assert before
    words = [
        word
        for override in (*overrides, "resolution.npr=4", "time.end=30 ns")
        for word in ("--set", override)
    ]
    case = CASES / "piekutowski-4-1353.toml"
    command = (MPISPH, "run", case, *words, "-o", tmp_path)
    done = launch(2, *command, MPISPH_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    assert "compiling" not in done.stderr
    assert compiled_files(cache) == before


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """A cache folder that was warmed up."""
    folder = tmp_path_factory.mktemp("cache")
    done = launch(2, MPISPH, "cache", "warm", MPISPH_CACHE_DIR=str(folder))
    assert done.returncode == 0, done.stderr
    assert str(folder) in done.stdout
    assert done.stdout.count("compiled") == 1
    return folder


def compiled_files(folder):
    """The names and times of all files of compiled code."""
    return {(path.name, path.stat().st_mtime_ns) for path in folder.rglob("*.nb?")}
