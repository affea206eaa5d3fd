"""The figure of quantities over a parameter, made ready for `figures`."""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case.times import same_time
from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.plots.axes import (
    SYMBOLS,
    Axis,
    Clock,
    axis_of,
    by_axes,
    clock_text,
    exposures,
    in_rows,
    is_unstable,
    measured_mm,
    size_column,
    status_note,
    value_at,
)
from mpisph.study.plots.study_lines import LinesBand, LinesFigure, LinesPanel, LinesRow
from mpisph.study.table import Row


def lines_figure(study: Study, spec: FigureSpec, rows: Sequence[Row]) -> LinesFigure:
    """Return what is drawn of quantities over a parameter.

    Parameters
    ----------
    study : Study
    spec : FigureSpec
        Of kind ``lines``.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    LinesFigure
    """
    x, lines, panels = (axis_of(study, n) for n in (spec.x, spec.lines, spec.panels))
    table = by_axes(rows, (x, lines, panels))
    times = study.times(spec.exposures)
    shown = [(quantity, time) for quantity in spec.quantities for time in times[::-1]]

    def panel(value: Value, title: str, clock: Clock) -> LinesPanel:
        cells = [
            [table.get((at, line, value)) for at in x.values] for line in lines.values
        ]
        names = [size_column(*what, clock, "mm") for what in shown]
        values = [
            [[value_at(r, name) for r in line] for line in cells] for name in names
        ]
        unstable = [[is_unstable(row) for row in line] for line in cells]
        return LinesPanel(title, np.array(values), np.array(unstable))

    bands = {
        clock_text(study, clock): [
            panel(value, title, clock)
            for value, title in zip(panels.values, panels.titles(), strict=True)
        ]
        for clock in spec.clocks
    }
    return LinesFigure(
        title=study.file.title,
        x_label=x.label,
        x=x.numbers() if x.numeric else x.names,
        log_x=spec.x_scale == "log",
        lines_label=lines.label,
        lines=lines.names,
        ordered=lines.numeric,
        rows=[_row(study, *what, thick=what[1] > times[0]) for what in shown],
        bands=_arranged(bands, panels),
        note=_note(times, rows),
    )


def _arranged(bands: dict[str, list[LinesPanel]], panels: Axis) -> list[LinesBand]:
    """Put one or two panels of all clocks beside each other, more below each other."""
    if len(panels.values) > 2:
        return [
            LinesBand(*band)
            for heading, columns in bands.items()
            for band in in_rows(heading, columns)
        ]
    across = [
        panel._replace(title=f"{heading}\n{panel.title}".strip())
        for heading, columns in bands.items()
        for panel in columns
    ]
    return [LinesBand("", across)]


def _row(study: Study, quantity: str, time: float, thick: bool) -> LinesRow:
    sizes = {
        measured_mm(exposure, quantity)
        for _, exposure in exposures(study)
        if same_time(exposure.time, time)
    }
    return LinesRow(
        label=f"{SYMBOLS[quantity]} at {1e6 * time:g} µs [mm]",
        thick=thick,
        # Where the shots differ, no line is right for all.
        measured=sizes.pop() if len(sizes) == 1 else math.nan,
        unit="mm",
    )


def _note(times: Sequence[float], rows: Sequence[Row]) -> str:
    note = ""
    if len(times) > 1:
        texts = [f"{1e6 * time:g} µs" for time in times]
        later = ", ".join(texts[1:])
        note = f"Thin lines, open markers: {texts[0]}; thick, filled: {later}. "
    return f"{note}Outermost particles. {status_note(rows)}"
