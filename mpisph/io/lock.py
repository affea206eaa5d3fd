"""The lock on a run's folder, which keeps a second run out of it.

Every rank holds a shared lock on the file ``.lock`` as long as it lives; whatever ends
the process, the system then lets go of it. A run that starts asks for the file alone
first. The locks are those of open file descriptions (``man 2 fcntl``): who only looks
whether the folder is in use can ask about them without taking one.

Some file systems have no locks, or none for those who may only read. So rank 0 also
touches the file every `BEAT` seconds, from a thread: a step, a checkpoint or compiling
may take as long as it likes. Where no lock tells, a file that was touched less than
`SILENCE` ago is in use, and one that is empty is not.
"""

import errno
import fcntl
import os
import struct
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from mpi4py import MPI

from mpisph.core.errors import MpisphError
from mpisph.parallel.collectives import caught, on_root, raise_together

LOCK_FILE = ".lock"

PATIENCE = 3.0
"""How long to wait for the ranks of a run that was just killed to end [s]."""

BEAT = 10.0
"""Between two signs of life [s]."""

SILENCE = 60.0
"""Without a sign of life for so long, a run without locks counts as killed [s].

Six beats. One comes late while compiled code holds the interpreter, at most for a pair
loop: 1.5 s for a million particles on rank 0. Those who only look compare the clocks of
two machines, which may differ by some seconds; a run that starts watches for a beat by
its own clock alone.
"""

LOOK = 0.5
"""Between two looks for a sign of life [s]."""

SETTLE = 1.0
"""How long to wait for one who looked at the same moment to write its name too [s]."""


class InUseError(MpisphError):
    """Another run is at work in the folder; nothing there is ours to write."""


class FolderLock:
    """Context in which a folder belongs to the ranks of a communicator.

    Parameters
    ----------
    comm : MPI.Intracomm
        Entering is collective over it.
    folder : Path
        It must exist.
    say : callable, optional
        Takes a line to print, on rank 0, where entering takes long.

    Raises
    ------
    InUseError
        On all ranks, on entering a folder in which another run is at work.
    OSError
        On all ranks, if the lock file cannot be written.
    """

    def __init__(
        self,
        comm: MPI.Intracomm,
        folder: Path,
        say: Callable[[str], object] = lambda _: None,
    ) -> None:
        self._comm = comm
        self._folder = folder
        self._path = folder / LOCK_FILE
        self._say = say
        self._name = f"process {os.getpid()} on {os.uname().nodename}\n".encode()
        self._file: int | None = None
        self._over = threading.Event()
        self._heart: threading.Thread | None = None

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
        """Make sure that nobody is here, and say who is now; call it on rank 0."""
        self._file = os.open(self._path, os.O_RDWR | os.O_CREAT, 0o666)
        free = _locked(self._file, fcntl.F_WRLCK, PATIENCE)
        if free is False or (free is None and not self._is_silent()):
            who = self._path.read_text(errors="replace").strip() or "about to end"
            raise InUseError(f"{self._folder}: another run is at work here, {who}")
        os.pwrite(self._file, self._name, 0)
        os.ftruncate(self._file, len(self._name))
        if free is None:
            os.fsync(self._file)
            time.sleep(SETTLE)
            if self._path.read_bytes() != self._name:
                raise InUseError(f"{self._folder}: another run has started here")
        _locked(self._file, fcntl.F_RDLCK)
        self._heart = threading.Thread(
            target=self._beat, args=(self._file,), daemon=True
        )
        self._heart.start()

    def _is_silent(self) -> bool:
        """Wait for a sign of life of the last run here; say whether there was none."""
        first = self._last_sign()
        if first[0]:
            self._say(
                f"{self._folder}: a run here has not ended; without locks on this file "
                f"system, it takes {SILENCE:g} s to see whether it lives"
            )
        end = time.monotonic() + SILENCE
        while first[0] and time.monotonic() < end:
            time.sleep(min(LOOK, SILENCE / 4))
            now = self._last_sign()
            if now != first:
                return not now[0]  # empty: it has ended
        return True

    def _last_sign(self) -> tuple[bytes, int]:
        """Return who is here and when it last touched the file [ns]."""
        # Opened each time: only then does a network file system ask its server.
        return self._path.read_bytes(), self._path.stat().st_mtime_ns

    def _beat(self, file: int) -> None:
        """Touch the file as long as this process holds it."""
        while not self._over.wait(BEAT):
            with suppress(OSError):
                os.utime(file)

    def _join(self) -> None:
        """Share the lock, which now keeps others out until the last rank has ended."""
        if self._file is None:
            self._file = os.open(self._path, os.O_RDWR)
            if _locked(self._file, fcntl.F_RDLCK) is False:
                raise InUseError(f"{self._folder}: another run has started here")

    def _release(self) -> None:
        if self._heart is not None:
            self._over.set()
            self._heart.join()
            self._heart = None
            if self._file is not None:
                with suppress(OSError):
                    os.ftruncate(self._file, 0)
        if self._file is not None:
            os.close(self._file)
            self._file = None


def in_use(folder: Path) -> bool:
    """Say whether a run is at work in a folder; it takes no lock."""
    path = folder / LOCK_FILE
    try:
        file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError:  # not ours to read
        return _is_touched(path)
    try:
        kind, *_ = _FLOCK.unpack(_lock_call(file, "F_OFD_GETLK", fcntl.F_WRLCK))
    except OSError:  # a file system without locks
        return _is_touched(path)
    finally:
        os.close(file)
    return bool(kind != fcntl.F_UNLCK)


def _is_touched(path: Path) -> bool:
    """Say whether a lock file was touched lately by somebody who has not ended."""
    try:
        state = path.stat()
    except OSError:
        return False
    return state.st_size > 0 and abs(time.time() - state.st_mtime) < SILENCE


def _locked(file: int, kind: int, patience: float = 0.0) -> bool | None:
    """Lock an open file and say whether that was possible; None without locks."""
    end = time.monotonic() + patience
    while True:
        try:
            _lock_call(file, "F_OFD_SETLK", kind)
        except (BlockingIOError, PermissionError):  # POSIX allows both
            if time.monotonic() >= end:
                return False
            time.sleep(0.005)
        except OSError:
            return None
        else:
            return True


_FLOCK = struct.Struct("hhqqi4x")
# The C structure flock: type, whence, start, length, process.


def _lock_call(file: int, command: str, kind: int) -> bytes:
    """Call fcntl with a lock of the whole file and return the structure it fills in."""
    number = getattr(fcntl, command, None)
    if number is None:
        raise OSError(errno.ENOTSUP, "no locks of open file descriptions")
    return fcntl.fcntl(file, number, _FLOCK.pack(kind, os.SEEK_SET, 0, 0, 0))
