"""Figures of the error, or of a column: maps over two parameters, by a third."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap, Normalize
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mpisph.core.particles import FloatArray
from mpisph.figures.style import Out
from mpisph.study.columns import column_label
from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.paper.ranges import TOTALS, agreement
from mpisph.study.plots.axes import (
    Axis,
    Clock,
    axis_of,
    by_axes,
    clock_text,
    is_unstable,
    status_note,
    value_at,
)
from mpisph.study.plots.panels import (
    Band,
    Grid,
    each_panel,
    finish,
    in_rows,
    panel_grid,
)
from mpisph.study.table import Row

DEFAULT_LIMIT = 10.0
"""Error that a map is centred on where the paper gives no limit [%]."""

LEVELS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Classes of a map's colours, as multiples of the limit."""

_ERRORS = "mean of the absolute errors [%]"

_HALO = [patheffects.withStroke(linewidth=3.0, foreground="white")]
_HATCHED: dict[str, Any] = {"facecolor": "0.93", "edgecolor": "0.55", "hatch": "//////"}


class MapPanel(NamedTuple):
    """A map over two parameters.

    Attributes
    ----------
    title : str
    values : ndarray, shape (y, x)
        NaN where there is none.
    unstable : ndarray of bool, shape (y, x)
        Runs that broke down.
    ranges : sequence, length x
        For each value along x: None where the paper says nothing; ends of the range
        along y that it gives; the empty tuple where it names none.
    """

    title: str
    values: FloatArray
    unstable: npt.NDArray[np.bool_]
    ranges: Sequence[tuple[float, float] | tuple[()] | None]


class MapFigure(NamedTuple):
    """Maps of the error, or of a column of the table.

    Attributes
    ----------
    title : str
    x, y : Axis
        Their values are evenly spaced; those of y are numbers in ascending order.
    label : str
        What the colours stand for.
    limit : float or None
        Error below which cells are outlined, at the middle of the colours [%]; None
        where no error is shown.
    bands : sequence of Band
    note : str
        Text below the figure.
    """

    title: str
    x: Axis
    y: Axis
    label: str
    limit: float | None
    bands: Sequence[Band[MapPanel]]
    note: str


def map_figure(study: Study, spec: FigureSpec, rows: Sequence[Row]) -> MapFigure:
    """Return what is drawn over two or three parameters: a column, or the total error.

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

    def panel(value: Value, title: str, column: str) -> MapPanel:
        cells = [[table.get((i, j, value)) for i in x.values] for j in y.values]
        values = [[value_at(row, column) for row in line] for line in cells]
        unstable = [[is_unstable(row) for row in line] for line in cells]
        at = [{x.name: i, panels.name: value} for i in x.values]
        ranges = [_ends(study, settings, y) for settings in at]
        return MapPanel(title, np.array(values), np.array(unstable), ranges)

    columns = dict.fromkeys(study.drawn, "") or {
        TOTALS[clock]: clock_text(study, clock) + _alike(study, rows, clock)
        for clock in spec.clocks
    }
    bands: list[Band[MapPanel]] = []
    for column, heading in columns.items():
        maps = [
            panel(value, title, column)
            for value, title in zip(panels.values, panels.titles(), strict=True)
        ]
        bands += in_rows(heading, maps)
    errors = not study.drawn
    return MapFigure(
        title=study.file.title,
        x=x,
        y=y,
        label=_ERRORS if errors else column_label(study.drawn[0]),
        limit=(study.file.paper.limit_percent or DEFAULT_LIMIT) if errors else None,
        bands=bands,
        note=_note(study, rows) if errors else f"Blank: no run. {status_note(rows)}",
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


def draw_map(data: MapFigure, out: Out) -> None:
    """Draw the error over two parameters, a panel for each value of a third."""
    columns = max(len(band.panels) for band in data.bands)
    rows = len(data.bands)
    height = rows * (float(np.clip(0.125 * len(data.y.values), 1.2, 3.0)) + 0.5) + 1.4
    norm, colours, ticks = _colours(data)
    options = {"sharex": True, "sharey": True}
    with panel_grid(data.title, height, rows, columns, **options) as (figure, grid):
        for place in each_panel(grid, data.bands):
            (axes,) = place.axes
            _draw_cells(axes, place.panel, data.limit, norm, colours)
            _draw_ranges(axes, place.panel, data.y.numbers())
        _label_maps(grid, data)
        bar = figure.colorbar(
            ScalarMappable(norm, colours),
            ax=grid,
            location="bottom",
            aspect=55,
            pad=0.01,
            extend="max" if ticks else "neither",
            ticks=ticks,
            format="%g",
        )
        bar.set_label(data.label)
        finish(figure, _handles(data), data.note, out)


def _colours(data: MapFigure) -> tuple[Normalize, Colormap, list[float] | None]:
    """Return what gives values their colours, and the ticks of the bar."""
    if data.limit is not None:
        norm, colours = _error_colours(data.limit)
        return norm, colours, [0.0, *(level * data.limit for level in LEVELS)]
    panels = [panel for band in data.bands for panel in band.panels]
    values = np.concatenate([panel.values.ravel() for panel in panels])
    known = values[np.isfinite(values)]
    low, high = (known.min(), known.max()) if known.size else (0.0, 1.0)
    return Normalize(low, high), mpl.colormaps["viridis"], None


def _error_colours(limit: float) -> tuple[BoundaryNorm, Colormap]:
    """Return classes whose colour turns from blue to orange at the limit."""
    below = LEVELS.index(1.0) + 1
    above = len(LEVELS) - below
    source = mpl.colormaps["PuOr_r"]
    colours = ListedColormap(
        [
            *source(np.linspace(0.06, 0.4, below)),
            *source(np.linspace(0.6, 1.0, above + 1)),
        ]
    )
    boundaries = [0.0, *(level * limit for level in LEVELS)]
    return BoundaryNorm(boundaries, colours.N, extend="max"), colours


def _draw_cells(
    axes: Axes,
    panel: MapPanel,
    limit: float | None,
    norm: Normalize,
    colours: Colormap,
) -> None:
    """Draw the cells, those of unstable runs hatched; outline those below the limit."""
    shown = np.where(panel.unstable, np.nan, panel.values)
    ny, nx = shown.shape
    x, y = np.arange(nx + 1) - 0.5, np.arange(ny + 1) - 0.5
    axes.pcolormesh(x, y, shown, norm=norm, cmap=colours)
    if panel.unstable.any():
        hatched = np.ma.masked_where(~panel.unstable, np.ones_like(shown))
        plain = ListedColormap([_HATCHED["facecolor"]])
        cells = axes.pcolor(x, y, hatched, cmap=plain, hatch=_HATCHED["hatch"])
        cells.set_edgecolor(_HATCHED["edgecolor"])
        cells.set_linewidth(0.0)
    if limit is None:
        return
    below = np.nan_to_num(shown, nan=np.inf) < limit
    edges = LineCollection(_outline(below), colors="black", linewidths=1.1, zorder=3)
    axes.add_collection(edges)


def _outline(inside: npt.NDArray[np.bool_]) -> list[list[tuple[float, float]]]:
    """Return the edges between cells inside and outside, as segments."""
    padded = np.pad(inside, 1)
    segments = []
    for j, i in zip(*np.nonzero(padded[:, 1:] != padded[:, :-1]), strict=True):
        segments.append([(i - 0.5, j - 1.5), (i - 0.5, j - 0.5)])
    for j, i in zip(*np.nonzero(padded[1:] != padded[:-1]), strict=True):
        segments.append([(i - 1.5, j - 0.5), (i - 0.5, j - 0.5)])
    return [[(float(x), float(y)) for x, y in segment] for segment in segments]


def _draw_ranges(axes: Axes, panel: MapPanel, y_numbers: Sequence[float]) -> None:
    """Draw the paper's range into each column; ``none`` where it names none."""
    line: dict[str, Any] = {
        "color": "black",
        "linewidth": 1.3,
        "markersize": 4.5,
        "markeredgewidth": 1.3,
        "path_effects": _HALO,
        "zorder": 4,
    }
    top = len(y_numbers) - 0.5
    for i, ends in enumerate(panel.ranges):
        if ends is None:
            continue
        if not ends:
            axes.text(
                i,
                0.5 * (len(y_numbers) - 1),
                "none",
                rotation=90,
                ha="center",
                va="center",
                fontsize=8,
                path_effects=_HALO,
                zorder=4,
            )
            continue
        low, high = (_index_of(end, y_numbers) for end in ends)
        axes.plot([i, i], [low, high], marker="_", **line)
        if high >= top:
            axes.plot([i], [top], marker="^", **{**line, "markersize": 3.0})


def _index_of(value: float, numbers: Sequence[float]) -> float:
    """Return where a value lies among evenly drawn numbers, within half a cell."""
    n = len(numbers)
    if value < numbers[0] or n == 1:
        first = numbers[1] - numbers[0] if n > 1 else 1.0
        return max((value - numbers[0]) / first, -0.5)
    if value > numbers[-1]:
        last = numbers[-1] - numbers[-2]
        return min(n - 1 + (value - numbers[-1]) / last, n - 0.5)
    return float(np.interp(value, numbers, np.arange(n)))


def _label_maps(grid: Grid, data: MapFigure) -> None:
    x, y = data.x.names, data.y.names
    crowded = grid.shape[1] * len(x) > 30
    step = 1 + (len(y) - 1) // 12
    for axes in grid.ravel():
        axes.tick_params(length=0, labelsize=7.5)
    for axes in grid[-1]:
        axes.set_xticks(range(len(x)), x, rotation=90 if crowded else 0)
        axes.set_xlabel(data.x.title, parse_math=False)
    for axes in grid[:, 0]:
        # Counted from the second, as 0.5 1.0 1.5 ... gives whole numbers.
        axes.set_yticks(range(step - 1, len(y), step), y[step - 1 :: step])
        axes.set_ylabel(data.y.title, parse_math=False)


def _handles(data: MapFigure) -> list[Any]:
    panels = [panel for band in data.bands for panel in band.panels]
    handles: list[Any] = []
    below = ""
    if data.limit is not None:
        below = f"below {data.limit:g} %"
        handles = [Patch(facecolor="none", edgecolor="black", label=below)]
    if any(panel.unstable.any() for panel in panels):
        handles.append(Patch(label="unstable run", linewidth=0.0, **_HATCHED))
    if any(ends for panel in panels for ends in panel.ranges):
        text = f"the paper's range {below}"
        handles.append(Line2D([], [], label=text, color="black", marker="|"))
    return handles
