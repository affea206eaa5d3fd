"""The folder of a run: its case, and what an earlier run has left in it."""

from pathlib import Path

from mpisph.case import Case, load_case
from mpisph.case.identity import differences
from mpisph.case.model import INITIAL_FILE
from mpisph.core.errors import CaseError, InputError, MpisphError, Problem
from mpisph.io.checkpoint import CHECKPOINTS_FOLDER, remove_checkpoints
from mpisph.io.history import HISTORY_FILE
from mpisph.io.result import RESULT_FILE
from mpisph.io.snapshot import SERIES_FILE, SNAPSHOTS_FOLDER
from mpisph.io.status import FINAL, STATUS_FILE, Status, read_status

CASE_FILE = "case.toml"

SHOWN_DIFFERENCES = 5
"""How many differences between two cases are named."""


def case_in(folder: Path) -> Case:
    """Return the case of the run in a folder.

    Raises
    ------
    MpisphError
        If there is none.
    """
    if not (folder / CASE_FILE).exists():
        raise InputError(f"{folder}: no {CASE_FILE}; is it a run's folder?")
    return load_case(folder / CASE_FILE)


def status_of_case(case: Case, folder: Path) -> Status | None:
    """Return the status of the run in a folder; None where there is none.

    Raises
    ------
    CaseError
        If it is a run of another case.
    MpisphError
        If the folder holds files of a run but no status.
    """
    status = read_status(folder)
    if status is None:
        found = [n for n in (CASE_FILE, RESULT_FILE) if (folder / n).exists()]
        if found:
            raise MpisphError(
                f"{folder}: holds {found[0]} of a run, but no {STATUS_FILE}; name "
                "another folder, or --force to start over and lose what is there"
            )
        return None
    if status.state not in FINAL and not (folder / CASE_FILE).exists():
        return None  # killed before it had written anything else
    differing = differences(case_in(folder), case)
    if differing:
        shown = ", ".join(differing[:SHOWN_DIFFERENCES])
        more = len(differing) - SHOWN_DIFFERENCES
        text = f"{shown} and {more} more" if more > 0 else shown
        problem = Problem(
            f"the folder holds a run of another case ({text}); name another folder, or "
            "--force to start over and lose what is there",
            file=str(folder),
        )
        raise CaseError([problem])
    return status


def remove_run(folder: Path) -> None:
    """Remove the files of an earlier run; first those it could be resumed from."""
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
    names = (
        CASE_FILE,
        INITIAL_FILE,
        HISTORY_FILE,
        RESULT_FILE,
        SERIES_FILE,
        STATUS_FILE,
    )
    parts = [
        *(path for name in names for path in folder.glob(f"{name}.*.part")),
        *(folder / SNAPSHOTS_FOLDER).glob("snapshot_*.part"),
        *(folder / CHECKPOINTS_FOLDER).glob("checkpoint_*.part"),
    ]
    for path in parts:
        path.unlink(missing_ok=True)
