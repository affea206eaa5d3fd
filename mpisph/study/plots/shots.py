"""The figure of several shots: errors of the computed sizes as dots."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mpisph.case.sections import Exposure
from mpisph.case.times import same_time
from mpisph.core.particles import FloatArray
from mpisph.figures.style import Out, body_colour
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
from mpisph.study.plots.panels import MARKERS, finish, panel_grid
from mpisph.study.table import Row

BAND_PERCENT = 5.0
"""Half width of the band around no error [%]."""


class ShotsSeries(NamedTuple):
    """Errors of one setting, or of the paper, for all shots.

    Attributes
    ----------
    name : str
    nominal, offset : ndarray, shape (quantities, shots)
        Signed errors [%] by both clocks; NaN where there is none.
    paper : bool
        Whether they are the paper's own.
    """

    name: str
    nominal: FloatArray
    offset: FloatArray
    paper: bool = False


class ShotsFigure(NamedTuple):
    """Computed beside measured sizes of several shots.

    Attributes
    ----------
    title : str
    quantities : sequence of str
        Such as ``$R_b$``.
    shots : sequence of str
        Names of the shots with their exposures.
    measured : ndarray, shape (quantities, shots)
        [mm].
    series : sequence of ShotsSeries
    offset_label : str
        What the offset is.
    note : str
        Text below the figure.
    """

    title: str
    quantities: Sequence[str]
    shots: Sequence[str]
    measured: FloatArray
    series: Sequence[ShotsSeries]
    offset_label: str
    note: str


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
    variants = axis_of(study, "variant")
    names = dict(zip(variants.values, variants.names, strict=True))
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


def draw_shots(data: ShotsFigure, out: Out) -> None:
    """Draw the errors of all shots as dots, a panel for each quantity."""
    height = 1.1 + len(data.shots) * (0.22 + 0.16 * len(data.series))
    columns = len(data.quantities)
    with panel_grid(data.title, height, 1, columns, sharex=True) as (figure, (row,)):
        for k, (axes, quantity) in enumerate(zip(row, data.quantities, strict=True)):
            _draw_dots(axes, data, k)
            sizes = [f"{size:.1f} mm" for size in data.measured[k]]
            names = [
                f"{shot}\n{size}" for shot, size in zip(data.shots, sizes, strict=True)
            ]
            axes.set_yticks(range(len(names)), names if k == 0 else sizes)
            axes.set_title(quantity)
            axes.set_xlabel(f"error of {quantity} [%]")
        finish(figure, _handles(data), data.note, out)


def _draw_dots(axes: Axes, data: ShotsFigure, quantity: int) -> None:
    """Draw nominal and offset of each series, joined, below each other."""
    axes.axvspan(-BAND_PERCENT, BAND_PERCENT, color="0.9", linewidth=0.0, zorder=0)
    axes.axvline(0.0, color="0.3", linewidth=0.9, zorder=1)
    n = len(data.series)
    step = 0.72 / n
    for k, (series, look) in enumerate(zip(data.series, _looks(data), strict=True)):
        y = np.arange(len(data.shots)) + (k - 0.5 * (n - 1)) * step
        nominal, offset = series.nominal[quantity], series.offset[quantity]
        axes.hlines(y, nominal, offset, color=look["color"], linewidth=0.9, zorder=2)
        axes.plot(nominal, y, linestyle="none", markerfacecolor="white", **look)
        axes.plot(offset, y, linestyle="none", **look)
    for k in range(len(data.shots) - 1):
        axes.axhline(k + 0.5, color="0.8", linewidth=0.6, zorder=0)
    axes.set_ylim(len(data.shots) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)


def _looks(data: ShotsFigure) -> list[dict[str, Any]]:
    looks: list[dict[str, Any]] = []
    for k, series in enumerate(data.series):
        look = {"color": body_colour(k), "marker": MARKERS[k % len(MARKERS)]}
        if series.paper:
            look = {"color": "black", "marker": "D"}
        looks.append({**look, "markersize": 5.0, "zorder": 3})
    return looks


def _handles(data: ShotsFigure) -> list[Any]:
    handles: list[Any] = []
    for series, look in zip(data.series, _looks(data), strict=True):
        clocks = [
            (f"{series.name}, nominal time", series.nominal, "white"),
            (f"{series.name}, {data.offset_label}", series.offset, look["color"]),
        ]
        for label, values, face in clocks:
            if np.isfinite(values).any():
                dot = {**look, "markerfacecolor": face, "linestyle": "none"}
                handles.append(Line2D([], [], label=label, **dot))
    handles.append(Patch(facecolor="0.9", label=f"±{BAND_PERCENT:g} %"))
    return handles
