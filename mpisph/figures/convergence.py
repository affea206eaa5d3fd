"""The figure of a convergence study: quantities against the spacing, to its limit."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.analysis.convergence import Convergence
from mpisph.figures.style import BODY_COLOURS, DPI, MEASURED, STYLE, WIDTH

NOTE = (
    "At ∞: Richardson's extrapolation, with the uncertainty of the finest value as its "
    "bar. An open mark is the finest value, where nothing is extrapolated; without a "
    "bar the values diverge. p: observed order of the finest three. Dashed: measured."
)
"""What the figure shows, below it."""

_PANEL_HEIGHT = 2.5
# Height of a row of panels [in].

_POINTS = 100
# Of the curve through the finest levels.

_LEGEND_COLUMNS = 2

_LABEL_WIDTH = 0.06
# Labels of the axis need this distance, as a fraction of it.

_MARKERS = ("o", "s", "^", "D", "v", "P")

_NUDGE = 0.025
# Distance between the error bars of two series, as a fraction of the axis to the right
# of ∞.


class ConvergenceSeries(NamedTuple):
    """A figure of one shot at several resolutions.

    Attributes
    ----------
    name : str
        Of the shot.
    convergence : Convergence
        With the resolutions and the values, in SI units.
    measured : float or None
        What the experiment gave, in SI units.
    """

    name: str
    convergence: Convergence
    measured: float | None = None


class ConvergencePanel(NamedTuple):
    """One quantity, of one or several shots.

    Attributes
    ----------
    quantity : str
        Its name; a formula stands between dollar signs.
    unit : str
        Such as ``mm``.
    series : sequence of ConvergenceSeries
    scale : float
        How many of the unit one SI unit is, such as 1000 for mm.
    """

    quantity: str
    unit: str
    series: Sequence[ConvergenceSeries]
    scale: float = 1.0


def draw_convergence(panels: Sequence[ConvergencePanel], out_png: Path) -> Path:
    """Draw quantities against 1/NPR, with their limits at infinite resolution.

    Panels stand side by side, two in a row. In each the series are levels joined by
    straight lines; where there is an extrapolation, its curve leads from the finest
    level to its value at zero. The bar there is the uncertainty of the finest value.
    Where the values diverge there is none: it would be no bound.

    Parameters
    ----------
    panels : sequence of ConvergencePanel
        At least one.
    out_png : Path
        Its folder is made where it is missing.

    Returns
    -------
    Path
        The figure.

    Raises
    ------
    ValueError
        If there are no panels.
    OSError
        If the figure cannot be written.
    """
    if not panels:
        raise ValueError("no panels to draw")
    columns = min(2, len(panels))
    rows = math.ceil(len(panels) / columns)
    with mpl.rc_context(STYLE):
        size = (WIDTH, rows * _PANEL_HEIGHT * (3 - columns) ** 0.5 + 0.5)
        figure = Figure(figsize=size, dpi=DPI, layout="constrained")
        grid = figure.subplots(rows, columns, squeeze=False).ravel()
        for axes, panel in zip(grid, panels, strict=False):
            _draw_panel(axes, panel)
        for axes in grid[len(panels) :]:
            axes.set_axis_off()
        figure.supxlabel(textwrap.fill(NOTE, 112), fontsize=7.5, color="0.3")
        out_png.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(out_png)
    return out_png


def _draw_panel(axes: Axes, panel: ConvergencePanel) -> None:
    """Draw the series of one quantity, and the limit of each."""
    resolutions = sorted({x for s in panel.series for x in s.convergence.npr})
    right = 1.12 / min(resolutions, default=1.0)
    axes.set_xlim(-(0.05 + _NUDGE * len(panel.series)) * right, right)
    for k, series in enumerate(panel.series):
        c = series.convergence
        colour = BODY_COLOURS[k % len(BODY_COLOURS)]
        marker = _MARKERS[k % len(_MARKERS)]
        label = f"{series.name}: {_behaviour(c)}"
        line: dict[str, Any] = {"color": colour, "marker": marker, "markersize": 4.5}
        axes.plot(1.0 / c.npr, panel.scale * c.values, label=label, **line)
        shift = -k * _NUDGE * right
        _draw_limit(axes, c, panel.scale, shift, line)
        if series.measured is not None:
            style = {**MEASURED, "color": colour}
            axes.axhline(panel.scale * series.measured, zorder=1, **style)
    axes.axvline(0.0, color="0.6", linewidth=0.6, zorder=0)
    _label_resolutions(axes, resolutions, right)
    axes.set_ylabel(f"{panel.quantity} [{panel.unit}]")
    # The legend stands above what is drawn.
    rows = math.ceil(len(panel.series) / _LEGEND_COLUMNS)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high + 0.11 * (high - low) * (rows + 0.3))
    if panel.series:
        style = {"handlelength": 1.3, "fontsize": 7.5}
        axes.legend(loc="upper right", ncols=_LEGEND_COLUMNS, **style)


def _label_resolutions(axes: Axes, resolutions: Sequence[float], right: float) -> None:
    """Mark 1/NPR with NPR; a label that would touch another is left out."""
    places, labels, last = [0.0], ["∞"], right
    for npr in resolutions:
        place = 1.0 / npr
        free = min(last - place, place) > _LABEL_WIDTH * right
        places.append(place)
        labels.append(f"{npr:g}" if free else "")
        last = place if free else last
    axes.set_xticks(places, labels)
    axes.set_xlabel("NPR, at 1/NPR")


def _behaviour(convergence: Convergence) -> str:
    """Return in a word or two how the finest levels behave."""
    c = convergence
    if c.kind == "monotone":
        return f"p {c.order:.2f}" + ", limited" * (c.order_used != c.order)
    if c.kind == "two levels":
        return f"p {c.order_used:g} assumed"
    return c.kind


def _draw_limit(
    axes: Axes,
    convergence: Convergence,
    scale: float,
    shift: float,
    line: dict[str, Any],
) -> None:
    """Draw the curve to infinite resolution, and the value there with its bar."""
    c = convergence
    if not math.isfinite(c.uncertainty):
        return
    known = math.isfinite(c.extrapolated)
    limit = c.extrapolated if known else float(c.values[-1])
    if math.isfinite(c.order_used):
        h = np.linspace(0.0, 1.0 / c.npr[-1], _POINTS)
        error = (c.values[-1] - limit) * (h * c.npr[-1]) ** c.order_used
        axes.plot(h, scale * (limit + error), ":", color=line["color"])
    axes.errorbar(
        shift,
        scale * limit,
        None if c.kind == "divergent" else scale * c.uncertainty,
        markerfacecolor=line["color"] if known else "white",
        capsize=2.5,
        linewidth=1.1,
        **line,
    )
