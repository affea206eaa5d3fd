"""Memory: how much there is, and that a step takes no new pages from the system."""

import subprocess
import sys

import pytest
from launch import environment

from mpisph.core import memory
from mpisph.core.memory import total_memory

PAGE_FAULTS = """
import ctypes, resource, sys
import numpy as np
from mpisph.core.memory import keep_freed_memory
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


@pytest.fixture
def groups(tmp_path, monkeypatch):
    """Writes files in the place of those of Linux's control groups."""
    monkeypatch.setattr(memory, "CONTROL_GROUPS", tmp_path / "cgroup")
    monkeypatch.setattr(memory, "OWN_GROUPS", tmp_path / "own")

    def write(own, limits):
        (tmp_path / "own").write_text(own)
        for path, limit in limits.items():
            file = tmp_path / "cgroup" / path
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(f"{limit}\n")

    return write


@pytest.mark.usefixtures("groups")
def test_without_control_groups_all_memory_is_there():
    with open("/proc/meminfo", encoding="ascii") as file:
        kilobytes = int(file.readline().split()[1])
    assert total_memory() == pytest.approx(1024 * kilobytes, rel=1e-6)


@pytest.mark.parametrize(
    ("own", "limits", "expected"),
    [
        ("0::/job/step\n", {"job/step/memory.max": 1000}, 1000),
        ("0::/job/step\n", {"job/memory.max": 3000, "memory.max": "max"}, 3000),
        ("0::/job\n", {"job/memory.max": 3000, "memory.max": 2000}, 2000),
        ("0::/elsewhere\n", {"memory.max": 2000}, 2000),
        ("4:cpu,memory:/a\n", {"memory/a/memory.limit_in_bytes": 1000}, 1000),
        ("4:memory:/a\n0::/\n", {"memory/memory.limit_in_bytes": 1000}, 1000),
    ],
)
def test_control_groups_limit_the_memory(groups, own, limits, expected):
    groups(own, limits)
    assert total_memory() == expected


@pytest.mark.parametrize(
    ("own", "limits"),
    [
        ("0::/job\n", {"job/memory.max": "max"}),
        ("0::/job\n", {"other/memory.max": 1000}),
        ("4:cpu:/a\n", {"memory/a/memory.limit_in_bytes": 1000}),
        ("4:memory:/\n", {"memory/memory.limit_in_bytes": 9223372036854771712}),
    ],
)
def test_groups_without_a_limit_take_nothing(groups, own, limits):
    everything = total_memory()
    groups(own, limits)
    assert total_memory() == everything
