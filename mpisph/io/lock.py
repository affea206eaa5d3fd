"""The lock on a run's folder, which keeps a second run out of it.

Every rank holds a shared lock on the file ``.lock`` as long as it lives; whatever ends
the process, the system then lets go of it. A run that starts asks for the file alone
first.
"""

import fcntl
import os
import time
from pathlib import Path
from types import TracebackType
from typing import Self

from mpi4py import MPI

from mpisph.core.errors import MpisphError
from mpisph.parallel.collectives import caught, on_root, raise_together

LOCK_FILE = ".lock"

PATIENCE = 3.0
"""How long to wait for the ranks of a run that was just killed to end [s]."""

GLANCE = 0.05
"""How long to wait for those that only look whether the folder is in use [s]."""


class FolderLock:
    """Context in which a folder belongs to the ranks of a communicator.

    Parameters
    ----------
    comm : MPI.Intracomm
        Entering is collective over it.
    folder : Path
        It must exist.

    Raises
    ------
    MpisphError
        On all ranks, on entering a folder in which another run is at work.
    OSError
        On all ranks, if the lock file cannot be written.
    """

    def __init__(self, comm: MPI.Intracomm, folder: Path) -> None:
        self._comm = comm
        self._folder = folder
        self._file: int | None = None

    def __enter__(self) -> Self:
        """Take the folder, and wait a moment for the last run in it to end."""
        try:
            on_root(self._comm, self._take)
            raise_together(self._comm, caught(self._join))
        except BaseException:
            self._release()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Let go of the folder."""
        self._release()

    def _take(self) -> None:
        """Make sure that nobody is here; call it on rank 0."""
        self._file = os.open(self._folder / LOCK_FILE, os.O_RDWR | os.O_CREAT, 0o666)
        if _locked(self._file, fcntl.LOCK_EX, PATIENCE) is False:
            who = os.pread(self._file, 200, 0).decode("utf-8", "replace").strip()
            raise MpisphError(f"{self._folder}: another run is at work here, {who}")
        os.ftruncate(self._file, 0)
        name = os.uname().nodename
        os.pwrite(self._file, f"process {os.getpid()} on {name}\n".encode(), 0)
        self._share()

    def _join(self) -> None:
        """Share the lock, which now keeps others out until the last rank has ended."""
        if self._file is None:
            self._file = os.open(self._folder / LOCK_FILE, os.O_RDWR)
            self._share()

    def _share(self) -> None:
        """Hold the lock together with the other ranks."""
        if self._file is None or _locked(self._file, fcntl.LOCK_SH, GLANCE) is False:
            raise MpisphError(f"{self._folder}: another run has begun here")

    def _release(self) -> None:
        if self._file is not None:
            os.close(self._file)
            self._file = None


def in_use(folder: Path) -> bool | None:
    """Say whether a run is at work in a folder; None where that cannot be known."""
    try:
        file = os.open(folder / LOCK_FILE, os.O_RDONLY)
    except FileNotFoundError:
        return False
    except OSError:
        return None
    try:
        free = _locked(file, fcntl.LOCK_EX, GLANCE)
        return None if free is None else not free
    finally:
        os.close(file)


def _locked(file: int, kind: int, patience: float) -> bool | None:
    """Lock an open file and say whether that was possible; None without locks.

    Who asks `in_use` has the file alone for a moment: one refusal says nothing.
    """
    end = time.monotonic() + patience
    while True:
        try:
            fcntl.flock(file, kind | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > end:
                return False
            time.sleep(0.005)
        except OSError:  # a file system that has none, or none for readers
            return None
        else:
            return True
