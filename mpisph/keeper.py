"""When a run writes a checkpoint, and when it must stop."""

import errno
import time

from mpisph.checkpoint import PARTICLE_BYTES
from mpisph.errors import MpisphError
from mpisph.guard import (
    CHECKPOINT,
    NOTHING,
    STOP_FILE,
    STOP_NAME,
    WALL_TIME,
    Guard,
    is_stop,
    reason,
)
from mpisph.recorder import Recorder
from mpisph.simulation import Simulation
from mpisph.status import StatusFile

POLL = 0.25
"""How often to look for the stop file [s]; on a cluster that asks a server."""

REFRESH = 10.0
"""How often to bring the status up to date [s]."""

MARGIN = 2.0
"""The wall-time limit is met with this many times the longest step and checkpoint."""

SLOW_DISK = 1e8
"""Speed assumed for the first checkpoint [bytes/s]."""

LATENCY = 0.5
"""Time assumed for the first checkpoint besides [s]."""

FULL = {errno.ENOSPC, errno.EDQUOT}


class StopRequested(Exception):  # noqa: N818  it is no error
    """A run that has stopped between two steps, with a checkpoint; `args` say why."""


class Keeper:
    """Decides before each step whether to write a checkpoint or to stop.

    Parameters
    ----------
    sim : Simulation
    recorder : Recorder
    status : StatusFile
    guard : Guard
    """

    def __init__(
        self, sim: Simulation, recorder: Recorder, status: StatusFile, guard: Guard
    ) -> None:
        self._recorder = recorder
        self._status = status
        self._guard = guard
        self._first = sim.step
        self._settings = sim.case.checkpoints
        self._stop_file = recorder.folder / STOP_NAME
        self._saved_at = time.monotonic()
        self._saved_time = sim.time
        self._polled_at = float("-inf")
        self._refreshed_at = time.monotonic()
        self._seen_at: float | None = None
        self._longest_step = 0.0
        size = sim.n_total * PARTICLE_BYTES
        self._longest_checkpoint = LATENCY + size / SLOW_DISK
        self._measured = False

    def wish(self, sim: Simulation) -> int:
        """Return what this rank asks for before the coming step.

        Any rank may have had a signal; rank 0 alone looks at clock and folder.
        """
        if signal := self._guard.signal_wish():
            return signal
        if sim.comm.rank != 0:
            return NOTHING
        now = time.monotonic()
        if self._seen_at is not None:
            self._longest_step = max(self._longest_step, now - self._seen_at)
        self._seen_at = now
        if now - self._polled_at > POLL:
            self._polled_at = now
            if now - self._refreshed_at > REFRESH:
                self._refreshed_at = now
                self._status.refresh(sim.step, sim.time)
            if self._stop_file.exists():
                return STOP_FILE
        margin = MARGIN * (self._longest_step + self._longest_checkpoint)
        if self._guard.time_left() < margin:
            return WALL_TIME
        return CHECKPOINT if self._is_due(now, sim.time) else NOTHING

    def _is_due(self, now: float, time: float) -> bool:
        if now - self._saved_at >= self._settings.wall_interval:
            return True
        interval = self._settings.interval
        return interval is not None and time // interval > self._saved_time // interval

    def heed(self, sim: Simulation, wish: int) -> None:
        """Write a checkpoint where the ranks wish for one; collective.

        Parameters
        ----------
        sim : Simulation
        wish : int
            The largest wish of all ranks.

        Raises
        ------
        StopRequested
            On all ranks, where the run is to stop.
        MpisphError
            On all ranks, where the wall time is too short for any step.
        OSError
            On all ranks, if the checkpoint cannot be written. For want of room a run
            that need not stop goes on, and tries again after the interval.
        """
        if wish == NOTHING:
            return
        if wish == WALL_TIME and sim.step == self._first:
            left = self._guard.time_left()
            needed = MARGIN * self._longest_checkpoint
            raise MpisphError(
                "the wall-time limit leaves no time for a step: "
                f"{left:.1f} s left, a step and a checkpoint may take {needed:.1f} s"
            )
        self._seen_at = None  # the coming step is not to count the checkpoint
        begin = time.monotonic()
        try:
            self._recorder.save_checkpoint(sim)
            self._status.write("running", sim.step, sim.time)
        except OSError as error:
            if is_stop(wish) or error.errno not in FULL:
                raise
            self._recorder.warn(f"no checkpoint at step {sim.step}: {error}")
        self._note_cost(time.monotonic() - begin)
        self._saved_at, self._saved_time = time.monotonic(), sim.time
        if is_stop(wish):
            raise StopRequested(reason(wish))

    def _note_cost(self, cost: float) -> None:
        """Take the measured cost of a checkpoint instead of the assumed one."""
        if not self._measured:
            self._measured, self._longest_checkpoint = True, cost
        self._longest_checkpoint = max(self._longest_checkpoint, cost)
