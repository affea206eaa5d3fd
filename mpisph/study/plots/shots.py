"""The figure of a study of several shots, made ready for `figures`."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mpisph.case.sections import Exposure
from mpisph.case.times import same_time
from mpisph.core.particles import FloatArray
from mpisph.study.model import FigureSpec, PaperValue, Study, Value
from mpisph.study.plots.axes import (
    SYMBOLS,
    Clock,
    axis_of,
    by_axes,
    clock_text,
    exposures,
    measured_mm,
    size_column,
    status_note,
    value_at,
)
from mpisph.study.plots.study_shots import ShotsFigure, ShotsSeries
from mpisph.study.table import Row


class _Shot(NamedTuple):
    """A variant at one of its exposures."""

    variant: Value
    name: str
    exposure: Exposure


def shots_figure(study: Study, spec: FigureSpec, rows: Sequence[Row]) -> ShotsFigure:
    """Return what is drawn of the errors of several shots.

    Parameters
    ----------
    study : Study
    spec : FigureSpec
        Of kind ``shots``.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    ShotsFigure
    """
    variants, lines = axis_of(study, "variant"), axis_of(study, spec.lines)
    table = by_axes(rows, (variants, lines))
    shots = _shots(study, spec)

    def errors(line: Value, clock: Clock) -> FloatArray:
        values = [
            [
                value_at(
                    table.get((shot.variant, line)),
                    size_column(quantity, shot.exposure.time, clock, "error_percent"),
                )
                for shot in shots
            ]
            for quantity in spec.quantities
        ]
        return np.array(values)

    series = [
        ShotsSeries(name or "computed", errors(line, "nominal"), errors(line, "offset"))
        for line, name in zip(lines.values, lines.titles(), strict=True)
    ]
    paper = _paper_series(study, spec, shots)
    measured = [[measured_mm(s.exposure, q) for s in shots] for q in spec.quantities]
    return ShotsFigure(
        title=study.file.title,
        quantities=[SYMBOLS[quantity] for quantity in spec.quantities],
        shots=[f"{shot.name}, {1e6 * shot.exposure.time:g} µs" for shot in shots],
        measured=np.array(measured),
        series=[*series, *([] if paper is None else [paper])],
        offset_label=clock_text(study, "offset"),
        note="Lengths beside the axes: measured. Computed: outermost particles. "
        f"{status_note(rows)}",
    )


def _shots(study: Study, spec: FigureSpec) -> list[_Shot]:
    """Return each variant with each of its exposures that is drawn."""
    names = dict(zip(*axis_of(study, "variant")[2:], strict=True))
    times = study.times(spec.exposures)
    found = {
        (case.variant, exposure.time): _Shot(
            case.variant, names.get(case.variant, ""), exposure
        )
        for case, exposure in exposures(study)
        if any(same_time(exposure.time, time) for time in times)
    }
    return list(found.values())


def _paper_series(
    study: Study, spec: FigureSpec, shots: Sequence[_Shot]
) -> ShotsSeries | None:
    """Return the errors of the paper's own values, which are at nominal times."""
    errors = np.full((len(spec.quantities), len(shots)), np.nan)
    for k, shot in enumerate(shots):
        for given in study.file.paper.values:
            if _is_of(given, shot):
                errors[:, k] = [_paper_error(given, shot, q) for q in spec.quantities]
    if not np.isfinite(errors).any():
        return None
    return ShotsSeries("paper", errors, np.full_like(errors, np.nan), paper=True)


def _is_of(given: PaperValue, shot: _Shot) -> bool:
    same_case = given.at == {"variant": shot.variant}
    return same_case and same_time(1e-6 * given.time, shot.exposure.time)


def _paper_error(given: PaperValue, shot: _Shot, quantity: str) -> float:
    size = given.radius if quantity == "R_b" else given.length
    if size is None:
        return float("nan")
    return 100.0 * (size / measured_mm(shot.exposure, quantity) - 1.0)
