"""The figure of quantities over a parameter: a line for each value of another."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mpisph.case.times import same_time
from mpisph.core.particles import FloatArray
from mpisph.figures.style import MEASURED, WIDTH, Out, body_colour
from mpisph.study.columns import column_label
from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.plots.axes import (
    SYMBOLS,
    Axis,
    axis_of,
    by_axes,
    clock_text,
    exposures,
    is_unstable,
    measured_mm,
    size_column,
    status_note,
    value_at,
)
from mpisph.study.plots.panels import (
    MARKERS,
    Band,
    PanelAxes,
    each_panel,
    finish,
    in_rows,
    panel_grid,
)
from mpisph.study.table import Row

_THIN: dict[str, Any] = {"linewidth": 0.9, "markersize": 4.0}
_THICK: dict[str, Any] = {"linewidth": 2.0, "markersize": 4.5}


class LinesRow(NamedTuple):
    """What a row of axes shows.

    Attributes
    ----------
    label : str
        Of its vertical axis.
    thick : bool
        Whether lines are thick and markers filled.
    measured : float
        A measured value [mm], drawn across; NaN where there is none.
    """

    label: str
    thick: bool
    measured: float


class LinesPanel(NamedTuple):
    """A column of axes.

    Attributes
    ----------
    title : str
    values : ndarray, shape (rows, lines, points)
        NaN where there is none.
    unstable : ndarray of bool, shape (lines, points)
        Runs that broke down.
    """

    title: str
    values: FloatArray
    unstable: npt.NDArray[np.bool_]


class LinesFigure(NamedTuple):
    """Quantities over a parameter.

    Attributes
    ----------
    title : str
    x : Axis
        Of numbers, or of categories.
    log_x : bool
        Whether the axis of numbers is logarithmic.
    lines : Axis
        What the lines stand for.
    rows : sequence of LinesRow
    bands : sequence of Band
    note : str
        Text below the figure.
    scattered : bool, optional
        Whether points without a run are no gaps: the values are those of a file's rows.
    """

    title: str
    x: Axis
    log_x: bool
    lines: Axis
    rows: Sequence[LinesRow]
    bands: Sequence[Band[LinesPanel]]
    note: str
    scattered: bool = False


def lines_figure(study: Study, spec: FigureSpec, rows: Sequence[Row]) -> LinesFigure:
    """Return what is drawn over a parameter: columns, or sizes at the exposures.

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
    times = [] if study.drawn else study.times(spec.exposures)
    shown = [(quantity, time) for quantity in spec.quantities for time in times[::-1]]
    clocks: dict[str, Sequence[str]] = {
        clock_text(study, clock): [size_column(*what, clock, "mm") for what in shown]
        for clock in spec.clocks
    }
    drawn = [LinesRow(column_label(name), True, math.nan) for name in study.drawn]

    def panel(value: Value, title: str, names: Sequence[str]) -> LinesPanel:
        cells = [
            [table.get((at, line, value)) for at in x.values] for line in lines.values
        ]
        values = [
            [[value_at(r, name) for r in line] for line in cells] for name in names
        ]
        unstable = [[is_unstable(row) for row in line] for line in cells]
        return LinesPanel(title, np.array(values), np.array(unstable))

    bands = {
        heading: [
            panel(value, title, names)
            for value, title in zip(panels.values, panels.titles(), strict=True)
        ]
        for heading, names in ({"": study.drawn} if drawn else clocks).items()
    }
    return LinesFigure(
        title=study.file.title,
        x=x,
        log_x=spec.x_scale == "log",
        lines=lines,
        rows=drawn or [_row(study, *what, what[1] > times[0]) for what in shown],
        bands=_arranged(bands, panels),
        note=_note(times, rows) if times else status_note(rows),
        scattered=any(p.joined for p in study.file.parameters if p.name == x.name),
    )


def _arranged(
    bands: dict[str, list[LinesPanel]], panels: Axis
) -> list[Band[LinesPanel]]:
    """Put one or two panels of all clocks beside each other, more below each other."""
    if len(panels.values) > 2:
        return [
            band
            for heading, columns in bands.items()
            for band in in_rows(heading, columns)
        ]
    across = [
        panel._replace(title=f"{heading}\n{panel.title}".strip())
        for heading, columns in bands.items()
        for panel in columns
    ]
    return [Band("", across)]


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
    )


def _note(times: Sequence[float], rows: Sequence[Row]) -> str:
    note = ""
    if len(times) > 1:
        texts = [f"{1e6 * time:g} µs" for time in times]
        later = ", ".join(texts[1:])
        note = f"Thin lines, open markers: {texts[0]}; thick, filled: {later}. "
    return f"{note}Outermost particles. {status_note(rows)}"


def draw_lines(data: LinesFigure, out: Out) -> None:
    """Draw quantities over a parameter: a line for each value of another.

    Below the axes a strip has a row for each line, with a cross where the run is
    unstable, so that such runs are not silently missing.
    """
    columns = max(len(band.panels) for band in data.bands)
    strip = any(panel.unstable.any() for b in data.bands for panel in b.panels)
    row_height = float(np.clip(1.1 * WIDTH / columns, 1.5, 2.2))
    strip_height = (0.12 + 0.05 * len(data.lines.values)) * strip
    heights = [row_height] * len(data.rows) + [strip_height] * strip
    extra = 0.35 + 0.3 * bool(data.bands[0].heading)
    bands = len(data.bands)
    height = bands * (sum(heights) + extra) + 0.6
    options = {"sharex": True, "height_ratios": heights * bands}
    rows = bands * len(heights)
    with panel_grid(data.title, height, rows, columns, **options) as (figure, grid):
        for place in each_panel(grid, data.bands):
            _draw_panel(data, place)
        for axes in grid[-1]:
            axes.set_xlabel(data.x.title, parse_math=False)
        finish(figure, _handles(data, strip), data.note, out, data.lines.title)


def _draw_panel(data: LinesFigure, place: PanelAxes[LinesPanel]) -> None:
    """Draw a panel, with the strip of unstable runs at its foot."""
    for k, (axes, row) in enumerate(zip(place.axes, data.rows, strict=False)):
        _draw_curves(axes, data, row, place.panel.values[k])
        axes.set_ylim(_limits(data, k))
        axes.tick_params(labelleft=place.first)
        if place.first:
            axes.set_ylabel(row.label)
        if place.last:
            _label_measured(axes, row)
    if len(place.axes) > len(data.rows):
        strip = place.axes[-1]
        _draw_strip(strip, data, place.panel.unstable)
        if place.first:
            strip.set_ylabel("unstable", rotation=0, ha="right", va="center", size=8)


def _limits(data: LinesFigure, row: int) -> tuple[float, float]:
    """Return limits that hold a row's values in all panels, and what was measured."""
    values = [p.values[row].ravel() for band in data.bands for p in band.panels]
    known = np.concatenate([*values, [data.rows[row].measured]])
    known = known[np.isfinite(known)]
    if known.size == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    margin = 0.07 * (high - low) or 0.1 * abs(high) or 1.0
    return low - margin, high + margin


def _draw_curves(
    axes: Axes, data: LinesFigure, row: LinesRow, values: FloatArray
) -> None:
    if math.isfinite(row.measured):
        axes.axhline(row.measured, zorder=1, **MEASURED)
    for k, (colour, marker) in enumerate(_looks(data)):
        shown = np.isfinite(values[k]) | (not data.scattered)
        axes.plot(
            np.array(data.x.numbers())[shown],
            values[k][shown],
            color=colour,
            marker=marker,
            # Nothing lies between two categories.
            linestyle="-" if data.x.numeric else "none",
            markerfacecolor=colour if row.thick else "white",
            **(_THICK if row.thick else _THIN),
        )
    _set_x_axis(axes, data)


def _set_x_axis(axes: Axes, data: LinesFigure) -> None:
    x = data.x.numbers()
    if not data.x.numeric:
        axes.set_xticks(x, data.x.names, rotation=25, ha="right")
        axes.set_xlim(x[0] - 0.5, x[-1] + 0.5)
    elif data.log_x:
        axes.set_xscale("log")
        axes.set_xticks(x, [f"{value:g}" for value in x])
        axes.set_xticks([], minor=True)
        axes.tick_params(axis="x", labelsize=7.5)
        axes.set_xlim(min(x) / 1.3, max(x) * 1.3)
    else:
        axes.set_xmargin(0.08)


def _label_measured(axes: Axes, row: LinesRow) -> None:
    """Write beside the last panel what the dashed line is."""
    if math.isfinite(row.measured):
        axes.annotate(
            f"measured\n{row.measured:.1f} mm",
            (1.0, row.measured),
            (3, 0),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
        )


def _draw_strip(axes: Axes, data: LinesFigure, unstable: npt.NDArray[np.bool_]) -> None:
    """Draw a cross for each unstable run, a row for each line."""
    x = np.array(data.x.numbers())
    for k, (colour, _) in enumerate(_looks(data)):
        where = x[unstable[k]]
        axes.plot(where, np.full(where.size, k), "x", color=colour, markersize=3.5)
    axes.set_ylim(len(data.lines.values) - 0.3, -0.7)
    axes.set_yticks([])
    axes.tick_params(axis="x", direction="out", top=False)
    axes.set_facecolor("0.95")
    _set_x_axis(axes, data)


def _looks(data: LinesFigure) -> list[tuple[Any, str]]:
    """Return colour and marker of each line; numbers go from dark to light."""
    n = len(data.lines.values)
    colours: list[Any] = [body_colour(k) for k in range(n)]
    if data.lines.numeric and n > 2:
        colours = list(mpl.colormaps["plasma"](np.linspace(0.0, 0.87, n)))
    return [(c, MARKERS[k % len(MARKERS)]) for k, c in enumerate(colours)]


def _handles(data: LinesFigure, strip: bool) -> list[Line2D]:
    handles = [
        Line2D(
            [],
            [],
            color=colour,
            marker=marker,
            linestyle="-" if data.x.numeric else "none",
            label=name or "computed",
            **_THICK,
        )
        for name, (colour, marker) in zip(data.lines.names, _looks(data), strict=True)
    ]
    if any(math.isfinite(row.measured) for row in data.rows):
        handles.append(Line2D([], [], label="measured", **MEASURED))
    if strip:
        cross: dict[str, Any] = {"color": "0.2", "linestyle": "none", "markersize": 4.5}
        handles.append(Line2D([], [], marker="x", label="unstable run", **cross))
    # One line that has no name and stands alone explains itself.
    return handles if len(handles) > 1 or data.lines.names[0] else []
