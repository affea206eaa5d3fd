"""What produced a result: versions of the software and the revision of the source."""

import platform
import subprocess
from pathlib import Path

import h5py
import numba
import numpy as np
from mpi4py import MPI
from mpi4py import __version__ as mpi4py_version

from mpisph import __version__
from mpisph.core.launcher import library_name

UNKNOWN = "unknown"
"""Revision of sources that are not in a checkout."""

_PACKAGE = Path(__file__).resolve().parents[1]


def versions() -> dict[str, str]:
    """Return the versions of everything that a result may depend on."""
    return {
        "mpisph": __version__,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "numba": numba.__version__,
        "h5py": h5py.__version__,
        "hdf5": h5py.version.hdf5_version,
        "mpi4py": mpi4py_version,
        "mpi": library_name(MPI.Get_library_version()),
    }


def cpu_model() -> str:
    """Return the model of the processor, as far as the system tells."""
    try:
        text = Path("/proc/cpuinfo").read_text(encoding="utf-8")
    except OSError:
        text = ""
    for line in text.splitlines():
        key, _, value = line.partition(":")
        if key.strip() == "model name":
            return value.strip()
    return platform.processor() or platform.machine() or UNKNOWN


def git_revision(folder: Path = _PACKAGE) -> str:
    """Return the revision of the sources in a folder.

    Parameters
    ----------
    folder : Path, optional
        By default that of this package.

    Returns
    -------
    str
        The full hash of the commit, with ``-dirty`` where a tracked file
        differs from it; ``unknown`` outside of a checkout, and where git does
        not track the sources, as in an environment below someone's checkout.
    """
    try:
        _git(folder, "ls-files", "--error-unmatch", "__init__.py")
        revision = _git(folder, "rev-parse", "HEAD")
        changes = _git(folder, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return UNKNOWN
    return f"{revision}-dirty" if changes else revision


def _git(folder: Path, *arguments: str) -> str:
    return subprocess.run(
        ["git", "-C", str(folder), *arguments],
        check=True,
        capture_output=True,
        text=True,
        timeout=10,
    ).stdout.strip()
