"""The figure of the total error over parameters, made ready for `figures`."""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.paper.ranges import TOTALS, agreement
from mpisph.study.plots.axes import (
    Axis,
    Clock,
    axis_of,
    by_axes,
    clock_text,
    in_rows,
    is_unstable,
    status_note,
    value_at,
)
from mpisph.study.plots.study_map import MapBand, MapFigure, MapPanel
from mpisph.study.table import Row

DEFAULT_LIMIT = 10.0
"""Error that a map is centred on where the paper gives no limit [%]."""


def map_figure(study: Study, spec: FigureSpec, rows: Sequence[Row]) -> MapFigure:
    """Return what is drawn of the total error over two or three parameters.

    Parameters
    ----------
    study : Study
    spec : FigureSpec
        Of kind ``map``.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    MapFigure
    """
    x, panels = axis_of(study, spec.x), axis_of(study, spec.panels)
    y = _ascending(axis_of(study, spec.lines))
    table = by_axes(rows, (x, y, panels))

    def panel(value: Value, title: str, clock: Clock) -> MapPanel:
        cells = [[table.get((i, j, value)) for i in x.values] for j in y.values]
        errors = [[value_at(row, TOTALS[clock]) for row in line] for line in cells]
        unstable = [[is_unstable(row) for row in line] for line in cells]
        at = [{x.name: i, panels.name: value} for i in x.values]
        ranges = [_ends(study, settings, y) for settings in at]
        return MapPanel(title, np.array(errors), np.array(unstable), ranges)

    bands: list[MapBand] = []
    for clock in spec.clocks:
        maps = [
            panel(value, title, clock)
            for value, title in zip(panels.values, panels.titles(), strict=True)
        ]
        heading = clock_text(study, clock) + _alike(study, rows, clock)
        bands += [MapBand(*band) for band in in_rows(heading, maps)]
    return MapFigure(
        title=study.file.title,
        x_label=x.label,
        y_label=y.label,
        x=x.names,
        y=y.names,
        y_numbers=y.numbers(),
        limit=study.file.paper.limit_percent or DEFAULT_LIMIT,
        bands=bands,
        note=_note(study, rows),
    )


def _ascending(axis: Axis) -> Axis:
    """Return an axis of numbers with its values in order."""
    order = np.argsort(axis.numbers())
    return axis._replace(
        values=tuple(axis.values[k] for k in order),
        names=tuple(axis.names[k] for k in order),
    )


def _ends(
    study: Study, at: dict[str, Value], y: Axis
) -> tuple[float, float] | tuple[()] | None:
    """Return the ends of the paper's range along y; infinite where it names none."""
    for given in study.file.paper.ranges:
        here = all(at.get(name) == value for name, value in given.at.items())
        if study.file.paper.parameter != y.name or not here:
            continue
        if given.low is None and given.high is None:
            return ()
        low = -math.inf if given.low is None else given.low
        return low, math.inf if given.high is None else given.high
    return None


def _alike(study: Study, rows: Sequence[Row], clock: Clock) -> str:
    """Return how far the cells agree with the paper."""
    found = agreement(study, rows, clock)
    if not found.compared:
        return ""
    percent = f"{100 * found.fraction:.0f} %"
    return f": {percent} of {found.compared} cells as in the paper"


def _note(study: Study, rows: Sequence[Row]) -> str:
    note = "Mean over R_b and L_b of all exposures. "
    if study.file.paper.ranges:
        limit = study.file.paper.limit_percent
        note += (
            "Bars: the paper's ranges, with an arrow where they have no upper end. A "
            f"cell is as in the paper where both are below {limit:g} %, or neither. "
        )
    return f"{note}Blank: no run. {status_note(rows)}"
