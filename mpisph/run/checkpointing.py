"""When a run writes a checkpoint, and when it must stop."""

import errno
import time

from mpisph.core.errors import CollectiveError
from mpisph.io.checkpoint import PARTICLE_BYTES
from mpisph.io.status import StatusFile
from mpisph.run.output import RunOutput
from mpisph.run.signals import (
    STOP_FILE,
    SignalHandler,
    StopRequest,
    is_stop,
    reason,
)
from mpisph.solver.state import Simulation

POLL = 0.25
"""How often to look for the stop file [s]; on a cluster that asks a server."""

REFRESH = 10.0
"""How often to write step and time into the status [s]."""

MARGIN = 2.0
"""A run stops when less than this many longest steps and checkpoints is left."""

SLOW_DISK = 1e8
"""Speed assumed for the first checkpoint [bytes/s]."""

LATENCY = 0.5
"""Time assumed for the first checkpoint besides [s]."""

FULL = {errno.ENOSPC, errno.EDQUOT}
"""Errors of a disk without room."""


class StopRequested(Exception):  # noqa: N818  it is no error
    """Raised between two steps of a run that is to be resumed later; says why."""


class CheckpointPolicy:
    """Decides before each step whether to write a checkpoint or to stop.

    Parameters
    ----------
    sim : Simulation
    output : RunOutput
    status : StatusFile
    signals : SignalHandler
    """

    def __init__(
        self,
        sim: Simulation,
        output: RunOutput,
        status: StatusFile,
        signals: SignalHandler,
    ) -> None:
        self._output = output
        self._status = status
        self._signals = signals
        self._first = self._saved_step = sim.step
        self._settings = sim.case.checkpoints
        self._stop_file = output.folder / STOP_FILE
        self._saved_at = time.monotonic()
        self._saved_time = sim.time
        self._polled_at = float("-inf")
        self._refreshed_at = time.monotonic()
        self._seen_at: float | None = None
        self._longest_step = 0.0
        size = sim.n_total * PARTICLE_BYTES
        self._longest_checkpoint = LATENCY + size / SLOW_DISK
        self._measured = False

    def request(self, sim: Simulation) -> int:
        """Return what this rank asks for before the coming step, a `StopRequest`.

        Any rank may have had a signal; rank 0 alone looks at clock and folder.
        """
        if signal := self._signals.signal_request():
            return signal
        if sim.comm.rank != 0:
            return StopRequest.NOTHING
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
                return StopRequest.STOP_FILE
        margin = MARGIN * (self._longest_step + self._longest_checkpoint)
        if self._signals.time_left() < margin:
            return StopRequest.WALL_TIME
        due = self._is_due(now, sim.time)
        return StopRequest.CHECKPOINT if due else StopRequest.NOTHING

    def _is_due(self, now: float, time: float) -> bool:
        if now - self._saved_at >= self._settings.wall_interval:
            return True
        interval = self._settings.interval
        return interval is not None and time // interval > self._saved_time // interval

    def carry_out(self, sim: Simulation, request: int) -> None:
        """Write a checkpoint, or write one and stop, where that is asked; collective.

        Parameters
        ----------
        sim : Simulation
        request : int
            The largest request of all ranks.

        Raises
        ------
        StopRequested
            On all ranks, where the run is to stop.
        OSError
            On all ranks, if the checkpoint cannot be written. Where the disk is full, a
            run that need not stop continues, and tries again after the interval.
        """
        if request == StopRequest.NOTHING:
            return
        # Before the first step there is nothing to save: the folder holds it all.
        if sim.step > self._first:
            self._save(sim, tolerated=set() if is_stop(request) else FULL)
        if is_stop(request):
            before = ", before any step" if sim.step == self._first else ""
            raise StopRequested(f"{reason(request)}{before}")

    def save_end(self, sim: Simulation) -> None:
        """Write the checkpoint from which a run that has ended can be extended.

        The run has ended well without it.
        """
        if sim.step > self._saved_step:
            self._save(sim, tolerated=None)

    def _save(self, sim: Simulation, tolerated: set[int] | None) -> None:
        """Write a checkpoint; errors of these numbers, or all, are only warned of."""
        self._seen_at = None  # the coming step is not to count the checkpoint
        begin = time.monotonic()
        try:
            self._output.save_checkpoint(sim)
        except CollectiveError as error:
            if tolerated is not None and error.errno not in tolerated:
                raise
            self._output.warn(f"no checkpoint at step {sim.step}: {error}")
        else:
            self._saved_step = sim.step
            self._update_cost(time.monotonic() - begin)
            if sim.comm.rank == 0:
                self._status.refresh(sim.step, sim.time)
        self._saved_at, self._saved_time = time.monotonic(), sim.time

    def _update_cost(self, cost: float) -> None:
        """Take the measured cost of a checkpoint instead of the assumed one."""
        if not self._measured:
            self._measured, self._longest_checkpoint = True, cost
        self._longest_checkpoint = max(self._longest_checkpoint, cost)
