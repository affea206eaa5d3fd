"""How a run stands, for all who ask: its status, and whether anybody is at work."""

from pathlib import Path
from typing import Literal, NamedTuple

from mpisph.io.lock import in_use
from mpisph.io.run_folder import known_status
from mpisph.io.status import FINAL, State, Status


class Standing(NamedTuple):
    """How a run stands.

    Attributes
    ----------
    state : str
        That of the status; ``running`` where somebody is at work, ``killed`` where the
        status alone says so, and ``to do`` where there is no run.
    reason : str
        Why it ended before its time; empty where it did not.
    status : Status or None
        What the run has written of itself.
    """

    state: State | Literal["killed", "to do"]
    reason: str
    status: Status | None


def standing(folder: Path) -> Standing:
    """Say how the run in a folder stands.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    status = known_status(folder)
    if status is not None and status.state in FINAL:
        return Standing(status.state, status.reason or "", status)
    if in_use(folder):
        return Standing("running", "", status)
    status = known_status(folder)  # it may have ended between the two looks
    if status is None:
        return Standing("to do", "", None)
    if status.state == "running":
        return Standing("killed", "", status)
    return Standing(status.state, status.reason or "", status)
