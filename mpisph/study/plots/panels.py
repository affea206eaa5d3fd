"""The panel grid of all study figures: title, bands of panels, legend and note."""

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Generic, NamedTuple, TypeVar

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from mpisph.figures.style import DPI, STYLE, WIDTH, Out, save

MARKERS = ("o", "s", "^", "D", "v", "P", "<", "p", ">", "h")
"""Markers beside the colours of lines or dots; x is for unstable runs."""

MOST_ACROSS = 8
"""Panels beside each other; more begin a further row."""

_NOTE_WIDTH = 112
_NOTE_LINE = 0.135
# Letters in a line of the note below a figure, and height of a line [in].

Grid = npt.NDArray[np.object_]
"""Axes, shape (rows, columns)."""

Panel = TypeVar("Panel")


class Band(NamedTuple, Generic[Panel]):
    """Panels that stand beside each other, with a heading; each has a `title`."""

    heading: str
    panels: Sequence[Panel]


class PanelAxes(NamedTuple, Generic[Panel]):
    """A panel with its axes.

    Attributes
    ----------
    panel : Panel
    axes : ndarray of Axes, shape (rows,)
        Those of the panel, from the top.
    first, last : bool
        Whether it stands at the left or the right end of its band.
    """

    panel: Panel
    axes: Grid
    first: bool
    last: bool


def in_rows(heading: str, panels: Sequence[Panel]) -> list[Band[Panel]]:
    """Return panels in bands of at most `MOST_ACROSS`, the first with the heading."""
    return [
        Band(heading if k == 0 else "", panels[k : k + MOST_ACROSS])
        for k in range(0, len(panels), MOST_ACROSS)
    ]


@contextmanager
def panel_grid(
    title: str, height: float, rows: int, columns: int, **options: Any
) -> Iterator[tuple[Figure, Grid]]:
    """Make a figure with a title and a grid of axes, to be drawn within this context.

    Parameters
    ----------
    title : str
        Plain text; it is wrapped.
    height : float
        Without what `finish` adds [in].
    rows, columns : int
    **options
        Of `Figure.subplots`.

    Yields
    ------
    figure : Figure
    grid : ndarray of Axes, shape (rows, columns)
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, height), dpi=DPI)
        FigureCanvasAgg(figure)
        # A dollar sign of the user's title begins no formula.
        wrapped = textwrap.fill(title, 88)
        figure.suptitle(wrapped, x=0.01, ha="left", fontsize=10, parse_math=False)
        yield figure, figure.subplots(rows, columns, squeeze=False, **options)


def each_panel(grid: Grid, bands: Sequence[Band[Any]]) -> Iterator[PanelAxes[Any]]:
    """Give each panel its title, and return it with its axes.

    Where a band has fewer panels than the grid has columns, the rest stays blank.
    """
    rows = len(grid) // len(bands)
    for k, band in enumerate(bands):
        part = grid[k * rows : (k + 1) * rows]
        last = len(band.panels) - 1
        for j, panel in enumerate(band.panels):
            _set_titles(part[0, j], panel.title, band.heading, first=j == 0)
            yield PanelAxes(panel, part[:, j], j == 0, j == last)
        for axes in part[:, last + 1 :].ravel():
            axes.set_axis_off()


def _set_titles(axes: Axes, title: str, heading: str, first: bool) -> None:
    """Give a panel its title, and the first of a band the band's heading above it.

    All panels of a band with a heading leave room for it.
    """
    room = "\n" * bool(heading)
    columns = axes.get_gridspec().ncols  # type: ignore[union-attr]
    size = 9 if columns < 4 else 8
    axes.set_title(
        f"{room}{title}",
        fontsize=size,
        linespacing=1.5 if heading else 1.2,
        parse_math=False,
    )
    if heading and first:
        lines = 1 + title.count("\n") if title else 0
        axes.annotate(
            heading,
            (0.0, 1.0),
            (0, 9 + 12 * lines),
            xycoords="axes fraction",
            textcoords="offset points",
            fontsize=9.5,
            fontweight="bold",
            parse_math=False,
            # The heading may be wider than its axes; its room is the title's.
            in_layout=False,
        )


def finish(
    figure: Figure,
    handles: Sequence[Any],
    note: str,
    out: Out,
    legend_title: str = "",
) -> None:
    """Add the legend and the note at the foot of a figure, and write it.

    The figure grows by what they need, so that its axes keep their height.

    Parameters
    ----------
    figure : Figure
        From `panel_grid`.
    handles : sequence of artists
        Entries of the legend, with their labels; without any there is no legend.
    note : str
        Plain text; it is wrapped.
    out : Path or BytesIO
        See `save`.
    legend_title : str, optional
    """
    lines = textwrap.wrap(note, _NOTE_WIDTH)
    foot = note_height = 0.08 + _NOTE_LINE * len(lines)
    legend = _widest_legend(figure, handles, legend_title)
    if legend is not None:
        foot += legend.get_window_extent().height / DPI
    height = figure.get_figheight() + foot
    figure.set_figheight(height)
    if legend is not None:
        legend.set_bbox_to_anchor((0.5, note_height / height), figure.transFigure)
    figure.text(
        0.01,
        0.05 / height,
        "\n".join(lines),
        fontsize=7.5,
        color="0.3",
        in_layout=False,
        parse_math=False,
    )
    share = foot / height
    figure.set_layout_engine("constrained", rect=(0, share, 1, 1 - share))
    save(figure, out)


def _widest_legend(figure: Figure, handles: Sequence[Any], title: str) -> Legend | None:
    """Return a legend of as many columns as the figure is wide enough for."""
    legend = None
    room = 0.98 * WIDTH * DPI
    for rows in range(1, len(handles) + 1):
        columns = math.ceil(len(handles) / rows)
        legend = figure.legend(
            handles=handles,
            loc="lower center",
            bbox_to_anchor=(0.5, 0.0),
            borderaxespad=0.0,
            ncols=columns,
            title=title or None,
        )
        legend.set_in_layout(False)
        for text in legend.get_texts():
            text.set_parse_math(False)
        if rows == len(handles) or legend.get_window_extent().width < room:
            break
        legend.remove()
    return legend
