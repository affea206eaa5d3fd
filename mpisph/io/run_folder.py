"""The folder of a run: its case, and what an earlier run has left in it."""

import json
import tomllib
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from mpisph.case import Case, case_from_dict, load_case
from mpisph.case.extension import extended_case
from mpisph.case.identity import differences
from mpisph.case.model import INITIAL_FILE
from mpisph.core.errors import (
    CaseError,
    InputError,
    MpisphError,
    Problem,
    os_error_text,
)
from mpisph.inputs.toml_file import read_toml
from mpisph.io.checkpoint import (
    CHECKPOINTS_FOLDER,
    find_checkpoints,
    read_state,
    remove_checkpoints,
)
from mpisph.io.files import check_regular, write_text
from mpisph.io.history import HISTORY_FILE
from mpisph.io.probe_files import BODIES_FILE, GAUGES_FILE
from mpisph.io.result import RESULT_FILE, Result, read_result
from mpisph.io.snapshot import SERIES_FILE, SNAPSHOTS_FOLDER
from mpisph.io.status import FINAL, STATUS_FILE, Status, read_status

CASE_FILE = "case.toml"

KEYS_FILE = "keys.json"
"""In the folder of a study, which may be taken for that of a run."""

WHOLE_RUN_FIGURES = ("condition", "shield", "wall", "momentum", "damage", "bulge")
"""Names of the figures of a run that bear no time."""

SHOWN_DIFFERENCES = 5
"""How many differences between two cases are named."""


def no_run(folder: Path, missing: str) -> InputError:
    """Return the error for a folder that is asked for its run and has none.

    Parameters
    ----------
    folder : Path
    missing : str
        What is not in it.
    """
    if not folder.exists():
        return InputError(f"{folder}: no such folder")
    if (folder / KEYS_FILE).exists():
        return InputError(f"{folder}: is the folder of a study; name the study's file")
    return InputError(f"{folder}: no {missing}; is it a run's folder?")


def case_in(folder: Path) -> Case:
    """Return the case of the run in a folder.

    Raises
    ------
    MpisphError
        If there is none.
    """
    if not (folder / CASE_FILE).exists():
        raise no_run(folder, CASE_FILE)
    return load_case(folder / CASE_FILE)


def known_case(folder: Path) -> tuple[Case, str]:
    """Return the case of the run in a folder, if need be as a checkpoint holds it.

    Returns
    -------
    case : Case
    note : str
        Empty, or why and whence the case was taken from a checkpoint.

    Raises
    ------
    MpisphError
        If it is nowhere to be found.
    """
    path = folder / CASE_FILE
    try:
        check_regular(path)
        read_toml(path)
    except (CaseError, OSError) as error:
        text = os_error_text(error) if isinstance(error, OSError) else str(error)
        found = _last_state(folder)
        if found is None:
            return case_in(folder), ""
        checkpoint, state = found
        with suppress(CaseError, KeyError, TypeError, ValueError):
            case = case_from_dict(tomllib.loads(state["case"]))
            if case.initial is not None:
                place = {"file": str((folder / INITIAL_FILE).absolute())}
                initial = case.initial.model_copy(update=place)
                case = case.model_copy(update={"initial": initial})
            return case, f"{text}; the case is taken from {checkpoint.name}"
    return case_in(folder), ""


def known_status(folder: Path) -> Status | None:
    """Return how the run in a folder stands, or None where there is no run.

    Where ``status.json`` is damaged or missing, the result and the checkpoints tell: a
    run with the result of its whole case has ended, another one has failed.

    Raises
    ------
    OSError
        If a file that is there cannot be read.
    """
    try:
        status = read_status(folder)
    except MpisphError:
        fault = "damaged"
    except OSError:
        if (folder / STATUS_FILE).is_file():
            raise
        fault = "damaged"
    else:
        if status is not None:
            return status
        fault = "missing"
    return _status_without_file(folder, fault)


def _status_without_file(folder: Path, fault: str) -> Status | None:
    """Return how a run stands by its result and its checkpoints."""
    result = _readable_result(folder)
    found = _last_state(folder)
    end = None
    with suppress(MpisphError):
        end = known_case(folder)[0].end_time
    when = datetime.now(UTC).isoformat(timespec="seconds")
    status = Status(
        state="failed",
        reason=f"{STATUS_FILE} was {fault}",
        step=0,
        time=0.0,
        end_time=end or 0.0,
        starts=1,
        ranks=result.timing.ranks if result else 1,
        host="unknown",
        pid=0,
        started=when,
        updated=when,
    )
    if result and (result.status == "unstable" or result.time >= (end or 0.0)):
        changes = {"state": result.status, "reason": result.reason}
        reached = {"step": result.step, "time": result.time}
        return status.model_copy(update=changes | reached)
    if found is not None:
        reached = {name: found[1].get(name, 0) for name in ("step", "time")}
        return status.model_copy(update=reached)
    return None if fault == "missing" else status


def restore_status(folder: Path, status: Status) -> None:
    """Write a run's status where the file is damaged or missing; call it on rank 0.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    with suppress(MpisphError, OSError):
        if read_status(folder) is not None:
            return
    write_text(folder / STATUS_FILE, status.model_dump_json(indent=2) + "\n")


def _readable_result(folder: Path) -> Result | None:
    with suppress(OSError, ValueError):
        return read_result(folder / RESULT_FILE)
    return None


def _last_state(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """Return the last checkpoint whose state can be read, and that state."""
    for path in find_checkpoints(folder):
        with suppress(MpisphError, OSError, ValueError):
            state = json.loads(read_state(path))
            if isinstance(state, dict):
                return path, state
    return None


def status_of_case(case: Case, folder: Path) -> Status | None:
    """Return the status of the run in a folder; None where there is none.

    Raises
    ------
    CaseError
        If it is a run of another case.
    MpisphError
        If the folder holds files of a run, but not how it stands.
    """
    status = known_status(folder)
    if status is None:
        found = [n for n in (CASE_FILE, RESULT_FILE) if (folder / n).exists()]
        if found:
            raise MpisphError(
                f"{folder}: holds {found[0]} of a run, but no {STATUS_FILE}; name "
                "another folder, or --force to start over and lose what is there"
            )
        return None
    has_case = (folder / CASE_FILE).exists() or find_checkpoints(folder)
    if status.state not in FINAL and not has_case:
        return None  # killed before it had written anything else
    stored, _ = known_case(folder)
    differing = differences(stored, case)
    if differing:
        shown = ", ".join(differing[:SHOWN_DIFFERENCES])
        more = len(differing) - SHOWN_DIFFERENCES
        text = f"{shown} and {more} more" if more > 0 else shown
        problem = Problem(
            f"the folder holds a run of another case ({text}); name another folder, or "
            "--force to start over and lose what is there"
            f"{_hint(stored, case, folder)}",
            file=str(folder),
        )
        raise CaseError([problem])
    return status


def _hint(stored: Case, case: Case, folder: Path) -> str:
    """Return what to do where one case only goes on longer than the other."""
    try:
        extended_case(stored, case)
    except CaseError:
        return ""
    return f"; `mpisph resume {folder} --set KEY=VALUE` extends the run"


def remove_run(folder: Path) -> None:
    """Remove the files of an earlier run; first those it could be resumed from."""
    (folder / CASE_FILE).unlink(missing_ok=True)
    remove_checkpoints(folder)
    stale = [
        *(folder / SNAPSHOTS_FOLDER).glob("snapshot_*"),
        *(folder / "figures").glob("*_[0-9]*us.png"),
        *(folder / "figures" / f"{name}.png" for name in WHOLE_RUN_FIGURES),
        folder / SERIES_FILE,
        folder / RESULT_FILE,
        folder / BODIES_FILE,
        folder / GAUGES_FILE,
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
        BODIES_FILE,
        GAUGES_FILE,
        RESULT_FILE,
        SERIES_FILE,
        STATUS_FILE,
    )
    parts = [
        *(path for name in names for path in folder.glob(f"{name}.*.part")),
        # Open MPI keeps a lock beside a file that all ranks have open.
        *(folder / SNAPSHOTS_FOLDER).glob("snapshot_*.part*"),
        *(folder / CHECKPOINTS_FOLDER).glob("checkpoint_*.part*"),
    ]
    for path in parts:
        path.unlink(missing_ok=True)
