"""Compiled code: the same bits whether just compiled or loaded from the cache."""

import subprocess
import sys

from launch import environment

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
    compiled = digest(tmp_path, request.path.parent)
    assert list(tmp_path.rglob("*.nbc")), "something was cached"
    assert digest(tmp_path, request.path.parent) == compiled
