"""Starting programs under mpirun from a test."""

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

TOP = Path(__file__).parents[1]
CASES = TOP / "cases"
MPISPH = str(Path(sys.executable).with_name("mpisph"))

# How long mpirun, where a rank ends with an error, lets the others live; by default
# twice a second. Only who speaks after that needs it.
PATIENCE = "OMPI_MCA_odls_base_sigkill_timeout"

# What a Python that has imported MPI leaves in its environment stops another mpirun.
LEFTOVERS = ("OMPI_", "PMIX_", "ORTE_")
SETTINGS = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
    "OMPI_MCA_mpi_yield_when_idle": "1",
    "OMPI_MCA_hwloc_base_binding_policy": "none",
    PATIENCE: "0",
}


def environment(**more):
    """The environment for a program that starts MPI, or for mpirun itself.

    A PYTHONPATH goes before the one there is.
    """
    kept = {k: v for k, v in os.environ.items() if not k.startswith(LEFTOVERS)}
    if "PYTHONPATH" in more and "PYTHONPATH" in kept:
        more["PYTHONPATH"] += os.pathsep + kept["PYTHONPATH"]
    return {**kept, **SETTINGS, **more}


def launch(ranks, *command, timeout=120, **more):
    """Run a command on some ranks and return the completed process."""
    return subprocess.run(
        ["mpirun", "--quiet", "-n", str(ranks), *map(str, command)],
        env=environment(**more),
        capture_output=True,
        text=True,
        timeout=timeout,
        check=False,
    )


def call(*arguments):
    """Run mpisph in this process, as one rank, and return what `launch` would.

    A launch takes over a second, most of it for imports.
    """
    from mpisph.cli.main import _run
    from mpisph.run.signals import SignalHandler

    out, err = io.StringIO(), io.StringIO()
    words = ["mpisph", *map(str, arguments)]
    with (
        patch.object(sys, "argv", words),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        code = _run(SignalHandler(), first=True)
    return subprocess.CompletedProcess(words, code, out.getvalue(), err.getvalue())
