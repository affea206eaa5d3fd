"""The table of a study: a row for each case, with what its run has come to."""

import csv
import io
import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy.typing as npt

from mpisph.analysis.clock_offset import fit_clock
from mpisph.analysis.hole import Hole, measure_hole
from mpisph.case import Case
from mpisph.case.times import same_time
from mpisph.core.errors import MpisphError
from mpisph.diagnostics.cloud import cloud_definition, in_cloud, shows_arrival
from mpisph.io.files import write_text
from mpisph.io.history import HISTORY_FILE, read_history
from mpisph.io.result import RESULT_FILE, CloudRecord, Comparison, Result, read_result
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.io.verdict import WallRecord
from mpisph.study.columns import (
    CLOCKS,
    WALL_COLUMNS,
    WALL_FIGURES,
    column,
    time_label,
)
from mpisph.study.model import Study, StudyCase
from mpisph.study.store import case_folder, look_up, study_folder

Row = dict[str, Any]
"""Values by column; None where there is none."""

TABLE_FILE = "table.csv"
PARQUET_FILE = "table.parquet"

TIMES_FILE = "times.csv"


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
        a column's name ends with its unit. ``R_b_mm`` is that of the outermost particle
        at the end of a completed run, ``R_b_6us_mm`` that at 6 us, the nominal time of
        an exposure or one of the study's `times`; ``_offset`` adds the case's clock
        offset, ``_robust`` means the mass quantile. ``total_error`` is the mean of the
        absolute errors of all measured figures, as in Lee 3.5; ``_fitted`` that with
        the offset fitted on this very run. ``hole`` is the hole's diameter between the
        plate's faces, ``hole_opening`` that through its lips. Momenta are axial.

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
            rows[case.key] = _run_columns(study, case.case, folder)
    return [_case_columns(case) | rows[case.key] for case in study.cases]


def _case_columns(case: StudyCase) -> Row:
    """Return the columns that say which case it is."""
    return {"case": case.number, "variant": case.variant, **case.settings}


def _run_columns(study: Study, case: Case, folder: Path) -> Row:
    """Return the columns that say what the run has come to."""
    place = look_up(folder)
    row: Row = {
        "run": folder.name,
        "status": place.standing,
        "reason": place.reason or None,
        "npr": case.resolution.npr,
    }
    if place.standing not in {"completed", "unstable"}:
        return row
    result = run_result(folder)
    row |= {
        "particles": result.particles,
        "steps": result.step,
        "time_us": result.time * 1e6,
        "wall_s": result.timing.wall,
        "energy_error": result.conservation.energy_error_max,
        "version": result.versions.get("mpisph"),
        "revision": result.revision,
    }
    row |= _verdict_columns(result)
    row |= _measured_columns(result)
    for where, time in _places(result, study.file.times).items():
        row |= _columns_at(where, time, case, result, folder)
    row |= _fit_columns(case, folder) if place.standing == "completed" else {}
    return row


def run_result(folder: Path) -> Result:
    """Return the result of a run that has ended.

    Raises
    ------
    MpisphError
        If it cannot be understood.
    OSError
        If it cannot be read.
    """
    path = folder / RESULT_FILE
    try:
        return read_result(path)
    except ValueError as error:
        raise MpisphError(f"{path}: not a result") from error


def _verdict_columns(result: Result) -> Row:
    """Return the verdict on a shield's wall, and the figures behind it."""
    verdict = result.verdict
    if verdict is None:
        return {}
    row: Row = {"verdict": verdict.outcome, "verdict_reason": verdict.reason}
    if verdict.wall is None:
        return row | dict.fromkeys(WALL_COLUMNS)
    figures = wall_columns(verdict.wall, WALL_FIGURES)
    rest = _scaled(verdict.rest_time, 1e6)
    return row | {"verdict_damage": verdict.damage, **figures, "wall_rest_us": rest}


def wall_columns(
    wall: WallRecord, figures: Mapping[str, tuple[str, float]]
) -> dict[str, float]:
    """Return columns of a wall, given as those of `WALL_FIGURES`."""
    return {
        name: factor * getattr(wall, field) for name, (field, factor) in figures.items()
    }


def _measured_columns(result: Result) -> Row:
    """Return R_b, L_b and their errors at every exposure, by both clocks."""
    row: Row = {}
    for c in result.comparisons:
        where = _where(c)
        for name, size, error in (
            ("R_b", c.radius, c.radius_error_percent),
            ("L_b", c.length, c.length_error_percent),
        ):
            if c.figure == "outermost":
                row[column(name, where, "mm")] = _scaled(size, 1e3)
                row[column(name, where, "error_percent")] = error
            else:
                row[column(name, where, "robust_mm")] = _scaled(size, 1e3)
    for clock, suffix in CLOCKS.items() if result.comparisons else ():
        chosen = [c for c in result.comparisons if _is_total(c, clock)]
        row[f"total_error{suffix}_percent"] = total_error(
            error
            for c in chosen
            for error in (c.radius_error_percent, c.length_error_percent)
        )
    return row


def _is_total(c: Comparison, clock: str) -> bool:
    return c.clock == clock and c.figure == "outermost"


def _where(c: Comparison) -> str:
    return f"{time_label(c.nominal_time)}{CLOCKS[c.clock]}"


def _places(result: Result, times: Sequence[float]) -> dict[str, float]:
    """Return the times that columns are taken at [s], by their part of the name."""
    places = {_where(c): c.time for c in result.comparisons}
    places |= {time_label(time): time for time in times}
    return places | ({"": result.time} if result.status == "completed" else {})


def _columns_at(
    where: str, time: float, case: Case, result: Result, folder: Path
) -> Row:
    """Return all that is measured at a time that the run has reached."""
    clouds = [c for c in result.clouds if same_time(c.time, time)]
    series = read_series(folder)
    paths = [p for p, t in series if same_time(t, time) and p.exists()]
    row = _cloud_columns(where, clouds[0]) if clouds else {}
    if clouds and paths:
        arrays = read_snapshot(paths[0]).arrays
        row |= _hole_columns(where, measure_hole(arrays, case))
        row |= _momentum_columns(where, arrays, case)
    return row


def _cloud_columns(where: str, cloud: CloudRecord) -> Row:
    return {
        column("R_b", where, "mm"): _scaled(_known(cloud.radius), 1e3),
        column("R_b", where, "robust_mm"): _scaled(_known(cloud.radius_robust), 1e3),
        column("L_b", where, "mm"): _scaled(_known(cloud.length), 1e3),
        column("L_b", where, "robust_mm"): _scaled(_known(cloud.length_robust), 1e3),
        column("front_velocity", where, "km_per_s"): _scaled(
            _known(cloud.front_velocity), 1e-3
        ),
        column("cloud_mass", where, "g"): _scaled(_known(cloud.mass), 1e3),
    }


def _hole_columns(where: str, hole: Hole) -> Row:
    return {
        column("hole", where, "mm"): _scaled(_known(hole.diameter), 1e3),
        column("hole_opening", where, "mm"): _scaled(_known(hole.opening), 1e3),
    }


def _momentum_columns(
    where: str, arrays: Mapping[str, npt.NDArray[Any]], case: Case
) -> Row:
    """Return the cloud's axial momentum; momentum and energies of each body."""
    m, u_z = arrays["m"], arrays["u_z"]
    momentum, kinetic = m * u_z, 0.5 * m * (u_z**2 + arrays["u_r"] ** 2)
    definition, bodies, z = cloud_definition(case), arrays["body"], arrays["z"]
    arrived = shows_arrival(bodies, z, arrays["u_r"], u_z, definition).any()
    cloud = in_cloud(bodies, z, u_z, definition)
    name = column("cloud_momentum_z", where, "kg_m_per_s")
    row: Row = {name: None if arrived else float(momentum[cloud].sum())}
    for k, body in enumerate(case.bodies):
        mine = bodies == k
        for quantity, values, unit in (
            ("momentum_z", momentum, "kg_m_per_s"),
            ("kinetic_energy", kinetic, "J"),
            ("internal_energy", m * arrays["E"], "J"),
        ):
            name = column(f"{quantity}_{body.name}", where, unit)
            row[name] = float(values[mine].sum())
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


def times_rows(study: Study, root: Path) -> list[Row]:
    """Return a row for each case at each of its output times that was reached.

    Parameters
    ----------
    study : Study
    root : Path
        See `store`.

    Returns
    -------
    list of dict
        The cloud over time, in the units of `collect`.

    Raises
    ------
    MpisphError
        If a result cannot be understood.
    OSError
        If it cannot be read.
    """
    rows = []
    for case in study.cases:
        folder = case_folder(root, case)
        if look_up(folder).standing in {"completed", "unstable"}:
            rows += [
                {**_case_columns(case), "run": folder.name, "time_us": 1e6 * cloud.time}
                | _cloud_columns("", cloud)
                for cloud in run_result(folder).clouds
            ]
    return rows


def write_table(study: Study, root: Path, rows: Sequence[Row], parquet: bool) -> Path:
    """Write the table, and that of the clouds over time, into the study's folder.

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
        The CSV file of the table.

    Raises
    ------
    MpisphError
        If Parquet is asked for and its library is not installed.
    OSError
        If a file cannot be written.
    """
    folder = study_folder(root, study)
    write_rows(folder / TABLE_FILE, rows)
    write_rows(folder / TIMES_FILE, times_rows(study, root))
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
