"""Compiled code: the same bits whether just compiled or loaded from the cache."""

import errno
import json
import os
import sys

import pytest
import tables
from launch import CASES, MPISPH, launch
from mpi4py import MPI
from oracles import agree

from mpisph.case import load_case
from mpisph.case.sections import PAIR_FORMS
from mpisph.core.errors import CollectiveError
from mpisph.core.jit import CACHE_FOLDER
from mpisph.solver import warmup

pytestmark = pytest.mark.slow

DIGEST = """
import hashlib
import json
import sys
from mpi4py import MPI
from numba.core import event
from mpisph.solver.warmup import warm_up
from plates import plate_impact, states_at

class Names(event.Listener):
    # Functions compiled for Python; what they call is compiled within.
    def on_start(self, found):
        if not any(open_):
            names.append(found.data["dispatcher"].__qualname__)
        open_.append(True)
    def on_end(self, found):
        open_.pop()

names, open_ = [], []
event.register("numba:compile", Names())
warm_up(MPI.COMM_WORLD, sys.argv[1:])
of_warm_up = list(names)
case = plate_impact(3e3, 1e-3, 2e-3, 1e-4)
(sim,) = states_at(case, (5e-8,))
digest = hashlib.sha256(sim.particles.values.tobytes()).hexdigest()
everyone = MPI.COMM_WORLD.gather((of_warm_up, digest))
if everyone:
    print(json.dumps(everyone))
"""


def digests(cache, tests, ranks=1, forms=PAIR_FORMS):
    """What each rank compiles that is not in a cache, and the digests of a state."""
    done = launch(
        ranks, sys.executable, "-c", DIGEST, *forms, timeout=300,
        MPISPH_CACHE_DIR=str(cache), PYTHONPATH=str(tests),
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    names, found = zip(*json.loads(done.stdout), strict=True)
    return list(names), set(found)


@pytest.fixture(scope="module")
def compiled(tmp_path_factory, request):
    """A cache folder that was warmed up, and a digest from the process that did it."""
    folder = tmp_path_factory.mktemp("cache")
    _, found = digests(folder, request.path.parents[1])
    return folder, found


@pytest.fixture
def cache(compiled):
    return compiled[0]


def test_compiled_and_loaded_code_give_the_same_bits(compiled, request):
    cache, expected = compiled
    before = compiled_files(cache)
    assert before, "something was cached"
    names, found = digests(cache, request.path.parents[1])
    assert found == expected
    assert len(expected) == 1
    assert names == [[]]
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
    "table": (SHOT, "bodies.plate.material={folder}/solid.toml"),
    # Until matter leaves the game.
    "shield": (SHIELD, "time.end=8 us"),
}


@pytest.fixture
def short_runs(tmp_path):
    """A command that makes short runs with all kinds of settings."""
    (tmp_path / "solid.toml").write_text(tables.SOLID_CARD)
    (tmp_path / "solid.csv").write_text(tables.as_csv(tables.mie_grueneisen()))
    paths = []
    for name, (base, *settings) in SETTINGS.items():
        overrides = [setting.format(folder=tmp_path) for setting in settings]
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


def test_ranks_of_a_node_share_the_compiling(compiled, request, tmp_path):
    """No function is compiled by both, and both compute what one rank does."""
    tests = request.path.parents[1]
    names, found = digests(tmp_path, tests, 2, ["consistent"])
    assert found == compiled[1]
    one, other = map(set, names)
    assert not one & other
    assert {"respond_rows", "_update_rates"} <= one | other
    assert len({"respond_rows", "_update_rates"} & one) == 1
    again, found = digests(tmp_path, tests, 2, ["consistent"])
    assert again == [[], []]
    assert found == compiled[1]


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


@pytest.mark.mpi(min_size=1)
def test_a_rank_that_cannot_compile_ends_it_for_all(monkeypatch):
    """With the place: Numba's own error names no file."""
    comm = MPI.COMM_WORLD

    def full(sim):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(warmup, "is_compiled", lambda form: False)
    monkeypatch.setattr(warmup, "PARTS", [lambda sim: None] * (comm.size - 1) + [full])
    problems = []
    try:
        warmup.warm_up(comm, ["consistent"])
    except CollectiveError as error:
        if f"No space left on device: {CACHE_FOLDER}" not in str(error):
            problems.append(error)
    else:
        problems.append("no error")
    agree(comm, problems)


def compiled_files(folder):
    """The names and times of all files of compiled code."""
    return {(path.name, path.stat().st_mtime_ns) for path in folder.rglob("*.nb?")}
