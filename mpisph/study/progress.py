"""What a study says while it runs: a bar or plain lines, with the time left."""

import threading
import time
from collections.abc import Sequence
from datetime import timedelta
from types import TracebackType
from typing import Any, Self

import numpy.typing as npt
from mpi4py import MPI
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn

NEXT, STOP, COMPLETED, UNSTABLE, FAILED, LEFT, WORK = range(7)
"""The shared numbers: next run, whether to stop, how many ended how, work done."""

N_COUNTERS = 7

LOOK = 0.5
"""How often to look at the numbers [s]."""

INTERVAL = 10.0
"""Between two plain lines [s]."""


class StudyProgress:
    """Shows how far a study is, on rank 0 alone; other ranks do nothing.

    Rank 0 has runs of its own to make: a thread looks at the shared numbers, which lie
    in this rank's memory.

    Parameters
    ----------
    comm : MPI.Intracomm
    console : rich.console.Console
    numbers : ndarray of int64, shape (N_COUNTERS,)
        The shared numbers, on rank 0.
    works : sequence of int
        What each run to be made costs, relative to the others.
    groups : int
        Number of runs at work at a time.
    """

    def __init__(
        self,
        comm: MPI.Intracomm,
        console: Console,
        numbers: npt.NDArray[Any],
        works: Sequence[int],
        groups: int,
    ) -> None:
        self._active = comm.rank == 0 and len(works) > 0
        self._console = console
        self._numbers = numbers
        self._runs = len(works)
        self._work = sum(works)
        self._groups = groups
        self._begin = time.monotonic()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._look, daemon=True)
        self._bar: Progress | None = None

    def __enter__(self) -> Self:
        """Start to look."""
        if self._active:
            if self._console.is_terminal:
                self._bar = Progress(
                    BarColumn(bar_width=24),
                    TaskProgressColumn(),
                    TextColumn("{task.description}", markup=False),
                    console=self._console,
                )
                self._bar.add_task(self._describe(), total=self._work)
                self._bar.start()
            self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Say how it ended."""
        if self._active:
            self._over.set()
            self._thread.join()
            self._show()
            if self._bar is not None:
                self._bar.stop()
            else:
                self._print()

    def _look(self) -> None:
        said = time.monotonic()
        while not self._over.wait(LOOK):
            self._show()
            if self._bar is None and time.monotonic() - said >= INTERVAL:
                said = time.monotonic()
                self._print()

    def _show(self) -> None:
        if self._bar is not None:
            done = int(self._numbers[WORK])
            text = self._describe()
            self._bar.update(self._bar.task_ids[0], completed=done, description=text)

    def _print(self) -> None:
        self._console.print(
            self._describe(), markup=False, highlight=False, soft_wrap=True
        )

    def _describe(self) -> str:
        n = self._numbers
        ended = int(n[COMPLETED] + n[UNSTABLE] + n[FAILED] + n[LEFT])
        at_work = max(min(int(n[NEXT]), self._runs) - ended, 0)
        text = (
            f"{ended} of {self._runs} runs: {n[COMPLETED]} completed, "
            f"{n[UNSTABLE]} unstable, {n[FAILED]} failed"
        )
        if n[LEFT]:
            text += f", {n[LEFT]} left"
        if at_work:
            text += f"; {min(at_work, self._groups)} at work, {self._remaining()} left"
        return text

    def _remaining(self) -> str:
        """Return the time left at the mean speed so far."""
        done = int(self._numbers[WORK])
        if done == 0:
            return "? time"
        spent = time.monotonic() - self._begin
        return str(timedelta(seconds=round(spent * (self._work - done) / done)))
