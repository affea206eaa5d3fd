"""Figures of a run's history: the cloud's growth, conservation, the time step."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.analysis.shield_history import ARRIVED, MOMENTUM, wall_arrival
from mpisph.analysis.verdict import damage_ratio
from mpisph.case import Case
from mpisph.case.contact import time_origin
from mpisph.diagnostics.cloud import cloud_definition
from mpisph.diagnostics.probes import (
    BODY_QUANTITIES,
    GAUGE_QUANTITIES,
)
from mpisph.diagnostics.series import SERIES, Quantity, Series, column_name
from mpisph.figures.style import (
    BODY_COLOURS,
    COMPUTED,
    DPI,
    STYLE,
    Out,
    body_colour,
    save,
)
from mpisph.io.probe_files import BODIES_FILE, GAUGES_FILE
from mpisph.io.result import CloudRecord
from mpisph.io.stored_run import StoredRun
from mpisph.io.verdict import Verdict, WallRecord

SIZE = (5.0, 3.1)
"""Width and height of a figure [in]; small, so that its letters stay readable."""

_LINE: dict[str, Any] = {"color": COMPUTED["color"], "linewidth": 1.3}
_ROBUST: dict[str, Any] = {
    "linestyle": "none",
    "marker": "x",
    "markersize": 4.0,
    "color": BODY_COLOURS[0],
}
_MARK: dict[str, Any] = {"color": "0.4", "linewidth": 1.0, "zorder": 1}
_NOMINAL: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 6.0,
    "color": "black",
    "markerfacecolor": "none",
    "zorder": 4,
}
_OFFSET: dict[str, Any] = {**_NOMINAL, "markerfacecolor": "black"}


class RunHistory(NamedTuple):
    """What the figures are drawn from.

    Attributes
    ----------
    rows : structured ndarray, shape (lines,)
        From `history.read_history`.
    case : Case
    clouds : tuple of CloudRecord
        The cloud at output times, for its robust figures; may be empty.
    probes : mapping of str to structured ndarray
        What was followed of bodies and at gauges, by the names of the files.
    walls : tuple of WallRecord
        The wall of a shield at the output times; may be empty.
    verdict : Verdict or None
        On that.
    """

    rows: npt.NDArray[Any]
    case: Case
    clouds: tuple[CloudRecord, ...] = ()
    probes: Mapping[str, npt.NDArray[Any]] = MappingProxyType({})
    walls: tuple[WallRecord, ...] = ()
    verdict: Verdict | None = None

    @classmethod
    def of(cls, run: StoredRun) -> "RunHistory":
        """Return what a stored run holds of it."""
        parts = (run.history, run.case, run.clouds, run.probes)
        if run.result is None:
            return cls(*parts)
        return cls(*parts, run.result.walls, run.result.verdict)


class HistoryFigure(NamedTuple):
    """One figure of a history.

    Attributes
    ----------
    name : str
        For the name of a file.
    title : str
        What it shows.
    caption : str
        What its lines and marks are.
    draw : callable
        Draws a `RunHistory` into axes whose abscissa is the time [us].
    """

    name: str
    title: str
    caption: str
    draw: Callable[[Axes, RunHistory], None]


def history_figures(run: RunHistory) -> list[HistoryFigure]:
    """Return the figures that have something to show.

    Parameters
    ----------
    run : RunHistory

    Returns
    -------
    list of HistoryFigure
        None without lines of history, none of the cloud where there is no cloud or of
        a shield that names no measurements, and the imbalance only of several ranks.
    """
    rows = run.rows
    if len(rows) < 2:
        return []
    exposed = run.case.measured is not None and bool(run.case.measured.exposures)
    cloud = bool(rows["cloud_mass"].any()) and (exposed or run.case.shield is None)
    shown = {
        "radius": cloud,
        "length": cloud,
        "imbalance": bool(rows["imbalance"].any()),
    }
    figures = [figure for figure in _FIGURES if shown.get(figure.name, True)]
    if exposed:
        figures = [_with_measured(figure) for figure in figures]
    captioned = [s for s in SERIES if s.caption and rows[s.name].any()]
    captioned = [s for s in captioned if cloud or not s.until_arrival]
    figures += [_series_figure(series) for series in captioned]
    return figures + _probe_figures(run)


def _probe_figures(run: RunHistory) -> list[HistoryFigure]:
    """Return the figures of bodies and gauges, with a line for each of them."""
    found = []
    for file, what, names, shown, caption in (
        (BODIES_FILE, "bodies", run.case.bodies, _OF_BODIES, ""),
        (GAUGES_FILE, "gauges", run.case.gauges, _OF_GAUGES, _GAUGES_CAPTION),
    ):
        rows = run.probes.get(file)
        if rows is None or len(rows) < 2:
            continue
        lines = [each.name for each in names]
        for quantity, label, factor, unit in shown:
            if run.case.shield is not None and quantity is MOMENTUM:
                continue  # see `shield_figures`
            title = f"{label} of the bodies" if what == "bodies" else f"{label}: gauges"
            draw = partial(_draw_probes, file, quantity, lines, factor)
            found.append(
                HistoryFigure(
                    f"{what}_{quantity.name}",
                    title,
                    caption,
                    partial(draw, f"{quantity.label} [{unit}]"),
                )
            )
    return found


def _draw_probes(
    file: str,
    quantity: Quantity,
    names: Sequence[str],
    factor: float,
    label: str,
    axes: Axes,
    run: RunHistory,
) -> None:
    """Draw a line for each body or gauge."""
    rows = run.probes[file]
    for index, name in enumerate(names):
        axes.plot(
            1e6 * rows["time_s"],
            factor * rows[column_name(quantity, name)],
            label=name,
            color=body_colour(index),
            linewidth=1.2,
        )
    axes.set_ylabel(label)


def shield_figures(run: RunHistory) -> list[HistoryFigure]:
    """Return the figures that tell how the wall of a shield comes to its verdict.

    Parameters
    ----------
    run : RunHistory

    Returns
    -------
    list of HistoryFigure
        The momentum of the bodies, the figure that decides, the wall's bulge and
        crater, as far as there is something to show; none of other cases.
    """
    if run.case.shield is None:
        return []
    found = []
    if len(run.probes.get(BODIES_FILE, ())) > 1:
        caption = f"{_MOMENTUM_CAPTION} {_marks_caption(run)}".strip()
        title = "Axial momentum by body"
        found.append(HistoryFigure("momentum", title, caption, _draw_momentum))
    if len(run.walls) > 1:
        if damage_ratio(run.case, run.walls[-1]) is not None:
            title = "Damage of the wall over what it bears"
            found.append(HistoryFigure("damage", title, _DAMAGE_CAPTION, _draw_damage))
        title = "Bulge and crater of the wall"
        found.append(HistoryFigure("bulge", title, _BULGE_CAPTION, _draw_bulge))
    return found


def _draw_momentum(axes: Axes, run: RunHistory) -> None:
    """Draw the momentum of each body and of all, and mark arrival and rest."""
    names = [body.name for body in run.case.bodies]
    rows = run.probes[BODIES_FILE]
    every = np.sum([rows[column_name(MOMENTUM, name)] for name in names], axis=0)
    label = f"{MOMENTUM.label} [N s]"
    _draw_probes(BODIES_FILE, MOMENTUM, names, 1.0, label, axes, run)
    axes.plot(1e6 * rows["time_s"], every, label="all", color="black", linewidth=0.8)
    axes.axhline(0.0, color="0.6", linewidth=0.6, zorder=1)
    _mark_times(axes, run)


def _mark_times(axes: Axes, run: RunHistory) -> None:
    """Mark when the cloud reaches the wall, and from when that is at rest."""
    rest = run.verdict.rest_time if run.verdict else None
    for time, style, label in (
        (_arrival(run), "--", "cloud at the wall"),
        (rest, ":", "wall at rest"),
    ):
        if time is not None:
            mark: dict[str, Any] = {**_MARK, "linestyle": style}
            axes.axvline(1e6 * time, label=label, **mark)


def _arrival(run: RunHistory) -> float | None:
    rows = run.probes.get(BODIES_FILE)
    return None if rows is None else wall_arrival(run.case, rows)


def _marks_caption(run: RunHistory) -> str:
    """Say what the marks of a shield's momentum are, as far as they are there."""
    arrival, parts = _arrival(run), []
    if arrival is not None:
        share = f"{100.0 * ARRIVED:g} % of the projectile's momentum"
        when = f"{1e6 * arrival:.1f} µs"
        parts.append(f"Dashed: the cloud is at the wall ({when}), which has {share}.")
    if run.verdict is not None and run.verdict.rest_time is not None:
        when = f"{1e6 * run.verdict.rest_time:.1f} µs"
        parts.append(f"Dotted: from {when} the rear face stays where it is.")
    elif run.verdict is not None:
        parts.append("The rear face still moves at the end.")
    return " ".join(parts)


def _draw_damage(axes: Axes, run: RunHistory) -> None:
    """Draw the figure that decides over its critical value."""
    ratios = [damage_ratio(run.case, wall) or 0.0 for wall in run.walls]
    axes.plot(_times(run), ratios, marker="o", markersize=3.0, **_LINE)
    axes.axhline(1.0, color="0.4", linewidth=0.8, linestyle="--", label="critical")
    axes.set_ylabel("damage / critical damage")
    axes.set_ylim(bottom=0.0)


def _draw_bulge(axes: Axes, run: RunHistory) -> None:
    """Draw the bulge of the rear face and the depth of the crater."""
    for index, (label, name) in enumerate(
        (("bulge of the rear face", "bulge"), ("depth of the crater", "crater_depth"))
    ):
        axes.plot(
            _times(run),
            [1e3 * getattr(wall, name) for wall in run.walls],
            label=label,
            color=body_colour(index),
            linewidth=1.2,
            marker="o",
            markersize=3.0,
        )
    axes.set_ylabel("displacement [mm]")
    axes.set_ylim(bottom=0.0)


def _times(run: RunHistory) -> list[float]:
    return [1e6 * wall.time for wall in run.walls]


def _with_measured(figure: HistoryFigure) -> HistoryFigure:
    """Say in the caption of R_b and L_b how the measured ones are drawn in."""
    if figure.caption is not _SIZE_CAPTION:
        return figure
    return figure._replace(caption=f"{figure.caption} {_MEASURED_CAPTION}")


def draw_history(figure: HistoryFigure, run: RunHistory, out: Out) -> None:
    """Draw one figure of a history.

    Parameters
    ----------
    figure : HistoryFigure
    run : RunHistory
    out : Path or BytesIO

    Raises
    ------
    OSError
        If the figure cannot be written.
    """
    with mpl.rc_context(STYLE):
        drawing = Figure(figsize=SIZE, dpi=DPI, layout="constrained")
        axes = drawing.add_subplot()
        figure.draw(axes, run)
        axes.set_xlabel(f"time {time_origin(run.case.bodies, run.case.boundary)} [µs]")
        axes.margins(x=0.02)
        if axes.get_legend_handles_labels()[0]:
            axes.legend()
        save(drawing, out)


def _draw_radius(axes: Axes, run: RunHistory) -> None:
    _draw_size(axes, run, "radius", "$R_b$ [mm]")


def _draw_length(axes: Axes, run: RunHistory) -> None:
    _draw_size(axes, run, "length", "$L_b$ [mm]")


def _draw_size(axes: Axes, run: RunHistory, name: str, label: str) -> None:
    """Draw R_b or L_b: outermost at every step, robust, and as measured."""
    rows = run.rows
    computed = 1e3 * rows[f"cloud_{name}"]
    axes.plot(1e6 * rows["time"], computed, label="computed, outermost", **_LINE)
    if run.clouds:
        share = 100.0 * cloud_definition(run.case).quantile
        axes.plot(
            [1e6 * cloud.time for cloud in run.clouds],
            [1e3 * getattr(cloud, f"{name}_robust") for cloud in run.clouds],
            label=f"computed, {share:g} % of the mass",
            **_ROBUST,
        )
    offset = run.case.measured.clock_offset if run.case.measured else 0.0
    measured = _measured(run.case, name)
    for shift, style, when in (
        (0.0, _NOMINAL, "nominal time"),
        (offset, _OFFSET, f"{1e6 * offset:+.2f} µs clock offset"),
    ):
        if measured and (style is _NOMINAL or offset):
            times = [1e6 * (time + shift) for time, _ in measured]
            sizes = [1e3 * size for _, size in measured]
            axes.plot(times, sizes, label=f"measured, {when}", **style)
    axes.set_ylabel(label)
    axes.set_ylim(bottom=0.0)


def _measured(case: Case, name: str) -> list[tuple[float, float]]:
    """Return times and sizes of what was measured before the end of the run [SI]."""
    exposures = case.measured.exposures if case.measured else ()
    sizes = [(e.time, getattr(e, name)) for e in exposures if e.time <= case.end_time]
    return [(time, size) for time, size in sizes if size is not None]


def _series_figure(series: Series) -> HistoryFigure:
    """Return the figure of a series that says what it shows."""
    factor, unit = _SHOWN_UNITS.get(series.unit, (1.0, series.unit))

    def draw(axes: Axes, run: RunHistory) -> None:
        axes.plot(1e6 * run.rows["time"], factor * run.rows[series.name], **_LINE)
        axes.set_ylabel(f"{series.label} [{unit}]")
        if np.nanmin(run.rows[series.name]) >= 0.0:
            axes.set_ylim(bottom=0.0)

    title = series.label[0].upper() + series.label[1:]
    return HistoryFigure(series.name, title, series.caption, draw)


def _draw_energies(axes: Axes, run: RunHistory) -> None:
    rows = run.rows
    kinetic, internal = 1e-3 * rows["kinetic_energy"], 1e-3 * rows["internal_energy"]
    lines = (("total", kinetic + internal, "black"), ("kinetic", kinetic, None))
    for index, (label, energy, colour) in enumerate(
        (*lines, ("internal", internal, None))
    ):
        axes.plot(
            1e6 * rows["time"],
            energy,
            label=label,
            color=colour or BODY_COLOURS[index - 1],
            linewidth=1.3,
        )
    axes.set_ylabel("energy [kJ]")


def _draw_energy_error(axes: Axes, run: RunHistory) -> None:
    axes.plot(1e6 * run.rows["time"], run.rows["energy_error"], **_LINE)
    axes.axhline(0.0, color="0.6", linewidth=0.6)
    axes.ticklabel_format(axis="y", scilimits=(-2, 3), useMathText=True)
    axes.set_ylabel("energy error / initial energy")


def _draw_step(axes: Axes, run: RunHistory) -> None:
    rows = run.rows[run.rows["dt"] > 0.0]
    axes.plot(1e6 * rows["time"], 1e9 * rows["dt"], **{**_LINE, "linewidth": 0.8})
    axes.set_ylabel("length of the step [ns]")
    axes.set_ylim(bottom=0.0)


def _draw_imbalance(axes: Axes, run: RunHistory) -> None:
    rows = run.rows
    axes.plot(
        1e6 * rows["time"], 100.0 * rows["imbalance"], **{**_LINE, "linewidth": 0.8}
    )
    limit = 100.0 * run.case.parallel.imbalance_threshold
    axes.axhline(limit, color="0.4", linewidth=0.8, linestyle="--", label="threshold")
    axes.set_ylabel("largest load over mean, less 1 [%]")
    axes.set_ylim(bottom=0.0)


_BODY, _GAUGE = (
    {quantity.name: quantity for quantity in quantities}
    for quantities in (BODY_QUANTITIES, GAUGE_QUANTITIES)
)
_OF_BODIES = (
    (_BODY["momentum_z"], "Axial momentum", 1.0, "N s"),
    (_BODY["kinetic_energy"], "Kinetic energy", 1e-3, "kJ"),
    (_BODY["internal_energy"], "Internal energy", 1e-3, "kJ"),
    (_BODY["peak_pressure"], "Peak pressure", 1e-9, "GPa"),
)
_OF_GAUGES = (
    (_GAUGE["P"], "Pressure", 1e-9, "GPa"),
    (_GAUGE["rho"], "Density", 1.0, "kg/m³"),
    (_GAUGE["u_z"], "Axial velocity", 1e-3, "km/s"),
    (_GAUGE["u_r"], "Radial velocity", 1e-3, "km/s"),
    (_GAUGE["E"], "Internal energy", 1e-6, "MJ/kg"),
)
# What is drawn of bodies and gauges, in the units of people.

_MOMENTUM_CAPTION = (
    "What the projectile loses, bumpers, wall and what is thrown back gain."
)
_DAMAGE_CAPTION = (
    "More than 1 fails: tilt of the rear face over the elongation of the alloy, lost "
    "share of a block over what it can lose, detached mass, hole. Dots: output times."
)
_BULGE_CAPTION = "Largest displacements, at the output times."

_GAUGES_CAPTION = "A line ends where there is no matter at the place of its gauge."

_SHOWN_UNITS = {
    "J/kg": (1e-6, "MJ/kg"),
    "kg": (1e3, "g"),
    "m": (1e3, "mm"),
    "J": (1e-3, "kJ"),
}

_SIZE_CAPTION = (
    "Line: outermost particle, at every step. Crosses: within which the given share of "
    "the cloud's mass lies."
)
_MEASURED_CAPTION = (
    "Circles: measured, drawn at the nominal exposure time (open) and with the clock "
    "offset added (filled)."
)

_FIGURES = (
    HistoryFigure("radius", "Radius of the cloud, R_b", _SIZE_CAPTION, _draw_radius),
    HistoryFigure("length", "Length of the cloud, L_b", _SIZE_CAPTION, _draw_length),
    HistoryFigure(
        "energies",
        "Energies",
        "The impact turns kinetic energy into internal; their sum is conserved.",
        _draw_energies,
    ),
    HistoryFigure(
        "energy_error",
        "Energy error",
        "Change of the total energy: the error of the time integration.",
        _draw_energy_error,
    ),
    HistoryFigure(
        "step",
        "Length of the time step",
        "Steps that end at an output time are shortened to meet it.",
        _draw_step,
    ),
    HistoryFigure(
        "imbalance",
        "Imbalance of the ranks",
        "The domain is divided again where the imbalance exceeds the threshold.",
        _draw_imbalance,
    ),
)
