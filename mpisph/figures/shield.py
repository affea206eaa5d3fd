"""A figure of a shield: cuts through bumpers, cloud and wall at chosen times."""

import textwrap
from collections.abc import Sequence
from typing import NamedTuple

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.analysis.shield_history import cloud_moments, wall_arrival
from mpisph.case import Case
from mpisph.case.contact import time_origin
from mpisph.figures.dots import Dots
from mpisph.figures.style import DPI, REAR_FACE, STYLE, WIDTH, Out, save
from mpisph.figures.view import View, common_view, only_finite, set_limits
from mpisph.io.probe_files import BODIES_FILE
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import StoredRun

SHIELD_FILE = "shield.png"

LEFT = 0.55
"""Room at the left of the panels [in]."""

_RIGHT, _BELOW, _GAP = 0.1, 0.62, 0.12
# Room at the right of them, below, and between them [in].

_LINE, _TITLE_LINE = 0.19, 0.16
# Height of a line of the title, and of one above a panel [in].

_TALLEST = 8.0
# Of all panels together [in]: a figure that fits on a page.

_NARROW = 1.8
# Width of a panel under which its label is short [in].

_COLUMNS = 5
# Of the legend.


class Grid(NamedTuple):
    """Panels of one scale in rows.

    Attributes
    ----------
    rows, columns : int
    width, height : float
        Of a panel [in].
    """

    rows: int
    columns: int
    width: float
    height: float


def draw_shield(run: StoredRun, out: Out) -> None:
    """Draw cuts through a shield, all in one view.

    Parameters
    ----------
    run : StoredRun
        Of a shield, with at least one snapshot.
    out : Path or BytesIO

    Raises
    ------
    OSError
        If a snapshot cannot be read or the figure cannot be written.
    """
    case = run.case
    times = [time for _, time in run.snapshots]
    arrival = wall_arrival(case, run.probes[BODIES_FILE])
    moments = cloud_moments(case, times, arrival)
    paths = [run.snapshots[moment.number][0] for moment in moments]
    view = common_view(paths, case, exposures=False)
    origin = time_origin(case.bodies, case.boundary)
    lines = [*textwrap.wrap(case.title, 88), f"times {origin}"]
    with mpl.rc_context(STYLE):
        figure, panels = make_panels(view, len(moments), lines, _RIGHT)
        for axes, path, moment in zip(panels, paths, moments, strict=True):
            when = f"{1e6 * times[moment.number]:.1f} µs: {moment.words}"
            axes.set_title(when, loc="left", fontsize=9.0, pad=4.0)
            draw_faces(axes, case)
            Dots(axes, case, view).show(only_finite(read_snapshot(path)))
        add_legend(figure, panels[0])
        save(figure, out)


def add_legend(figure: Figure, axes: Axes) -> None:
    """Explain below the panels what one of them shows."""
    handles, names = axes.get_legend_handles_labels()
    figure.legend(
        handles,
        names,
        loc="lower left",
        bbox_to_anchor=(LEFT / WIDTH - 0.01, 0.0),
        ncols=_COLUMNS,
    )


def draw_faces(axes: Axes, case: Case) -> None:
    """Draw in the original faces of bumpers and wall as thin lines.

    Parameters
    ----------
    axes : Axes
        Its legend gets one entry.
    case : Case
        With a shield.
    """
    label = "original faces"
    for body in case.bodies[1:]:
        radius = 1e3 * body.section.widest
        for z in body.section.ends:
            axes.vlines(1e3 * z, -radius, radius, label=label, zorder=1, **_FACE)
            label = "_" + label


_FACE = {
    "colors": REAR_FACE["color"],
    "linestyles": REAR_FACE["linestyle"],
    "linewidths": 0.5,
}


def make_panels(
    view: View, count: int, lines: Sequence[str], right: float, title_lines: int = 1
) -> tuple[Figure, list[Axes]]:
    """Return a figure with panels that share the limits of a view.

    Parameters
    ----------
    view : View
    count : int
        Number of panels.
    lines : sequence of str
        Title above them all.
    right : float
        Room at the right of all [in].
    title_lines : int, optional
        Lines above each panel.

    Returns
    -------
    Figure
    list of Axes
        By rows. Labels stand at the left and below alone.
    """
    between = _TITLE_LINE * title_lines + 0.06 + _GAP
    grid = choose_grid(view, count, WIDTH - LEFT - right, between)
    top = 0.12 + _LINE * len(lines)
    tall = top + grid.rows * (grid.height + between) + _BELOW
    figure = Figure(figsize=(WIDTH, tall), dpi=DPI)
    # A dollar sign of the user's title begins no formula.
    figure.text(
        LEFT / WIDTH,
        1.0 - 0.07 / tall,
        "\n".join(lines),
        va="top",
        fontsize=10.0,
        parse_math=False,
    )
    label = "axial position z [mm]" if grid.width > _NARROW else "z [mm]"
    panels = []
    for index in range(count):
        row, column = divmod(index, grid.columns)
        x = LEFT + column * (grid.width + _GAP)
        y = tall - top - (row + 1) * (grid.height + between) + _GAP
        box = (x / WIDTH, y / tall, grid.width / WIDTH, grid.height / tall)
        axes = figure.add_axes(box)
        set_limits(axes, view)
        if column == 0:
            axes.set_ylabel("radius r [mm]")
        else:
            axes.tick_params(labelleft=False)
        if index + grid.columns >= count:
            axes.set_xlabel(label)
        else:
            axes.tick_params(labelbottom=False)
        panels.append(axes)
    return figure, panels


def choose_grid(view: View, count: int, width: float, between: float) -> Grid:
    """Return the arrangement of panels in which they are largest.

    Parameters
    ----------
    view : View
        What each of them shows.
    count : int
        Number of panels.
    width : float
        Of all columns [in].
    between : float
        Height of what stands between rows [in].
    """
    grids = []
    for columns in range(1, count + 1):
        rows = -(-count // columns)
        wide = (width - (columns - 1) * _GAP) / columns
        wide = min(wide, (_TALLEST / rows - between) / view.aspect)
        grids.append(Grid(rows, columns, wide, wide * view.aspect))
    return max(grids, key=lambda grid: (round(grid.width, 6), -grid.rows))
