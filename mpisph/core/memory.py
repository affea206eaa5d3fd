"""The memory of this machine, and how this process keeps what it has freed."""

import ctypes
import os
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_M_TRIM_THRESHOLD, _M_TOP_PAD, _M_MMAP_THRESHOLD = -1, -2, -3
_LARGEST_INT = 2**31 - 1
_LARGEST_THRESHOLD = 2**25

CONTROL_GROUPS = Path("/sys/fs/cgroup")
OWN_GROUPS = Path("/proc/self/cgroup")


def total_memory() -> int:
    """Return the memory that this process may use at most [bytes].

    Returns
    -------
    int
        That of the machine, or less where a control group of Linux limits it, as in a
        container or in a batch job.
    """
    machine = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return min([machine, *_group_limits()])


def _group_limits() -> Iterator[int]:
    """Yield the limits of the control groups around this process [bytes]."""
    for file in _limit_files():
        # Where there is no limit, the file is missing or says "max".
        with suppress(OSError, ValueError):
            yield int(file.read_text(encoding="ascii"))


def _limit_files() -> Iterator[Path]:
    """Yield the files of the process's own groups and of those around them."""
    try:
        lines = OWN_GROUPS.read_text(encoding="utf-8").splitlines()
    except OSError:
        return
    for line in lines:
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            top, name = CONTROL_GROUPS, "memory.max"
        elif "memory" in controllers.split(","):
            top, name = CONTROL_GROUPS / "memory", "memory.limit_in_bytes"
        else:
            continue
        own = Path(path.lstrip("/"))
        # Inside a container its own group may be mounted as the topmost.
        yield from (top / group / name for group in (own, *own.parents))


def keep_freed_memory() -> None:
    """Let the C library keep what is freed instead of giving it back to the system.

    Every step takes and frees the same arrays. By default glibc returns the larger ones
    to the system, which hands them out again page by page, zeroed: a fifth of the time
    of a step at 14 000 particles. Elsewhere than with glibc this does nothing.
    """
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is None:
        return
    mallopt(_M_MMAP_THRESHOLD, _LARGEST_THRESHOLD)
    mallopt(_M_TRIM_THRESHOLD, _LARGEST_INT)
    mallopt(_M_TOP_PAD, _LARGEST_THRESHOLD)
