"""A run as its folder holds it, whether it has ended or not."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case import Case
from mpisph.core.errors import MpisphError
from mpisph.diagnostics.cloud import cloud_definition, measure_arrays
from mpisph.io.history import HISTORY_FILE, read_history
from mpisph.io.probe_files import probe_headers, read_probes_file
from mpisph.io.result import (
    RESULT_FILE,
    CloudRecord,
    Comparison,
    Result,
    make_comparisons,
    read_result,
)
from mpisph.io.run_folder import CASE_FILE, case_in, no_run
from mpisph.io.run_log import LOG_FILE
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.io.standing import standing
from mpisph.io.status import FINAL, STATUS_FILE, Status


class StoredRun(NamedTuple):
    """What a report says about a run.

    Attributes
    ----------
    folder : Path
    name : str
        What to call it.
    case : Case
    case_text : str
        The file ``case.toml``.
    status : Status
    state : str
        See `standing`.
    particles : int or None
        Number of particles, where that is known.
    result : Result or None
        None of a run that has not ended.
    history : structured ndarray
        From `history.read_history`; empty where there is none.
    snapshots : list of (Path, float)
        With their times [s].
    clouds : tuple of CloudRecord
        The cloud at the output times reached.
    comparisons : tuple of Comparison
        Those of the result; of a run that has not ended, from its snapshots.
    provenance : dict of str to str
        Versions and revision of the program.
    warnings : list of str
        What the run warned of.
    probes : dict of str to structured ndarray
        What was followed of bodies and at gauges, by the names of the files; see
        `probe_files.read_probes_file`.
    """

    folder: Path
    name: str
    case: Case
    case_text: str
    status: Status
    state: str
    particles: int | None
    result: Result | None
    history: npt.NDArray[Any]
    snapshots: list[tuple[Path, float]]
    clouds: tuple[CloudRecord, ...]
    comparisons: tuple[Comparison, ...]
    provenance: dict[str, str]
    warnings: list[str]
    probes: dict[str, npt.NDArray[Any]]


def read_run(folder: Path, name: str = "") -> StoredRun:
    """Read a run's folder.

    Parameters
    ----------
    folder : Path
    name : str, optional
        What to call it; by default the folder's name.

    Returns
    -------
    StoredRun

    Raises
    ------
    MpisphError
        If the folder holds no run, or a file of it cannot be understood.
    OSError
        If a file cannot be read.
    """
    state, _, status = standing(folder)
    if status is None:
        raise no_run(folder, STATUS_FILE)
    case = case_in(folder)
    # While a run is extended, its folder holds the result of the shorter one.
    result = _result(folder) if state in FINAL else None
    snapshots = _present(read_series(folder))
    clouds = result.clouds if result else _measured_clouds(case, snapshots)
    particles, provenance = _origin(result, snapshots)
    return StoredRun(
        folder=folder,
        name=name or folder.resolve().name,
        case=case,
        case_text=(folder / CASE_FILE).read_text(encoding="utf-8"),
        status=status,
        state=state,
        particles=particles,
        result=result,
        history=_history(folder),
        snapshots=snapshots,
        clouds=clouds,
        comparisons=result.comparisons if result else make_comparisons(case, clouds),
        provenance=provenance,
        warnings=_warnings(folder),
        probes=_probes(folder, case),
    )


def read_runs(folders: Sequence[Path]) -> list[StoredRun]:
    """Read several runs; those whose folders have one name get that of the one above.

    Raises
    ------
    MpisphError, OSError
        See `read_run`.
    """
    whole = [folder.resolve() for folder in folders]
    names = [path.name for path in whole]
    if len(set(names)) < len(set(whole)):
        names = ["/".join(path.parts[-2:]) for path in whole]
    return [read_run(f, name) for f, name in zip(folders, names, strict=True)]


def _result(folder: Path) -> Result | None:
    path = folder / RESULT_FILE
    try:
        return read_result(path)
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise MpisphError(f"{path}: not the result of a run") from error


def _history(folder: Path) -> npt.NDArray[Any]:
    path = folder / HISTORY_FILE
    try:
        return read_history(path)
    except FileNotFoundError:
        return np.array([])
    except ValueError as error:
        raise MpisphError(f"{path}: not a history") from error


def _probes(folder: Path, case: Case) -> dict[str, npt.NDArray[Any]]:
    try:
        return {
            name: read_probes_file(folder / name, header)
            for name, header in probe_headers(case).items()
        }
    except ValueError as error:
        raise MpisphError(str(error)) from error


def _present(series: list[tuple[Path, float]]) -> list[tuple[Path, float]]:
    """Return the snapshots that have not been moved away to save room."""
    return [(path, time) for path, time in series if path.exists()]


def _measured_clouds(
    case: Case, snapshots: list[tuple[Path, float]]
) -> tuple[CloudRecord, ...]:
    """Measure the clouds that no result holds, as a run would."""
    definition, clouds = cloud_definition(case), []
    for path, time in snapshots:
        if time in case.output_times:
            measure = measure_arrays(read_snapshot(path).arrays, definition)
            clouds.append(CloudRecord.of(time, measure, case))
    return tuple(clouds)


def _origin(
    result: Result | None, snapshots: list[tuple[Path, float]]
) -> tuple[int | None, dict[str, str]]:
    """Return the number of particles, and versions and revision of the program."""
    if result is not None:
        return result.particles, {"revision": result.revision, **result.versions}
    if not snapshots:
        return None, {}
    last = read_snapshot(snapshots[-1][0])
    texts = {name: text for name, text in last.metadata.items() if name != "case"}
    return len(last.arrays["id"]), texts


def _warnings(folder: Path) -> list[str]:
    """Return what the log warns of, each text once."""
    try:
        lines = (folder / LOG_FILE).read_text(encoding="utf-8").splitlines()
    except FileNotFoundError:
        return []
    texts = [
        line.removeprefix("warning: ") for line in lines if "warning: " in line[:9]
    ]
    return list(dict.fromkeys(texts))
