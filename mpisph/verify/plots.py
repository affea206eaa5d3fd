"""Figures of verification problems: particles beside the exact solution."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.lines import Line2D

from mpisph.figures.style import MEASURED, Out, body_colour
from mpisph.study.plots.panels import MARKERS, finish, panel_grid

_MOST_DOTS = 6000
# More of them only cover each other.

_HEIGHT = 2.9
# Of a row of panels [in].

Curve = tuple[npt.ArrayLike, npt.ArrayLike]
"""Abscissae and ordinates."""


class Panel(NamedTuple):
    """Axes with computed dots and an exact line.

    Attributes
    ----------
    x_label, y_label : str
        With their units.
    dots : mapping of str to Curve
        Computed points by what they are; the same name has the same colour everywhere.
    exact : Curve or None
        A line; it limits the abscissa where `x_limits` does not.
    x_limits : tuple of float, optional
    title : str, optional
    log : bool, optional
        Whether both axes are logarithmic.
    """

    x_label: str
    y_label: str
    dots: Mapping[str, Curve]
    exact: Curve | None
    x_limits: tuple[float, float] | None = None
    title: str = ""
    log: bool = False


def draw_panels(title: str, panels: Sequence[Panel], out: Out, note: str = "") -> None:
    """Draw panels beside each other, with one legend.

    Parameters
    ----------
    title : str
    panels : sequence of Panel
        One to three.
    out : Path or BytesIO
        See `figures.style.save`.
    note : str, optional
        Plain text below.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    names = list(dict.fromkeys(name for panel in panels for name in panel.dots))
    looks: dict[str, dict[str, Any]] = {
        name: {
            "color": body_colour(index),
            "marker": MARKERS[index % len(MARKERS)],
            "markersize": 2.2,
            "linestyle": "none",
            "markeredgewidth": 0.0,
        }
        for index, name in enumerate(names)
    }
    with panel_grid(title, _HEIGHT, 1, len(panels)) as (figure, grid):
        for panel, axes in zip(panels, grid[0], strict=True):
            axes.set_title(panel.title, fontsize=9)
            for name, (x, y) in panel.dots.items():
                step = max(np.size(x) // _MOST_DOTS, 1)
                x, y = np.ravel(x)[::step], np.ravel(y)[::step]
                axes.plot(x, y, **looks[name], rasterized=True)
            if panel.log:
                axes.set_xscale("log")
                axes.set_yscale("log")
            limits = panel.x_limits
            if panel.exact is not None:
                x, y = np.ravel(panel.exact[0]), np.ravel(panel.exact[1])
                axes.plot(x, y, **MEASURED)
                if limits is None and x.size > 1:
                    limits = (x.min(), x.max())
            if limits is not None:
                axes.set_xlim(*limits)
            axes.set_xlabel(panel.x_label)
            axes.set_ylabel(panel.y_label)
        handles = [
            Line2D([], [], label=name, **{**look, "markersize": 5})
            for name, look in looks.items()
        ]
        if any(panel.exact is not None for panel in panels):
            handles.append(Line2D([], [], label="exact", **MEASURED))
        finish(figure, handles, note, out)
