"""The folder of a run: its case, and what an earlier run has left in it."""

from pathlib import Path

from mpisph.case import Case, load_case
from mpisph.core.errors import (
    MpisphError,
)
from mpisph.io.checkpoint import (
    CHECKPOINTS_FOLDER,
    remove_checkpoints,
)
from mpisph.io.history import HISTORY_FILE
from mpisph.io.result import RESULT_FILE
from mpisph.io.snapshot import SERIES_FILE, SNAPSHOTS_FOLDER
from mpisph.io.status import STATUS_FILE

CASE_FILE = "case.toml"


def case_in(folder: Path) -> Case:
    """Return the case of the run in a folder.

    Raises
    ------
    MpisphError
        If there is none.
    """
    if not (folder / CASE_FILE).exists():
        raise MpisphError(f"{folder}: no {CASE_FILE}; is it a run's folder?")
    return load_case(folder / CASE_FILE)


def clear_away(folder: Path) -> None:
    """Remove the files of an earlier run; first what it could be gone on with from."""
    (folder / CASE_FILE).unlink(missing_ok=True)
    remove_checkpoints(folder)
    stale = [
        *(folder / SNAPSHOTS_FOLDER).glob("snapshot_*"),
        *(folder / "figures").glob("cloud_*.png"),
        folder / SERIES_FILE,
        folder / RESULT_FILE,
    ]
    for path in stale:
        path.unlink(missing_ok=True)
    remove_parts(folder)


def remove_parts(folder: Path) -> None:
    """Remove what was left of files when a run was killed."""
    names = (CASE_FILE, HISTORY_FILE, RESULT_FILE, SERIES_FILE, STATUS_FILE)
    parts = [
        *(path for name in names for path in folder.glob(f"{name}.*.part")),
        *(folder / SNAPSHOTS_FOLDER).glob("snapshot_*.part"),
        *(folder / CHECKPOINTS_FOLDER).glob("checkpoint_*.part"),
    ]
    for path in parts:
        path.unlink(missing_ok=True)
