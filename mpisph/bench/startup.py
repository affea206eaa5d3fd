"""How long ``mpisph run`` takes from its launch to the end of its first step."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from mpisph.bench.record import Spread, StartUp
from mpisph.core.errors import MpisphError
from mpisph.io.result import RESULT_FILE, read_result

SMALL = ("resolution.npr=6", "time.end=20 ns", "output.figures=false")
"""Overrides that make a case small."""

_LAUNCHER = ("OMPI_", "ORTE_", "PMIX_", "PMI_", "HYDRA_", "MPIEXEC_")
_KEPT = (
    "OMPI_ALLOW_RUN_AS_ROOT",
    "OMPI_MCA_rmaps_",
    "OMPI_MCA_hwloc_",
    "OMPI_MCA_mpi_",
    "OMPI_MCA_pml",
    "OMPI_MCA_btl",
)


def measure_start_up(case_file: Path, ranks: int, repeats: int) -> StartUp:
    """Launch a small run again and again; call it on one rank.

    Parameters
    ----------
    case_file : Path
    ranks : int
        Under ``mpirun``, where more than one.
    repeats : int
        Starts with compiled code; there is one without.

    Raises
    ------
    MpisphError
        If a run fails.
    OSError
        If no run can be launched, or no folder made.
    """
    with tempfile.TemporaryDirectory() as folder, on_all_cores():
        cache = Path(folder) / "cache"
        launches = [
            _launch(case_file, ranks, Path(folder) / "run", cache)
            for _ in range(1 + repeats)
        ]
    return StartUp(ranks=ranks, cold=launches[0], warm=Spread.of(launches[1:]))


@contextmanager
def on_all_cores() -> Iterator[None]:
    """Let what is launched inside the block use all cores, not only this rank's."""
    if not hasattr(os, "sched_setaffinity"):  # not every system binds processes
        yield
        return
    bound = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(os.cpu_count() or 1))
    try:
        yield
    finally:
        os.sched_setaffinity(0, bound)


def _launch(case_file: Path, ranks: int, folder: Path, cache: Path) -> float:
    """Return the time from a launch to the end of the first step [s]."""
    command = [sys.executable, "-m", "mpisph", "run", str(case_file)]
    for override in SMALL:
        command += ["--set", override]
    command += ["-o", str(folder), "--force"]
    if ranks > 1:
        command = [mpirun(), "-n", str(ranks), *command]
    begin = time.time()
    done = launched(command, MPISPH_CACHE_DIR=str(cache))
    if done.returncode != 0:
        raise MpisphError(f"a run to time its start failed:\n{done.stderr.strip()}")
    first_step = read_result(folder / RESULT_FILE).timing.first_step
    assert first_step is not None, "a run that completed has made a step"
    return first_step - begin


def mpirun() -> str:
    """Return the program that starts others on several ranks.

    Raises
    ------
    MpisphError
        If there is none.
    """
    for name in ("mpirun", "mpiexec"):
        if found := shutil.which(name):
            return found
    raise MpisphError("neither mpirun nor mpiexec is on the PATH")


def launched(command: Sequence[str], **more: str) -> "subprocess.CompletedProcess[str]":
    """Run a program to its end, with `more` in its environment; return what it wrote.

    It reads nothing, and may be a launcher below a rank; whether it failed is for the
    caller to see.
    """
    return subprocess.run(
        command,
        env={**launch_environment(), **more},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )


def launch_environment() -> dict[str, str]:
    """Return the environment without what this process's own launcher left in it.

    A launcher below a rank would otherwise take itself for one of the ranks, and fail.
    """
    return {
        name: value
        for name, value in os.environ.items()
        if name.startswith(_KEPT) or not name.startswith(_LAUNCHER)
    }
