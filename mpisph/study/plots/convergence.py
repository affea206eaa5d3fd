"""The figure of a convergence study: quantities against the spacing, to its limit."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes

from mpisph.analysis.convergence import Convergence, converge
from mpisph.case.times import same_time
from mpisph.figures.style import MEASURED, Out, body_colour
from mpisph.study.columns import CLOCKS, column_words, time_label
from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.plots.axes import (
    SYMBOLS,
    Clock,
    axis_of,
    by_axes,
    exposures,
    measured_mm,
    size_column,
    time_text,
    value_at,
)
from mpisph.study.plots.panels import MARKERS, finish, panel_grid
from mpisph.study.table import Row

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


def convergence_panels(
    study: Study, spec: FigureSpec, rows: Sequence[Row]
) -> list[ConvergencePanel]:
    """Return what is drawn of quantities against resolution.

    They are the columns that the figure names; else those at the earliest exposure, by
    the last of the figure's clocks: R_b and L_b, outermost and robust, front velocity,
    mass of the cloud, and the hole.

    Parameters
    ----------
    study : Study
    spec : FigureSpec
        Of kind ``convergence``.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    list of ConvergencePanel
        Of the quantities that any run has.
    """
    x, lines = axis_of(study, spec.x), axis_of(study, spec.lines)
    table = by_axes(rows, (x, lines))
    panels = []
    for label, unit, column, measured in _quantities(study, spec):
        series = []
        for line, name in zip(lines.values, lines.titles(), strict=True):
            values = [value_at(table.get((at, line)), column) for at in x.values]
            result = converge(x.numbers(), values)
            series.append(ConvergenceSeries(name, result, measured.get(line)))
        if any(math.isfinite(v) for s in series for v in s.convergence.values):
            panels.append(ConvergencePanel(label, unit, series))
    return panels


def _quantities(
    study: Study, spec: FigureSpec
) -> list[tuple[str, str, str, dict[Value, float]]]:
    """Return label, unit, column, and what was measured of each variant."""
    if study.drawn:
        return [(*column_words(name), name, {}) for name in study.drawn]
    time = study.times(spec.exposures)[0]
    clock: Clock = spec.clocks[-1]
    where = f"{time_label(time)}{CLOCKS[clock]}"
    found = []
    for q in spec.quantities:
        sizes = _measured(study, time, q)
        column, robust = (size_column(q, time, clock, e) for e in ("mm", "robust_mm"))
        at = f"{SYMBOLS[q]} at {time_text(study, time, clock)}"
        found.append((f"{at}, outermost", "mm", column, sizes))
        found.append((f"{at}, robust", "mm", robust, sizes))
    found.append(("front velocity", "km/s", f"front_velocity_{where}_km_per_s", {}))
    found.append(("mass of the cloud", "g", f"cloud_mass_{where}_g", {}))
    found.append(("hole between the faces", "mm", f"hole_{where}_mm", {}))
    found.append(("hole through the lips", "mm", f"hole_opening_{where}_mm", {}))
    return found


def _measured(study: Study, time: float, quantity: str) -> dict[Value, float]:
    """Return what was measured of each variant [mm]."""
    sizes = {
        case.variant: measured_mm(exposure, quantity)
        for case, exposure in exposures(study)
        if same_time(exposure.time, time)
    }
    return {name: size for name, size in sizes.items() if not math.isnan(size)}


def draw_convergence(panels: Sequence[ConvergencePanel], title: str, out: Out) -> None:
    """Draw quantities against 1/NPR, with their limits at infinite resolution.

    Panels stand side by side, two in a row. In each the series are levels joined by
    straight lines; where there is an extrapolation, its curve leads from the finest
    level to its value at zero. The bar there is the uncertainty of the finest value.
    Where the values diverge there is none: it would be no bound.

    Parameters
    ----------
    panels : sequence of ConvergencePanel
        At least one.
    title : str
    out : Path or BytesIO
    """
    columns = min(2, len(panels))
    rows = math.ceil(len(panels) / columns)
    height = rows * _PANEL_HEIGHT * (3 - columns) ** 0.5 + 0.3
    with panel_grid(title, height, rows, columns) as (figure, grid):
        flat = grid.ravel()
        for axes, panel in zip(flat, panels, strict=False):
            _draw_panel(axes, panel)
        for axes in flat[len(panels) :]:
            axes.set_axis_off()
        finish(figure, (), NOTE, out)


def _draw_panel(axes: Axes, panel: ConvergencePanel) -> None:
    """Draw the series of one quantity, and the limit of each."""
    resolutions = sorted({x for s in panel.series for x in s.convergence.npr})
    right = 1.12 / min(resolutions, default=1.0)
    axes.set_xlim(-(0.05 + _NUDGE * len(panel.series)) * right, right)
    for k, series in enumerate(panel.series):
        c = series.convergence
        colour = body_colour(k)
        marker = MARKERS[k % len(MARKERS)]
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
    unit = f" [{panel.unit}]" if panel.unit else ""
    axes.set_ylabel(f"{panel.quantity}{unit}")
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
