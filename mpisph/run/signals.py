"""What ends a run early: signals, limits, errors of one rank, and ranks that die.

A run that is asked to stop does so between two steps, on all ranks at the same one. A
rank that meets an unforeseen error, or that is killed, ends the others: they would wait
for it for ever.
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
from mpisph.core.held_signals import SIGNALS, held
from mpisph.io.status import read_status

STOP_FILE = "stop"
"""Name of the file that stops the run, or study, in whose folder it lies."""


class StopRequest(IntEnum):
    """What a rank asks for before a step; the largest request of all ranks counts.

    A signal asks for `SIGNAL` plus its number.
    """

    NOTHING = 0
    CHECKPOINT = 1
    STOP_FILE = 2
    WALL_TIME = 3
    SIGNAL = 100


AGAIN = 2.0
"""Ctrl-C ends a process at once where it comes so long after the first [s].

Not sooner: a terminal, or a program such as `timeout`, may send a signal twice.
"""

TURN = 0.3
"""How long a rank waits for each lower one to report first [s]."""


def is_stop(request: int) -> bool:
    """Say whether a request is one to stop."""
    return request > StopRequest.CHECKPOINT


def reason(request: int) -> str:
    """Return in words why a run stops."""
    if request == StopRequest.STOP_FILE:
        return f"file {STOP_FILE}"
    if request == StopRequest.WALL_TIME:
        return "wall-time limit"
    return f"signal {signal.Signals(request - StopRequest.SIGNAL).name}"


class SignalHandler:
    """Catches the signals that stop this process's run, and what ends it on all ranks.

    Attributes
    ----------
    folder : Path or None
        Folder of the present run.
    """

    def __init__(self) -> None:
        self.folder: Path | None = None
        self._deadline: float | None = None
        self._signal: int | None = None
        self._interrupted_at: float | None = None
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
        """Return the request of the first signal, or that for nothing."""
        if self._signal is None:
            return StopRequest.NOTHING
        return StopRequest.SIGNAL + self._signal

    @contextmanager
    def catching_signals(self, comm: MPI.Intracomm) -> Iterator[None]:
        """Return a context in which signals become requests; for the main thread.

        So do those that came before and were held (see `held_signals`).

        A launcher that has lost a rank sends the others SIGTERM. They may be waiting
        for the dead one inside MPI, where no handler of Python's runs: a thread of
        their own then looks at the others, and says which has died.

        Parameters
        ----------
        comm : MPI.Intracomm
            Ranks to watch; entering is collective over it.
        """
        before = {number: signal.signal(number, self._receive) for number in SIGNALS}
        reading, writing = os.pipe()
        os.set_blocking(writing, False)
        wakeup = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
        peers = comm.allgather((os.uname().nodename, os.getpid()))
        watch = threading.Thread(
            target=self._watch, args=(reading, peers, comm.rank), daemon=True
        )
        watch.start()
        while held:
            self._receive(held.pop(0), None)
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
        """Return a context for a run in a folder.

        After an error has left it, `end_all_ranks` still writes there.

        Parameters
        ----------
        folder : Path
        fail : callable
            Writes into the folder why the run has failed; any rank may call it.
        """
        self.folder, self._fail = folder, fail
        yield
        self.folder, self._fail = None, lambda _: None

    def end_all_ranks(
        self, kind: type[BaseException], error: BaseException, trace: object
    ) -> NoReturn:
        """Report the error of this rank and end every rank; an excepthook."""
        rank = MPI.COMM_WORLD.rank
        # All may have met the same: the first reports it.
        time.sleep(TURN * min(rank, 8))
        if not self._has_failed():
            text = f"rank {rank} of {MPI.COMM_WORLD.size}: {self.describe(error)}"
            self._fail(text)
            sys.stderr.write(f"mpisph: {text}\n")
            sys.stderr.flush()
        MPI.COMM_WORLD.Abort(1)
        os._exit(1)

    def describe(self, error: BaseException) -> str:
        """Return an error in words; the trace of an unforeseen one goes to a file.

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
                path = _write_trace(trace, folder)
                return f"{text}\nThis is a fault of the program; details in {path}"
        return f"{text}\n{trace}"

    def _receive(self, number: int, _: FrameType | None) -> None:
        """Remember a signal; a handler. The first says why the run stops."""
        if self._signal is None:
            self._signal = _original(number)

    def _watch(self, pipe: int, peers: list[tuple[str, int]], rank: int) -> None:
        """Wait for signals, also while the main thread waits in MPI.

        A second Ctrl-C ends this process, SIGTERM does if another rank has died.
        """
        while numbers := os.read(pipe, 64):
            if signal.SIGINT in numbers:
                self._note_interrupt(time.monotonic())
            if signal.SIGTERM not in numbers:
                continue
            here = [k for k, (host, _) in enumerate(peers) if host == peers[rank][0]]
            dead = [k for k in here if not is_alive(peers[k][1])]
            if dead:
                self._end_after(dead[0], peers, first=rank == min(set(here) - {*dead}))

    def _note_interrupt(self, now: float) -> None:
        """Say what Ctrl-C does; end this process if it is not the first."""
        if self._interrupted_at is None:
            self._interrupted_at = now
            sys.stderr.write(
                "mpisph: stopping before the next step, with a checkpoint; Ctrl-C "
                f"again, after {AGAIN:g} s, ends the run at once\n"
            )
        elif now - self._interrupted_at >= AGAIN:
            sys.stderr.write("mpisph: interrupted\n")
            os._exit(128 + signal.SIGINT)

    def _end_after(self, dead: int, peers: list[tuple[str, int]], first: bool) -> None:
        """End this process because another rank has died; the first one reports it."""
        host, pid = peers[dead]
        text = f"rank {dead} of {len(peers)} has died (process {pid} on {host})"
        if first and not self._has_failed():
            self._fail(text)
            sys.stderr.write(f"mpisph: {text}; the other ranks end\n")
            sys.stderr.flush()
        time.sleep(TURN)
        os._exit(1)

    def _has_failed(self) -> bool:
        """Say whether another rank has already written why the run failed."""
        with suppress(Exception):
            status = None if self.folder is None else read_status(self.folder)
            return status is not None and status.state == "failed"
        return False


def _original(number: int) -> int:
    """Return the signal that the script which has started the ranks was sent.

    It asks them by SIGUSR1, which launchers pass on, and writes down what for.
    """
    path = os.environ.get("MPISPH_SIGNALS")
    if path and number == signal.SIGUSR1:
        with suppress(OSError, UnicodeError, LookupError):
            return signal.Signals[f"SIG{Path(path).read_text().split()[0]}"]
    return number


def _write_trace(trace: str, folder: Path | None) -> str:
    """Write a trace into a new file and return the file's name."""
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
