"""The table of a study: a row for each case, with what its run has come to."""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from mpisph.analysis.clock_offset import fit_clock
from mpisph.analysis.hole import measure_hole
from mpisph.case import Case
from mpisph.case.times import same_time
from mpisph.core.errors import MpisphError
from mpisph.io.files import write_text
from mpisph.io.history import HISTORY_FILE, read_history
from mpisph.io.result import RESULT_FILE, CloudRecord, Comparison, Result, read_result
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.study.model import Study, StudyCase
from mpisph.study.store import Place, case_folder, look_up, study_folder

Row = dict[str, Any]
"""Values by column; None where there is none."""

TABLE_FILE = "table.csv"
PARQUET_FILE = "table.parquet"

CLOCKS = {"nominal": "", "offset": "_offset"}
"""What the names of columns add for each reading of the clock."""

_ENDINGS = ("mm", "error_percent", "robust_mm")
# Of the columns of R_b and L_b.


def collect(study: Study, root: Path) -> list[Row]:
    """Return the table of a study, as far as its runs have come.

    Parameters
    ----------
    study : Study
    root : Path
        See `store`.

    Returns
    -------
    list of dict
        A row for each case, in the order of the study. Lengths are in mm, errors in %;
        a column's name ends with its unit. ``R_b_6us_mm`` is that of the outermost
        particle at the nominal time of the exposure at 6 us, ``_offset`` adds the
        case's clock offset, ``_robust`` means the mass quantile. ``total_error`` is the
        mean of the absolute errors of all measured figures, as in Lee 3.5; ``_fitted``
        that with the offset fitted on this very run. ``hole`` is the hole's diameter
        between the plate's faces, ``hole_opening`` that through its lips.

    Raises
    ------
    MpisphError
        If a file of a run cannot be understood.
    OSError
        If it cannot be read.
    """
    rows: dict[str, Row] = {}
    for case in study.cases:
        if case.key not in rows:
            folder = case_folder(root, case)
            rows[case.key] = _run_columns(case.case, folder, look_up(folder))
    return [_case_columns(case) | rows[case.key] for case in study.cases]


def _case_columns(case: StudyCase) -> Row:
    """Return the columns that say which case it is."""
    return {"case": case.number, "variant": case.variant, **case.settings}


def _run_columns(case: Case, folder: Path, place: Place) -> Row:
    """Return the columns that say what the run has come to."""
    row: Row = {
        "run": folder.name,
        "status": place.standing,
        "reason": place.reason or None,
        "npr": case.resolution.npr,
    }
    if place.standing not in {"completed", "unstable"}:
        return row
    try:
        result = read_result(folder / RESULT_FILE)
    except ValueError as error:
        raise MpisphError(f"{folder / RESULT_FILE}: not a result") from error
    row |= {
        "particles": result.particles,
        "steps": result.step,
        "time_us": result.time * 1e6,
        "wall_s": result.timing.wall,
        "energy_error": result.conservation.energy_error_max,
        "version": result.versions.get("mpisph"),
        "revision": result.revision,
    }
    row |= _cloud_columns(case, result)
    row |= _hole_columns(case, result, folder)
    row |= _fit_columns(case, folder) if place.standing == "completed" else {}
    return row


def time_label(time: float) -> str:
    """Return a time [s] as the names of columns give it, such as ``6us``."""
    return f"{time * 1e6:g}us"


def _cloud_columns(case: Case, result: Result) -> Row:
    """Return R_b, L_b and their errors at every exposure, by both clocks."""
    row: Row = {}
    for c in result.comparisons:
        robust = "_robust" if c.figure == "robust" else ""
        where = f"{time_label(c.nominal_time)}{CLOCKS[c.clock]}{robust}"
        row[f"R_b_{where}_mm"] = _scaled(c.radius, 1e3)
        row[f"L_b_{where}_mm"] = _scaled(c.length, 1e3)
        if c.figure == "outermost":
            row[f"R_b_{where}_error_percent"] = c.radius_error_percent
            row[f"L_b_{where}_error_percent"] = c.length_error_percent
            row |= _motion_columns(where, c.time, result.clouds)
    for clock, suffix in CLOCKS.items():
        chosen = [c for c in result.comparisons if _is_total(c, clock)]
        row[f"total_error{suffix}_percent"] = total_error(
            error
            for c in chosen
            for error in (c.radius_error_percent, c.length_error_percent)
        )
    return row


def _is_total(c: Comparison, clock: str) -> bool:
    return c.clock == clock and c.figure == "outermost"


def _motion_columns(where: str, time: float, clouds: Sequence[CloudRecord]) -> Row:
    """Return velocity and mass of the cloud at a time."""
    found = [c for c in clouds if same_time(c.time, time)]
    if not found:
        return {}
    return {
        f"front_velocity_{where}_km_per_s": _scaled(
            _known(found[0].front_velocity), 1e-3
        ),
        f"cloud_mass_{where}_g": _scaled(_known(found[0].mass), 1e3),
    }


def _hole_columns(case: Case, result: Result, folder: Path) -> Row:
    """Return the hole's diameter at every exposure, by both clocks."""
    snapshots = read_series(folder)
    row: Row = {}
    for c in result.comparisons:
        if c.figure == "outermost" and c.outcome == "compared":
            (path,) = (p for p, t in snapshots if same_time(t, c.time))
            hole = measure_hole(read_snapshot(path).arrays, case)
            where = f"{time_label(c.nominal_time)}{CLOCKS[c.clock]}"
            row[f"hole_{where}_mm"] = _scaled(_known(hole.diameter), 1e3)
            row[f"hole_opening_{where}_mm"] = _scaled(_known(hole.opening), 1e3)
    return row


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


def total_error(errors: Iterable[float | None]) -> float | None:
    """Return the mean of the absolute errors, None where any is missing.

    Parameters
    ----------
    errors : iterable of float or None
        [%].
    """
    found = list(errors)
    if not found or any(error is None for error in found):
        return None
    return math.fsum(abs(error) for error in found if error is not None) / len(found)


def _fit_columns(case: Case, folder: Path) -> Row:
    """Return the clock offset that suits this run best, and what it leaves."""
    with suppress(ValueError):  # nothing measured, or the run ends too early
        fit = fit_clock(read_history(folder / HISTORY_FILE), case)
        if len(fit.errors) > 2:  # one exposure alone says nothing of the clock
            return {
                "fitted_offset_us": fit.offset * 1e6,
                "total_error_fitted_percent": total_error(100.0 * fit.errors),
            }
    return {}


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the names of all columns, in the order of their first appearance."""
    return list(dict.fromkeys(name for row in rows for name in row))


def figure_columns(study: Study) -> list[str]:
    """Return the columns of numbers that runs can add to the table of a study.

    Parameters
    ----------
    study : Study
    """
    names = ["npr", "particles", "steps", "time_us", "wall_s", "energy_error"]
    names += [f"total_error{suffix}_percent" for suffix in CLOCKS.values()]
    names += ["fitted_offset_us", "total_error_fitted_percent"]
    for time in study.times():
        for suffix in CLOCKS.values():
            where = f"{time_label(time)}{suffix}"
            names += [f"{q}_{where}_{e}" for q in ("R_b", "L_b") for e in _ENDINGS]
            names += [f"front_velocity_{where}_km_per_s", f"cloud_mass_{where}_g"]
            names += [f"hole_{where}_mm", f"hole_opening_{where}_mm"]
    return names


def write_table(study: Study, root: Path, rows: Sequence[Row], parquet: bool) -> Path:
    """Write the table into the study's folder.

    Parameters
    ----------
    study : Study
    root : Path
    rows : sequence of dict
        From `collect`.
    parquet : bool
        Whether to write a Parquet file as well.

    Returns
    -------
    Path
        The CSV file.

    Raises
    ------
    MpisphError
        If Parquet is asked for and its library is not installed.
    OSError
        If a file cannot be written.
    """
    folder = study_folder(root, study)
    write_rows(folder / TABLE_FILE, rows)
    if parquet:
        _write_parquet(folder / PARQUET_FILE, rows)
    return folder / TABLE_FILE


def write_rows(path: Path, rows: Sequence[Row]) -> None:
    """Write rows as a CSV file, with a column for each name that any has.

    Parameters
    ----------
    path : Path
        Its folder is made where it is missing.
    rows : sequence of dict

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    text = io.StringIO()
    writer = csv.DictWriter(text, columns(rows), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    write_text(path, text.getvalue())


def _write_parquet(path: Path, rows: Sequence[Row]) -> None:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise MpisphError(
            "Parquet needs pyarrow: pip install 'mpisph[parquet]'"
        ) from None
    names = columns(rows)
    table = pyarrow.table({name: [row.get(name) for row in rows] for name in names})
    part = path.with_name(f"{path.name}.part")
    pyarrow.parquet.write_table(table, part)
    part.replace(path)
