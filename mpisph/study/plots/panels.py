"""What figures of several panels share: titles, and legend and note at the foot."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend

from mpisph.figures.style import DPI, WIDTH

MARKERS = ("o", "s", "^", "D", "v", "P", "<", "p", ">", "h")
"""Markers beside the colours of lines or dots; x is for unstable runs."""

_NOTE_WIDTH = 112
_NOTE_LINE = 0.135
# Letters in a line of the note below a figure, and height of a line [in].


def new_figure(height: float, title: str) -> Figure:
    """Return a figure with a title.

    Parameters
    ----------
    height : float
        Without what `finish` adds [in].
    title : str
        Plain text; it is wrapped.
    """
    figure = Figure(figsize=(WIDTH, height), dpi=DPI)
    FigureCanvasAgg(figure)
    # A dollar sign of the user's title begins no formula.
    wrapped = textwrap.fill(title, 88)
    figure.suptitle(wrapped, x=0.01, ha="left", fontsize=10, parse_math=False)
    return figure


def set_titles(axes: Axes, title: str, heading: str, first: bool) -> None:
    """Give a panel its title, and the first of a band the band's heading above it.

    Parameters
    ----------
    axes : Axes
    title : str
        Of the panel.
    heading : str
        Of its band; all panels leave room for it.
    first : bool
        Whether the panel is the first of its band.
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
    out_png: Path,
    legend_title: str = "",
) -> Path:
    """Add the legend and the note at the foot of a figure, and write it.

    The figure grows by what they need, so that its axes keep their height.

    Parameters
    ----------
    figure : Figure
        From `new_figure`.
    handles : sequence of artists
        Entries of the legend, with their labels.
    note : str
        Plain text; it is wrapped.
    out_png : Path
        Its folder is made where it is missing.
    legend_title : str, optional

    Returns
    -------
    Path
        The figure.

    Raises
    ------
    OSError
        If the figure cannot be written.
    """
    legend = _widest_legend(figure, handles, legend_title)
    lines = textwrap.wrap(note, _NOTE_WIDTH)
    note_height = 0.08 + _NOTE_LINE * len(lines)
    foot = note_height + legend.get_window_extent().height / DPI
    height = figure.get_figheight() + foot
    figure.set_figheight(height)
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
    out_png.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(out_png)
    return out_png


def _widest_legend(figure: Figure, handles: Sequence[Any], title: str) -> Legend:
    """Return a legend of as many columns as the figure is wide enough for."""
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
