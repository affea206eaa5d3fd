"""What is compiled for Python, and what for compiled code alone."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

import mpisph
from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import copy_to, jitable, jitted

pytestmark = pytest.mark.skipif(numba.config.DISABLE_JIT, reason="nothing is compiled")


@jitted(**EXACT)
def twice(x):
    return x + x


@jitted(**ENTRY)
def four_times(x):
    return twice(twice(x))


def test_both_python_and_compiled_code_may_call_it():
    assert twice(3) == 6
    assert four_times(3) == 12
    assert twice(0.5) == 1.0
    assert four_times(0.5) == 2.0
    assert np.array_equal(four_times(np.arange(3.0)), [0.0, 4.0, 8.0])


def test_defaults_and_keywords_are_those_of_the_function():
    @jitted(**EXACT)
    def power(x, n=2):
        result = 1.0
        for _ in range(n):
            result *= x
        return result

    @jitted(**EXACT)
    def both(x):
        return power(x), power(x, n=3)

    assert both(2.0) == (4.0, 8.0)
    assert power(2.0) == 4.0
    assert power.__name__ == "power"


@jitted(**EXACT)
def factorial(n):
    return 1 if n < 2 else n * factorial(n - 1)


@jitted(**EXACT)
def choices(n, k):
    return factorial(n) // (factorial(k) * factorial(n - k))


def test_a_function_may_call_itself():
    assert choices(5, 2) == 10
    assert factorial(5) == 120


def test_python_runs_what_is_jitable_as_it_stands():
    def kind(x):
        return "python"

    def compiled(x):
        return x + 1.0

    both = jitable(kind, compiled)

    @jitted(**EXACT)
    def of(x):
        return both(x)

    assert both(1.0) == "python"
    assert of(1.0) == 2.0
    assert both.__name__ == "kind"


MODULE = """
from mpisph.core.jit import EXACT, INLINE
from mpisph.core.jitted import jitted

@jitted(**INLINE)
def checked(x):
    if x > 2.0:
        raise ValueError("beyond two")
    return x

@jitted(**EXACT)
def called(function, x):
    return function(x)

@jitted(**EXACT)
def entry(x):
    return called(checked, x)
"""

CALLS = """
import module
for argument in (1.0, 3.0):
    try:
        print(module.entry(argument))
    except ValueError as error:
        print(error)
stats = module.entry.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()))
functions = module.entry, module.checked, module.called
print(*[len(function.overloads) for function in functions])
print(*[len(function._linked.overloads) for function in functions])
"""


def test_what_compiled_code_calls_gets_no_machine_code_and_can_raise(tmp_path):
    """When compiled and when loaded.

    It is also an argument, by which compiled code is looked up in the cache.
    """
    (tmp_path / "module.py").write_text(MODULE)
    cache = tmp_path / "cache"
    environment = os.environ | {
        "MPISPH_CACHE_DIR": str(cache),
        "NUMBA_DISABLE_JIT": "0",
        "PYTHONPATH": str(Path(mpisph.__file__).parents[1]),
    }
    for from_cache, linked in (("0 1", "0 1 1"), ("1 0", "0 0 0")):
        printed = subprocess.run(
            [sys.executable, "-c", CALLS],
            check=True,
            capture_output=True,
            text=True,
            cwd=tmp_path,
            env=environment,
        ).stdout
        wanted = ["1.0", "beyond two", from_cache, "1 0 0", linked]
        assert printed.splitlines() == wanted
    assert {found.name.split("-")[0] for found in cache.rglob("*.nbc")} == {
        "module.entry"
    }


def test_numbers_are_copied_into_a_part():
    room = np.zeros((2, 3))
    copy_to(np.arange(3.0), room[1])
    assert np.array_equal(room, [[0.0, 0.0, 0.0], [0.0, 1.0, 2.0]])
