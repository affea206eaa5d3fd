"""What a run says while it runs: a bar or plain lines."""

import time as wall_clock
from collections.abc import Callable
from contextlib import suppress
from datetime import timedelta
from types import TracebackType
from typing import NamedTuple, Self

from mpi4py import MPI
from rich.console import Console
from rich.progress import BarColumn, TaskProgressColumn, TextColumn
from rich.progress import Progress as RichProgress

from mpisph.core.console import open_console
from mpisph.io.run_log import RunLog


class _State(NamedTuple):
    """How far the run is, and when that was."""

    time: float
    step: int
    dt: float
    clock: float


class Progress:
    """Shows how far a run is, on rank 0 alone; other ranks do nothing.

    On a terminal there is a bar, otherwise a plain line every few seconds.

    Parameters
    ----------
    comm : MPI.Intracomm
    end_time : float
        Time at which the run ends [s].
    console : rich.console.Console, optional
        By default the standard error.
    log : RunLog, optional
        Takes the plain lines too, whether or not there is a bar.
    interval : float, optional
        Between two plain lines [s].
    clock : callable, optional
        Returns the time of the wall clock [s].
    """

    def __init__(
        self,
        comm: MPI.Intracomm,
        end_time: float,
        console: Console | None = None,
        *,
        log: RunLog | None = None,
        interval: float = 5.0,
        clock: Callable[[], float] = wall_clock.monotonic,
    ) -> None:
        self._active = comm.rank == 0
        self._end_time = end_time
        self._console = open_console(stderr=True) if console is None else console
        self._log = log
        self._interval = interval
        self._clock = clock
        self._first: _State | None = None
        self._last: _State | None = None
        self._said: _State | None = None
        self._bar: RichProgress | None = None

    def __enter__(self) -> Self:
        """Start the bar where there is one."""
        if self._active and self._console.is_terminal:
            self._bar = RichProgress(
                BarColumn(bar_width=24),
                TaskProgressColumn(),
                TextColumn("{task.description}", markup=False),
                console=self._console,
            )
            self._bar.add_task("", total=self._end_time)
            self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Say how far the run came and remove the bar."""
        if self._bar is not None:
            self._bar.stop()
        if self._last is not None and self._last is not self._said:
            with suppress(OSError):  # of the log; an error of the block counts
                self._say(self._last)
        self._bar = None

    def update(self, time: float, step: int, dt: float) -> None:
        """Show a step, if it is time to; cheap enough for every one.

        Parameters
        ----------
        time : float
            Time reached [s].
        step : int
            Steps made.
        dt : float
            Length of the last step [s].
        """
        if not self._active:
            return
        state = _State(time, step, dt, self._clock())
        self._last = state
        self._first = self._first or state
        if self._bar is not None:
            text = self._describe(state)
            self._bar.update(self._bar.task_ids[0], completed=time, description=text)
        said = self._said or self._first
        if state.clock - said.clock >= self._interval:
            self._say(state)

    def tell(self, text: str) -> None:
        """Write a line to the console and, if it can be, to the log."""
        if self._active:
            _print_plain(self._console, text)
        if self._log is not None:
            with suppress(OSError):
                self._log.say(text)

    def _say(self, state: _State) -> None:
        """Write a plain line to the console, unless it has a bar, and to the log."""
        self._said = state
        line = f"{state.time / self._end_time:6.1%}  {self._describe(state)}"
        if self._bar is None:
            _print_plain(self._console, line)
        if self._log is not None:
            self._log.say(line)

    def _describe(self, state: _State) -> str:
        return (
            f"t = {state.time * 1e6:.3f} of {self._end_time * 1e6:.3f} µs, "
            f"step {state.step}, dt = {state.dt * 1e9:.3g} ns, "
            f"{self._remaining(state)} left"
        )

    def _remaining(self, state: _State) -> str:
        """Return the time left at the mean speed so far."""
        first = self._first or state
        done = state.time - first.time
        if done <= 0.0:
            return "?"
        left = (self._end_time - state.time) * (state.clock - first.clock) / done
        return str(timedelta(seconds=round(max(left, 0.0))))


def _print_plain(console: Console, text: str) -> None:
    """Print in one write, without colours: ranks' writes would tear otherwise."""
    console.print(text, markup=False, highlight=False, soft_wrap=True)
