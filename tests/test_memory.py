"""Freed memory is kept: a step takes its arrays without new pages from the system."""

import subprocess
import sys

import pytest
from launch import environment

PAGE_FAULTS = """
import ctypes, resource, sys
import numpy as np
from mpisph.memory import keep_freed_memory
if not hasattr(ctypes.CDLL(None), "mallopt"):
    sys.exit("no mallopt")
if sys.argv[1] == "keep":
    keep_freed_memory()
def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
def step():
    arrays = [np.ones(size, np.uint8) for size in 8 * [1_700_000]]
    del arrays
for _ in range(3):
    step()
before = faults()
for _ in range(100):
    step()
print(faults() - before)
"""


def page_faults(how):
    done = subprocess.run(
        [sys.executable, "-c", PAGE_FAULTS, how],
        env=environment(),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    if "no mallopt" in done.stderr:
        pytest.skip("the C library is not glibc")
    assert done.returncode == 0, done.stderr
    return int(done.stdout)


def test_memory_taken_again_brings_no_page_faults():
    assert page_faults("keep") < 100 < page_faults("default")
