"""How a run stands: ``status.json``, the word that counts.

`run_folder.known_status` stands in for a file that is damaged or missing.
"""

import os
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Literal

from mpi4py import MPI
from pydantic import BaseModel, ConfigDict

from mpisph.core.errors import MpisphError
from mpisph.io.files import read_text, write_text
from mpisph.parallel.collectives import on_root

STATUS_FILE = "status.json"

State = Literal["running", "completed", "unstable", "stopped", "failed"]

FINAL: tuple[State, ...] = ("completed", "unstable")
"""States after which there is nothing left to do."""


class Status(BaseModel):
    """How a run stands by its own word; see `standing` for who may have been killed."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    state: State
    """What it does, or how it ended."""
    reason: str | None = None
    """Why it ended before its time."""
    step: int
    """Steps made, as of `updated`."""
    time: float
    """Time reached [s]."""
    end_time: float
    """Time at which the run is to end [s]."""
    starts: int
    """How often it has been started or resumed."""
    ranks: int
    """Number of ranks."""
    host: str
    """Machine of rank 0."""
    pid: int
    """Process of rank 0 on it."""
    started: str
    """When it was last started or resumed."""
    updated: str
    """When this was written."""


class StatusFile:
    """Writes ``status.json`` for a run.

    Parameters
    ----------
    comm : MPI.Intracomm
    folder : Path
        Folder of the run.
    end_time : float
        Time at which the run is to end [s].
    starts : int
        How often it has been started, this start included.
    """

    def __init__(
        self, comm: MPI.Intracomm, folder: Path, end_time: float, starts: int
    ) -> None:
        self._comm = comm
        self._folder = folder
        self._now = Status(
            state="running",
            step=0,
            time=0.0,
            end_time=end_time,
            starts=starts,
            ranks=comm.size,
            host=os.uname().nodename,
            pid=comm.bcast(os.getpid()),
            started=_now(),
            updated=_now(),
        )

    def write(
        self, state: State, step: int, time: float, reason: str | None = None
    ) -> None:
        """Write how the run stands; collective.

        Parameters
        ----------
        state : State
        step : int
        time : float
            [s].
        reason : str, optional

        Raises
        ------
        OSError
            On all ranks, if the file cannot be written.
        """
        changes = {"state": state, "step": step, "time": time, "reason": reason}
        self._now = self._now.model_copy(update=changes)
        on_root(self._comm, self._write)

    def refresh(self, step: int, time: float) -> None:
        """Bring step and time up to date, from one rank, as far as that is possible.

        Parameters
        ----------
        step : int
        time : float
            [s].
        """
        self._now = self._now.model_copy(update={"step": step, "time": time})
        with suppress(OSError):  # a run that can step needs no status for that
            self._write()

    def fail(self, reason: str) -> None:
        """Write that the run has failed, from any one rank, as far as that is possible.

        A run that has ended stays ended, whatever happens to its ranks afterwards.

        Parameters
        ----------
        reason : str
        """
        with suppress(OSError):  # the disk itself may be what failed
            # Rank 0 knows best how far the run has come.
            with suppress(MpisphError):
                self._now = read_status(self._folder) or self._now
            if self._now.state in FINAL:
                return
            changes = {"state": "failed", "reason": reason}
            self._now = self._now.model_copy(update=changes)
            self._write()

    def _write(self) -> None:
        status = self._now.model_copy(update={"updated": _now()})
        write_text(self._folder / STATUS_FILE, status.model_dump_json(indent=2) + "\n")


def read_status(folder: Path) -> Status | None:
    """Return how the run in a folder stands, or None where there is no run.

    Raises
    ------
    MpisphError
        If the file cannot be understood.
    OSError
        If it cannot be read.
    """
    path = folder / STATUS_FILE
    try:
        return Status.model_validate_json(read_text(path))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except ValueError as error:
        raise MpisphError(f"{path}: not the status of a run") from error


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
