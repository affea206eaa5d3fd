"""The figure of the clock's offset: what it is fitted by, and what it moves."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.analysis.clock_offset import (
    PREDICTIONS,
    ClockConclusion,
    ClockRun,
    clock_errors,
    clock_figures,
    conclude,
    covered_offsets,
)
from mpisph.figures.style import DPI, STYLE, WIDTH, body_colour, save

HEIGHT = 7.4
"""Height of the figure [in]."""

_POINTS = 500
# Offsets that a curve is drawn through.

_MARGIN = 0.4e-6
# How far curves go beyond the separate offsets [s].

_STRIP = 0.03
# Height of an uncertainty's strip, as a fraction of the axes.

_SIZES = (("L_b", "cloud_length", "-"), ("R_b", "cloud_radius", (0, (5, 2))))
# Symbol, column of the history and line.


def draw_clock(
    *runs: ClockRun, out_png: Path, conclusion: ClockConclusion | None = None
) -> Path:
    """Draw the fit of the clock on one or several runs of a shot.

    Above, the root mean square of the relative errors against the offset, with each
    run's minimum. Below, R_b and L_b against time, with the measured sizes at the
    nominal times and at those with the offset added.

    Parameters
    ----------
    *runs : ClockRun
    out_png : Path
        Its folder is made where it is missing.
    conclusion : ClockConclusion, optional
        Whose offset is added; by default that of the finest run.

    Returns
    -------
    Path
        The figure.

    Raises
    ------
    MpisphError
        If the runs do not belong together.
    OSError
        If the figure cannot be written.
    """
    conclusion = conclusion or conclude(runs)
    ordered = sorted(runs, key=lambda run: run.npr)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(WIDTH, HEIGHT), dpi=DPI, layout="constrained")
        above, below = figure.subplots(2, 1, height_ratios=(1.0, 1.35))
        title = textwrap.fill(conclusion.run.case.title, 88)
        above.set_title(title, loc="left", parse_math=False)
        _draw_errors(above, ordered, conclusion)
        _draw_sizes(below, ordered, conclusion)
        save(figure, out_png)
    return out_png


def _draw_errors(
    axes: Axes, runs: Sequence[ClockRun], conclusion: ClockConclusion
) -> None:
    """Draw the errors that the fit makes least, and where they are."""
    separate = np.concatenate([run.fit.separate for run in runs])
    low = min(0.0, separate.min()) - _MARGIN
    high = max(0.0, separate.max()) + _MARGIN
    for colour, run in zip(_colours(runs), runs, strict=True):
        least, most = covered_offsets(run.history, run.case)
        offsets = np.linspace(max(low, least), min(high, most), _POINTS)
        errors = clock_errors(run.history, run.case, offsets)
        rms = np.sqrt((errors**2).mean(axis=0))
        axes.plot(1e6 * offsets, 100.0 * rms, color=colour)
        best, left = 1e6 * run.fit.offset, 100.0 * run.fit.rms
        label = f"NPR {run.npr:g}: {best:.2f} µs, {left:.1f} % left"
        axes.plot(best, left, "o", color=colour, label=label)
    _draw_uncertainty(axes, conclusion)
    axes.axvline(0.0, color="0.45", linewidth=0.8)
    axes.annotate(
        "nominal times",
        (0.0, 0.985),
        (3, 0),
        xycoords=("data", "axes fraction"),
        textcoords="offset points",
        rotation=90,
        va="top",
        fontsize=8.0,
        color="0.3",
    )
    axes.set_xlim(1e6 * low, 1e6 * high)
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("offset added to the nominal exposure times [µs]")
    count = len(conclusion.run.fit.names)
    axes.set_ylabel(f"rms error of {count} figures [%]")
    axes.legend(loc="upper center")


def _draw_uncertainty(axes: Axes, conclusion: ClockConclusion) -> None:
    """Shade the offset's two uncertainties, each where it is known."""
    offset = 1e6 * conclusion.offset
    parts = (
        ("numerical", conclusion.numerical, "0.55", 0.0),
        ("figure to figure", conclusion.figures, "0.8", _STRIP),
    )
    for name, size, colour, bottom in parts:
        if math.isfinite(size):
            axes.axvspan(
                offset - 1e6 * size,
                offset + 1e6 * size,
                bottom,
                bottom + _STRIP,
                color=colour,
                linewidth=0.0,
                label=f"{name}: ±{1e6 * size:.2f} µs",
                zorder=0,
            )


def _draw_sizes(
    axes: Axes, runs: Sequence[ClockRun], conclusion: ClockConclusion
) -> None:
    """Draw the computed sizes, and the measured ones at both times."""
    for colour, run in zip(_colours(runs), runs, strict=True):
        for symbol, column, line in _SIZES:
            axes.plot(
                1e6 * run.history["time"],
                1e3 * run.history[column],
                color=colour,
                linestyle=line,
                linewidth=1.2,
                label=f"${symbol}$, NPR {run.npr:g}",
            )
    measured = clock_figures(conclusion.run.case)
    times = np.array([1e6 * f.time for f in measured])
    sizes = [1e3 * f.measured for f in measured]
    offset = 1e6 * conclusion.offset
    dots: dict[str, Any] = {
        "linestyle": "none",
        "marker": "o",
        "color": "black",
        "zorder": 3,
    }
    axes.plot(times, sizes, fillstyle="none", label="measured, nominal time", **dots)
    label = f"measured, {offset:.2f} µs later"
    axes.plot(times + offset, sizes, label=label, **dots)
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    axes.annotate(
        textwrap.fill(PREDICTIONS, 62),
        (1.0, 0.0),
        (-6, 6),
        xycoords="axes fraction",
        textcoords="offset points",
        ha="right",
        va="bottom",
        fontsize=7.5,
        color="0.3",
    )
    axes.set_xlabel("time after first contact [µs]")
    axes.set_ylabel("size of the cloud [mm], outermost particles")
    axes.legend(loc="upper left", ncols=2 if len(runs) > 2 else 1)


def _colours(runs: Sequence[ClockRun]) -> list[str]:
    """Return a colour for each run."""
    return [body_colour(k) for k in range(len(runs))]
