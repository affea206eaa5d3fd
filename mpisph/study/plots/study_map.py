"""The figure of the error over two parameters, a map for each value of a third."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import BoundaryNorm, Colormap, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mpisph.core.particles import FloatArray
from mpisph.figures.style import STYLE
from mpisph.study.plots.panels import finish, new_figure, set_titles

LEVELS = (0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0)
"""Classes of a map's colours, as multiples of the limit."""

_HALO = [patheffects.withStroke(linewidth=3.0, foreground="white")]
_HATCHED: dict[str, Any] = {"facecolor": "0.93", "edgecolor": "0.55", "hatch": "//////"}


class MapPanel(NamedTuple):
    """A map of the error over two parameters.

    Attributes
    ----------
    title : str
    errors : ndarray, shape (y, x)
        [%]; NaN where there is none.
    unstable : ndarray of bool, shape (y, x)
        Runs that broke down.
    ranges : sequence, length x
        For each value along x: None where the paper says nothing; ends of the range
        along y that it gives; the empty tuple where it names none.
    """

    title: str
    errors: FloatArray
    unstable: npt.NDArray[np.bool_]
    ranges: Sequence[tuple[float, float] | tuple[()] | None]


class MapBand(NamedTuple):
    """Maps that stand beside each other, with a heading."""

    heading: str
    panels: Sequence[MapPanel]


class MapFigure(NamedTuple):
    """Maps of the error.

    Attributes
    ----------
    title : str
    x_label, y_label : str
    x, y : sequence of str
        Values along the axes, evenly spaced.
    y_numbers : sequence of float
        Those along y as numbers, in ascending order: where ranges are drawn.
    limit : float
        Error below which cells are outlined, at the middle of the colours [%].
    bands : sequence of MapBand
    note : str
        Text below the figure.
    """

    title: str
    x_label: str
    y_label: str
    x: Sequence[str]
    y: Sequence[str]
    y_numbers: Sequence[float]
    limit: float
    bands: Sequence[MapBand]
    note: str


def draw_map(data: MapFigure, out_png: Path) -> Path:
    """Draw the error over two parameters, a panel for each value of a third.

    Parameters
    ----------
    data : MapFigure
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
    row_height = float(np.clip(0.125 * len(data.y), 1.2, 3.0)) + 0.5
    norm, colours = _error_colours(data.limit)
    with mpl.rc_context(STYLE):
        figure = new_figure(len(data.bands) * row_height + 1.4, data.title)
        grid = figure.subplots(
            len(data.bands), columns, squeeze=False, sharex=True, sharey=True
        )
        for axes, band in zip(grid, data.bands, strict=True):
            for j, panel in enumerate(band.panels):
                set_titles(axes[j], panel.title, band.heading, first=j == 0)
                _draw_errors(axes[j], panel, data.limit, norm, colours)
                _draw_ranges(axes[j], panel, data.y_numbers)
            for empty in axes[len(band.panels) :]:
                empty.set_axis_off()
        _label_maps(grid, data)
        bar = figure.colorbar(
            ScalarMappable(norm, colours),
            ax=grid,
            location="bottom",
            aspect=55,
            pad=0.01,
            extend="max",
            ticks=[0.0, *(level * data.limit for level in LEVELS)],
            format="%g",
        )
        bar.set_label("mean of the absolute errors [%]")
        return finish(figure, _handles(data), data.note, out_png)


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


def _draw_errors(
    axes: Axes, panel: MapPanel, limit: float, norm: BoundaryNorm, colours: Colormap
) -> None:
    """Draw the cells, those of unstable runs hatched; outline those below the limit."""
    shown = np.where(panel.unstable, np.nan, panel.errors)
    ny, nx = shown.shape
    x, y = np.arange(nx + 1) - 0.5, np.arange(ny + 1) - 0.5
    axes.pcolormesh(x, y, shown, norm=norm, cmap=colours)
    if panel.unstable.any():
        hatched = np.ma.masked_where(~panel.unstable, np.ones_like(shown))
        plain = ListedColormap([_HATCHED["facecolor"]])
        cells = axes.pcolor(x, y, hatched, cmap=plain, hatch=_HATCHED["hatch"])
        cells.set_edgecolor(_HATCHED["edgecolor"])
        cells.set_linewidth(0.0)
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


def _label_maps(grid: npt.NDArray[np.object_], data: MapFigure) -> None:
    crowded = grid.shape[1] * len(data.x) > 30
    step = 1 + (len(data.y) - 1) // 12
    for axes in grid.ravel():
        axes.tick_params(length=0, labelsize=7.5)
    for axes in grid[-1]:
        names = range(len(data.x))
        axes.set_xticks(names, data.x, rotation=90 if crowded else 0)
        axes.set_xlabel(data.x_label, parse_math=False)
    for axes in grid[:, 0]:
        # Counted from the second, as 0.5 1.0 1.5 ... gives whole numbers.
        where = range(step - 1, len(data.y), step)
        axes.set_yticks(where, [data.y[k] for k in where])
        axes.set_ylabel(data.y_label, parse_math=False)


def _handles(data: MapFigure) -> list[Any]:
    panels = [panel for band in data.bands for panel in band.panels]
    below = f"below {data.limit:g} %"
    handles: list[Any] = [Patch(facecolor="none", edgecolor="black", label=below)]
    if any(panel.unstable.any() for panel in panels):
        handles.append(Patch(label="unstable run", linewidth=0.0, **_HATCHED))
    if any(ends for panel in panels for ends in panel.ranges):
        text = f"the paper's range {below}"
        handles.append(Line2D([], [], label=text, color="black", marker="|"))
    return handles
