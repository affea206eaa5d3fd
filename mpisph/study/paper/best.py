"""Which one set of parameters suits all variants of a study best."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case import Case
from mpisph.core.errors import MpisphError
from mpisph.io.history import HISTORY_FILE, read_history
from mpisph.study.columns import time_label
from mpisph.study.model import Study, StudyCase
from mpisph.study.store import case_folder, study_folder
from mpisph.study.table import Row, total_error, write_rows

BEST_FILE = "best.csv"


class BestSet(NamedTuple):
    """A combination of parameters, with the errors of all variants by one clock.

    Attributes
    ----------
    settings : dict
        Value of each parameter.
    offset_us : float
        Offset of the clock, for all variants [us].
    fitted : bool
        Whether it is fitted on this set's run of the study's `clock_from`; else it is
        that of its case, or one of the study's `clock_offsets`.
    errors : dict
        Signed errors of R_b and L_b [%] by column, such as
        ``shot-1283_R_b_6us_error_percent``; None where the run is not complete or ends
        before the exposure with the offset.
    max_percent, mean_percent : float or None
        Largest and mean of the absolute errors at the exposures that all variants
        have: for Piekutowski's four shots the eight at 6 us, those of the shot that
        the clock is fitted on included. None where any of them is missing.
    """

    settings: dict[str, Any]
    offset_us: float
    fitted: bool
    errors: dict[str, float | None]
    max_percent: float | None
    mean_percent: float | None


def best_sets(study: Study, rows: Sequence[Row], root: Path) -> list[BestSet]:
    """Judge every combination of parameters over all variants by one clock.

    The offset is fitted on the variant `clock_from` alone, for each combination on its
    own run, and R_b and L_b of every variant are interpolated in the histories. Each
    combination is judged by the study's `clock_offsets` as well.

    Parameters
    ----------
    study : Study
        With `clock_from`.
    rows : sequence of dict
        From `collect`.
    root : Path
        See `store`.

    Returns
    -------
    list of BestSet
        The smallest `max_percent` first; those without one last.

    Raises
    ------
    MpisphError
        If a history cannot be understood.
    OSError
        If it cannot be read.
    """
    groups: dict[tuple[Any, ...], list[tuple[StudyCase, Row]]] = {}
    for case, row in zip(study.cases, rows, strict=True):
        groups.setdefault(tuple(case.settings.values()), []).append((case, row))
    sets = [s for group in groups.values() for s in _judge(study, root, group)]
    return sorted(
        sets, key=lambda s: math.inf if s.max_percent is None else s.max_percent
    )


def _judge(
    study: Study, root: Path, group: Sequence[tuple[StudyCase, Row]]
) -> Iterator[BestSet]:
    """Return one combination's errors by every clock.

    `group` has the combination's run of each variant.
    """
    histories = [
        _history(root, case) if row["status"] == "completed" else None
        for case, row in group
    ]
    cases = [case for case, _ in group]
    yield _judge_at(cases, histories, *_offset(study, group))
    for offset in study.file.clock_offsets:
        yield _judge_at(cases, histories, offset, False)


def _judge_at(
    cases: Sequence[StudyCase],
    histories: Sequence[npt.NDArray[Any] | None],
    offset: float,
    fitted: bool,
) -> BestSet:
    """Return the errors of all variants by a clock with an offset [s]."""
    common = set.intersection(*({e.time for e in _exposures(c.case)} for c in cases))
    errors: dict[str, float | None] = {}
    judged: list[float | None] = []
    for case, history in zip(cases, histories, strict=True):
        for name, time, measured, column in _figures(case.case):
            size = _size_at(history, time + offset, column)
            error = None if size is None else 100.0 * (size / measured - 1.0)
            label = f"{case.variant}_{name}_{time_label(time)}_error_percent"
            errors[label] = error
            judged += [error] if time in common else []
    known = [abs(error) for error in judged if error is not None]
    complete = bool(known) and len(known) == len(judged)
    return BestSet(
        settings=dict(cases[0].settings),
        offset_us=1e6 * offset,
        fitted=fitted,
        errors=errors,
        max_percent=max(known) if complete else None,
        mean_percent=total_error(judged),
    )


def _offset(study: Study, group: Sequence[tuple[StudyCase, Row]]) -> tuple[float, bool]:
    """Return the clock's offset [s], and whether it is fitted."""
    chosen = [pair for pair in group if pair[0].variant == study.file.clock_from]
    case, row = chosen[0] if chosen else group[0]
    fit = row.get("fitted_offset_us")
    if chosen and fit is not None:
        return 1e-6 * fit, True
    return (case.case.measured.clock_offset if case.case.measured else 0.0), False


def _exposures(case: Case) -> tuple[Any, ...]:
    return case.measured.exposures if case.measured else ()


def _figures(case: Case) -> Iterator[tuple[str, float, float, str]]:
    """Return name, nominal time [s], measured size [m] and column of each figure."""
    for exposure in _exposures(case):
        if exposure.radius is not None:
            yield "R_b", exposure.time, exposure.radius, "cloud_radius"
        if exposure.length is not None:
            yield "L_b", exposure.time, exposure.length, "cloud_length"


def _history(root: Path, case: StudyCase) -> npt.NDArray[Any]:
    path = case_folder(root, case) / HISTORY_FILE
    try:
        return read_history(path)
    except ValueError as error:
        raise MpisphError(f"{path}: not a history") from error


def _size_at(
    history: npt.NDArray[Any] | None, time: float, column: str
) -> float | None:
    """Return a size [m] at a time; None without a run that comes so far."""
    if history is None or history.size == 0:
        return None
    times = history["time"]
    # The last time may differ from the wanted one by rounding.
    if not times[0] <= time <= times[-1] * (1.0 + 1e-9):
        return None
    size = float(np.interp(time, times, history[column]))
    # Of a cloud that has come to the next body there is none.
    return size if np.isfinite(size) else None


def write_best(study: Study, root: Path, rows: Sequence[Row]) -> Path | None:
    """Write the table of all combinations, the best first.

    Parameters
    ----------
    study : Study
    root : Path
        See `store`.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    Path or None
        The CSV file; None where the study has no `clock_from`.

    Raises
    ------
    MpisphError
        If a history cannot be understood.
    OSError
        If a file cannot be read or written.
    """
    if study.file.clock_from is None:
        return None
    out = study_folder(root, study) / BEST_FILE
    write_rows(out, [_line(s) for s in best_sets(study, rows, root)])
    return out


def _line(s: BestSet) -> Row:
    return {
        **s.settings,
        "offset_us": s.offset_us,
        "fitted": s.fitted,
        "max_percent": s.max_percent,
        "mean_percent": s.mean_percent,
        **s.errors,
    }
