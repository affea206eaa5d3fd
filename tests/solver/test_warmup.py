"""Compiled code: the same bits whether just compiled or loaded from the cache."""

import os
import subprocess
import sys

import pytest
from launch import CASES, MPISPH, environment, launch
from mpi4py import MPI

from mpisph.case import load_case
from mpisph.solver import warmup

pytestmark = pytest.mark.slow

DIGEST = """
import hashlib
from mpi4py import MPI
from mpisph.solver.warmup import warm_up
from plates import plate_impact, states_at
warm_up(MPI.COMM_SELF)
case = plate_impact(3e3, 1e-3, 2e-3, 1e-4)
(sim,) = states_at(case, (5e-8,))
print(hashlib.sha256(sim.particles.values.tobytes()).hexdigest())
"""


def digest(cache, tests):
    """The digest of a state, from a process that compiles what is not in a cache."""
    done = subprocess.run(
        [sys.executable, "-c", DIGEST],
        env=environment(MPISPH_CACHE_DIR=str(cache), PYTHONPATH=str(tests)),
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return done.stdout


@pytest.fixture(scope="module")
def compiled(tmp_path_factory, request):
    """A cache folder that was warmed up, and a digest from the process that did it."""
    folder = tmp_path_factory.mktemp("cache")
    return folder, digest(folder, request.path.parents[1])


@pytest.fixture
def cache(compiled):
    return compiled[0]


def test_compiled_and_loaded_code_give_the_same_bits(compiled, request):
    cache, expected = compiled
    before = compiled_files(cache)
    assert before, "something was cached"
    assert digest(cache, request.path.parents[1]) == expected
    assert compiled_files(cache) == before


SHOT, SHIELD = "piekutowski-4-1353", "whipple-shield"

SETTINGS = {
    "default": (SHOT,),
    "tillotson": (
        SHOT,
        "scheme.eos=tillotson",
        "scheme.strength=none",
        "scheme.smoothing=classic",
    ),
    "fixed": (SHOT, "time.step=fixed", "time.dt=1 ns", "scheme.self_term=false"),
    # Until matter leaves the game.
    "shield": (SHIELD, "time.end=8 us"),
}


@pytest.fixture
def short_runs(tmp_path):
    """A command that makes short runs with all kinds of settings."""
    paths = []
    for name, (base, *overrides) in SETTINGS.items():
        short = ("time.end=30 ns", "resolution.npr=4", "output.figures=false")
        case = load_case(CASES / f"{base}.toml", (*short, *overrides))
        paths.append(tmp_path / f"{name}.toml")
        paths[-1].write_text(case.to_toml())
    return MPISPH, "run", *paths, "-o", tmp_path


def test_a_run_compiles_nothing_that_the_warm_up_has_not(cache, short_runs):
    """Ranks that compiled at once could spoil the cache."""
    before = compiled_files(cache)
    done = launch(2, *short_runs, MPISPH_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    assert "compiling" not in done.stderr
    assert compiled_files(cache) == before


def test_ranks_of_a_node_share_the_compiling(cache, short_runs, tmp_path):
    """They make the same code as one, each function once, and can use it."""
    shared = tmp_path / "shared"
    done = launch(
        2, *short_runs[:3], "-o", tmp_path / "first", MPISPH_CACHE_DIR=str(shared)
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.count("compiling") == 1
    names = {path.name for path in shared.rglob("*.nb?")}
    of_both_forms = {path.name for path in cache.rglob("*.nb?")}
    assert "sources._carry" in "".join(names)
    assert names <= of_both_forms
    again = launch(
        2, *short_runs[:3], "-o", tmp_path / "again", MPISPH_CACHE_DIR=str(shared)
    )
    assert again.returncode == 0, again.stderr
    assert "compiling" not in again.stderr
    assert {path.name for path in shared.rglob("*.nb?")} == names


def test_damaged_code_is_compiled_again(cache, short_runs):
    """As a full disk leaves it: Numba alone would fail at every start."""
    code = min(cache.rglob("integrator._drift-*.nbc"))
    os.truncate(code, 100)
    done = launch(2, *short_runs, MPISPH_CACHE_DIR=str(cache))
    assert done.returncode == 0, done.stderr
    assert done.stderr.count(f"was damaged; removed {code.name}") == 1
    assert done.stderr.count("compiling") == 2  # for either pair form
    assert code.stat().st_size > 100


def test_what_is_missing_of_the_forms_asked_for_is_compiled(monkeypatch):
    marked, compiled = {"lee2003"}, []
    monkeypatch.setattr(warmup, "is_compiled", marked.__contains__)
    monkeypatch.setattr(warmup, "mark_compiled", marked.add)
    monkeypatch.setattr(warmup, "_compile", lambda form, node: compiled.append(form))
    monkeypatch.setattr(warmup, "prune_cache", lambda: None)
    warmup.warm_up(MPI.COMM_SELF, ["lee2003"])
    assert compiled == []
    warmup.warm_up(MPI.COMM_SELF)
    assert compiled == ["consistent"]
    warmup.warm_up(MPI.COMM_SELF)
    assert compiled == ["consistent"]


def compiled_files(folder):
    """The names and times of all files of compiled code."""
    return {(path.name, path.stat().st_mtime_ns) for path in folder.rglob("*.nb?")}
