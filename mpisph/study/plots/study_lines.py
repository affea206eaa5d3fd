"""The figure of quantities over a parameter: a line for each value of another."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from mpisph.core.particles import FloatArray
from mpisph.figures.style import BODY_COLOURS, MEASURED, STYLE, WIDTH
from mpisph.study.plots.panels import MARKERS, finish, new_figure, set_titles

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
        A measured value, drawn across; NaN where there is none.
    unit : str
        Of the measured value.
    """

    label: str
    thick: bool
    measured: float
    unit: str


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


class LinesBand(NamedTuple):
    """Panels that stand beside each other, with a heading."""

    heading: str
    panels: Sequence[LinesPanel]


class LinesFigure(NamedTuple):
    """Quantities over a parameter.

    Attributes
    ----------
    title : str
    x_label : str
    x : sequence of float or of str, length points
        Numbers, or names of categories.
    log_x : bool
        Whether the axis of numbers is logarithmic.
    lines_label : str
        What the lines stand for.
    lines : sequence of str
        Name of each line.
    ordered : bool
        Whether the lines stand for a sequence of numbers.
    rows : sequence of LinesRow
    bands : sequence of LinesBand
    note : str
        Text below the figure.
    """

    title: str
    x_label: str
    x: Sequence[float] | Sequence[str]
    log_x: bool
    lines_label: str
    lines: Sequence[str]
    ordered: bool
    rows: Sequence[LinesRow]
    bands: Sequence[LinesBand]
    note: str


def draw_lines(data: LinesFigure, out_png: Path) -> Path:
    """Draw quantities over a parameter: a line for each value of another.

    Below the axes a strip has a row for each line, with a cross where the run is
    unstable, so that such runs are not silently missing.

    Parameters
    ----------
    data : LinesFigure
    out_png : Path
        Its folder is made where it is missing.

    Returns
    -------
    Path
        The figure.

    Raises
    ------
    OSError
        If the figure cannot be written.
    """
    columns = max(len(band.panels) for band in data.bands)
    strip = any(panel.unstable.any() for b in data.bands for panel in b.panels)
    row_height = float(np.clip(1.1 * WIDTH / columns, 1.5, 2.2))
    strip_height = (0.12 + 0.05 * len(data.lines)) * strip
    heights = [row_height] * len(data.rows) + [strip_height] * strip
    extra = 0.35 + 0.3 * bool(data.bands[0].heading)
    height = len(data.bands) * (sum(heights) + extra) + 0.6
    with mpl.rc_context(STYLE):
        figure = new_figure(height, data.title)
        grid = figure.subplots(
            len(data.bands) * len(heights),
            columns,
            squeeze=False,
            sharex=True,
            height_ratios=heights * len(data.bands),
        )
        for k, band in enumerate(data.bands):
            axes = grid[k * len(heights) : (k + 1) * len(heights)]
            _draw_band(axes, data, band)
        for axis in grid[-1]:
            axis.set_xlabel(data.x_label, parse_math=False)
        handles = _line_handles(data, strip)
        return finish(figure, handles, data.note, out_png, data.lines_label)


def _draw_band(
    grid: npt.NDArray[np.object_], data: LinesFigure, band: LinesBand
) -> None:
    """Draw the panels of a band, with the strip of unstable runs at their foot."""
    limits = [_limits(data, k) for k in range(len(data.rows))]
    for j, panel in enumerate(band.panels):
        set_titles(grid[0, j], panel.title, band.heading, first=j == 0)
        for k, row in enumerate(data.rows):
            axes = grid[k, j]
            _draw_curves(axes, data, row, panel.values[k])
            axes.set_ylim(limits[k])
            axes.tick_params(labelleft=j == 0)
            if j == len(band.panels) - 1:
                _label_measured(axes, row)
        if len(grid) > len(data.rows):
            _draw_strip(grid[-1, j], data, panel.unstable)
    for k, row in enumerate(data.rows):
        grid[k, 0].set_ylabel(row.label)
    if len(grid) > len(data.rows):
        grid[-1, 0].set_ylabel("unstable", rotation=0, ha="right", va="center", size=8)
    for axes in grid[:, len(band.panels) :].ravel():
        axes.set_axis_off()


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


def _positions(x: Sequence[float] | Sequence[str]) -> FloatArray:
    """Return numbers as they are, and categories at whole numbers."""
    if any(isinstance(value, str) for value in x):
        return np.arange(len(x), dtype=np.float64)
    return np.array(x, dtype=np.float64)


def _draw_curves(
    axes: Axes, data: LinesFigure, row: LinesRow, values: FloatArray
) -> None:
    x = _positions(data.x)
    categories = isinstance(data.x[0], str)
    if math.isfinite(row.measured):
        axes.axhline(row.measured, zorder=1, **MEASURED)
    for k, (colour, marker) in enumerate(_looks(data)):
        axes.plot(
            x,
            values[k],
            color=colour,
            marker=marker,
            # Nothing lies between two categories.
            linestyle="none" if categories else "-",
            markerfacecolor=colour if row.thick else "white",
            **(_THICK if row.thick else _THIN),
        )
    _set_x_axis(axes, data, x)


def _set_x_axis(axes: Axes, data: LinesFigure, x: FloatArray) -> None:
    if isinstance(data.x[0], str):
        axes.set_xticks(x, [str(name) for name in data.x], rotation=25, ha="right")
        axes.set_xlim(x[0] - 0.5, x[-1] + 0.5)
    elif data.log_x:
        axes.set_xscale("log")
        axes.set_xticks(x, [f"{value:g}" for value in x])
        axes.set_xticks([], minor=True)
        axes.tick_params(axis="x", labelsize=7.5)
        axes.set_xlim(x.min() / 1.3, x.max() * 1.3)
    else:
        axes.set_xmargin(0.08)


def _label_measured(axes: Axes, row: LinesRow) -> None:
    """Write beside the last panel what the dashed line is."""
    if math.isfinite(row.measured):
        axes.annotate(
            f"measured\n{row.measured:.1f} {row.unit}",
            (1.0, row.measured),
            (3, 0),
            xycoords=axes.get_yaxis_transform(),
            textcoords="offset points",
            va="center",
            fontsize=7.5,
        )


def _draw_strip(axes: Axes, data: LinesFigure, unstable: npt.NDArray[np.bool_]) -> None:
    """Draw a cross for each unstable run, a row for each line."""
    x = _positions(data.x)
    for k, (colour, _) in enumerate(_looks(data)):
        where = x[unstable[k]]
        axes.plot(where, np.full(where.size, k), "x", color=colour, markersize=3.5)
    axes.set_ylim(len(data.lines) - 0.3, -0.7)
    axes.set_yticks([])
    axes.tick_params(axis="x", direction="out", top=False)
    axes.set_facecolor("0.95")
    _set_x_axis(axes, data, x)


def _looks(data: LinesFigure) -> list[tuple[Any, str]]:
    """Return colour and marker of each line; numbers go from dark to light."""
    n = len(data.lines)
    colours: list[Any] = [BODY_COLOURS[k % len(BODY_COLOURS)] for k in range(n)]
    if data.ordered and n > 2:
        colours = list(mpl.colormaps["plasma"](np.linspace(0.0, 0.87, n)))
    return [(c, MARKERS[k % len(MARKERS)]) for k, c in enumerate(colours)]


def _line_handles(data: LinesFigure, strip: bool) -> list[Line2D]:
    categories = isinstance(data.x[0], str)
    handles = [
        Line2D(
            [],
            [],
            color=colour,
            marker=marker,
            linestyle="none" if categories else "-",
            label=name,
            **_THICK,
        )
        for name, (colour, marker) in zip(data.lines, _looks(data), strict=True)
    ]
    if any(math.isfinite(row.measured) for row in data.rows):
        handles.append(Line2D([], [], label="measured", **MEASURED))
    if strip:
        cross: dict[str, Any] = {"color": "0.2", "linestyle": "none", "markersize": 4.5}
        handles.append(Line2D([], [], marker="x", label="unstable run", **cross))
    return handles
