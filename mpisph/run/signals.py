"""What ends a run before its time: signals, limits, and ranks that die.

A run that is told to stop does so between two steps, on all ranks at the same one. A
rank that meets an error nobody foresaw, or that is killed, ends the others: they would
wait for it for ever.
"""

import os
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import IntEnum
from pathlib import Path
from types import FrameType
from typing import NoReturn

from mpi4py import MPI

from mpisph.core.errors import os_error_text
from mpisph.io.status import read_status

STOP_FILE = "stop"
"""Name of the file in a run's folder that keeps the run from going on."""


class StopRequest(IntEnum):
    """What a rank asks for before a step; the largest stop_request of all ranks counts.

    A signal's stop_request is `SIGNAL` and its number.
    """

    NOTHING = 0
    CHECKPOINT = 1
    STOP_FILE = 2
    WALL_TIME = 3
    SIGNAL = 100


SIGNALS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)
"""Signals that ask a run to stop."""

TURN = 0.3
"""How long a rank waits for each lower one to speak first [s]."""


def is_stop(stop_request: int) -> bool:
    """Say whether a stop_request is one to stop."""
    return stop_request > StopRequest.CHECKPOINT


def reason(stop_request: int) -> str:
    """Return why a run stops, for people."""
    if stop_request == StopRequest.STOP_FILE:
        return f"file {STOP_FILE}"
    if stop_request == StopRequest.WALL_TIME:
        return "wall-time limit"
    return f"signal {signal.Signals(stop_request - StopRequest.SIGNAL).name}"


class SignalHandler:
    """Watches what may end this process's run before its time.

    Attributes
    ----------
    folder : Path or None
        Folder of the run at work.
    """

    def __init__(self) -> None:
        self.folder: Path | None = None
        self._deadline: float | None = None
        self._signal: int | None = None
        self._fail: Callable[[str], None] = lambda _: None

    def limit(self, walltime: float) -> None:
        """Set the time that this process may take, counted from its start [s]."""
        self._deadline = time.monotonic() - process_age() + walltime

    def time_left(self) -> float:
        """Return how much of the wall time is left [s]."""
        if self._deadline is None:
            return float("inf")
        return self._deadline - time.monotonic()

    def signal_request(self) -> int:
        """Return the request to stop that a signal has brought, or that for nothing."""
        return (
            StopRequest.NOTHING
            if self._signal is None
            else StopRequest.SIGNAL + self._signal
        )

    @contextmanager
    def heeding_signals(self, comm: MPI.Intracomm) -> Iterator[None]:
        """Return a context in which signals ask the run to stop; for the main thread.

        A launcher that has lost a rank sends the others SIGTERM. They may be waiting
        for the dead one inside MPI, where no handler of Python's runs: a thread of
        their own then looks at the others, and says which has died.

        Parameters
        ----------
        comm : MPI.Intracomm
            Ranks to watch; entering is collective over it.
        """
        before = {number: signal.signal(number, self._note) for number in SIGNALS}
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        wakeup = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
        peers = comm.allgather((os.uname().nodename, os.getpid()))
        watch = threading.Thread(
            target=self._watch, args=(reading, peers, comm.rank), daemon=True
        )
        watch.start()
        try:
            yield
        finally:
            signal.set_wakeup_fd(wakeup)
            os.close(writing)  # ends the thread
            watch.join()
            os.close(reading)
            for number, handler in before.items():
                signal.signal(number, handler)

    @contextmanager
    def working_in(self, folder: Path, fail: Callable[[str], None]) -> Iterator[None]:
        """Return a context in which a run is at work in a folder.

        An error that leaves it may yet be taken down there, by `end_all_ranks`.

        Parameters
        ----------
        folder : Path
        fail : callable
            Takes down in the folder why the run has failed; any rank may call it.
        """
        self.folder, self._fail = folder, fail
        yield
        self.folder, self._fail = None, lambda _: None

    def end_all_ranks(
        self, kind: type[BaseException], error: BaseException, trace: object
    ) -> NoReturn:
        """Say what this rank met and end every rank; an excepthook."""
        rank = MPI.COMM_WORLD.rank
        time.sleep(TURN * min(rank, 8))  # the same may have met all: the first speaks
        if not self._has_failed():
            text = f"rank {rank} of {MPI.COMM_WORLD.size}: {self.described(error)}"
            self._fail(text)
            sys.stderr.write(f"mpisph: {text}\n")
            sys.stderr.flush()
        MPI.COMM_WORLD.Abort(1)
        os._exit(1)

    def described(self, error: BaseException) -> str:
        """Return an error for people; the trace of an unforeseen one goes to a file.

        Parameters
        ----------
        error : BaseException
        """
        if isinstance(error, MemoryError):
            return "out of memory"
        if isinstance(error, KeyboardInterrupt):
            return "interrupted"
        if isinstance(error, OSError):
            return os_error_text(error)
        text = f"{type(error).__name__}: {error}"
        trace = "".join(traceback.format_exception(error))
        for folder in (self.folder, None):
            with suppress(OSError):
                path = _kept(trace, folder)
                return f"{text}\nThis is a fault of the program; details in {path}"
        return f"{text}\n{trace}"

    def _note(self, number: int, _: FrameType | None) -> None:
        """Take note of a signal."""
        self._signal = number
        if number == signal.SIGINT:  # a second one ends the process at once
            signal.signal(signal.SIGINT, signal.SIG_DFL)

    def _watch(self, pipe: int, peers: list[tuple[str, int]], rank: int) -> None:
        """Wait for SIGTERM; then end this process if another has died."""
        while numbers := os.read(pipe, 64):
            if signal.SIGTERM not in numbers:
                continue
            here = [k for k, (host, _) in enumerate(peers) if host == peers[rank][0]]
            dead = [k for k in here if not is_alive(peers[k][1])]
            if dead:
                self._end_after(dead[0], peers, first=rank == min(set(here) - {*dead}))

    def _end_after(self, dead: int, peers: list[tuple[str, int]], first: bool) -> None:
        """End this process because another rank has died; one rank says so."""
        host, pid = peers[dead]
        text = f"rank {dead} of {len(peers)} has died (process {pid} on {host})"
        if first and not self._has_failed():
            self._fail(text)
            sys.stderr.write(f"mpisph: {text}; the other ranks end\n")
            sys.stderr.flush()
        time.sleep(TURN)
        os._exit(1)

    def _has_failed(self) -> bool:
        """Say whether another rank has taken down why the run fails."""
        with suppress(Exception):
            status = None if self.folder is None else read_status(self.folder)
            return status is not None and status.state == "failed"
        return False


def _kept(trace: str, folder: Path | None) -> str:
    """Write a trace into a file of its own and return its name."""
    prefix = f"mpisph-traceback-rank{MPI.COMM_WORLD.rank}-"
    descriptor, path = tempfile.mkstemp(".txt", prefix, folder)
    with open(descriptor, "w", encoding="utf-8") as file:
        file.write(trace)
    return path


def is_alive(pid: int) -> bool:
    """Say whether a process of this machine lives; a zombie does not."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text()
    except OSError:
        return False
    return text.rpartition(")")[2].split()[0] not in {"Z", "X"}


def process_age() -> float:
    """Return how long ago this process was started [s]; 0 where that is unknown."""
    try:
        fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
        ticks = int(fields[19])
        now = time.clock_gettime(time.CLOCK_BOOTTIME)
    except (OSError, AttributeError, IndexError, ValueError):
        return 0.0
    return max(now - ticks / os.sysconf("SC_CLK_TCK"), 0.0)
