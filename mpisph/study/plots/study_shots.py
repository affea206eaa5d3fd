"""The figure of several shots: errors of the computed sizes as dots."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from mpisph.core.particles import FloatArray
from mpisph.figures.style import BODY_COLOURS, STYLE
from mpisph.study.plots.panels import MARKERS, finish, new_figure

BAND_PERCENT = 5.0
"""Half width of the band around no error [%]."""


class ShotsSeries(NamedTuple):
    """Errors of one setting, or of the paper, for all shots.

    Attributes
    ----------
    name : str
    nominal, offset : ndarray, shape (quantities, shots)
        Signed errors [%] by both clocks; NaN where there is none.
    paper : bool
        Whether they are the paper's own.
    """

    name: str
    nominal: FloatArray
    offset: FloatArray
    paper: bool = False


class ShotsFigure(NamedTuple):
    """Computed beside measured sizes of several shots.

    Attributes
    ----------
    title : str
    quantities : sequence of str
        Such as ``$R_b$``.
    shots : sequence of str
        Names of the shots with their exposures.
    measured : ndarray, shape (quantities, shots)
        [mm].
    series : sequence of ShotsSeries
    offset_label : str
        What the offset is.
    note : str
        Text below the figure.
    """

    title: str
    quantities: Sequence[str]
    shots: Sequence[str]
    measured: FloatArray
    series: Sequence[ShotsSeries]
    offset_label: str
    note: str


def draw_shots(data: ShotsFigure, out_png: Path) -> Path:
    """Draw the errors of all shots as dots, a panel for each quantity.

    Parameters
    ----------
    data : ShotsFigure
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
    with mpl.rc_context(STYLE):
        height = 1.1 + len(data.shots) * (0.22 + 0.16 * len(data.series))
        figure = new_figure(height, data.title)
        grid = figure.subplots(1, len(data.quantities), squeeze=False, sharex=True)[0]
        for k, (axes, quantity) in enumerate(zip(grid, data.quantities, strict=True)):
            _draw_dots(axes, data, k)
            sizes = [f"{size:.1f} mm" for size in data.measured[k]]
            names = [
                f"{shot}\n{size}" for shot, size in zip(data.shots, sizes, strict=True)
            ]
            axes.set_yticks(range(len(names)), names if k == 0 else sizes)
            axes.set_title(quantity)
            axes.set_xlabel(f"error of {quantity} [%]")
        return finish(figure, _shot_handles(data), data.note, out_png)


def _draw_dots(axes: Axes, data: ShotsFigure, quantity: int) -> None:
    """Draw nominal and offset of each series, joined, below each other."""
    axes.axvspan(-BAND_PERCENT, BAND_PERCENT, color="0.9", linewidth=0.0, zorder=0)
    axes.axvline(0.0, color="0.3", linewidth=0.9, zorder=1)
    n = len(data.series)
    step = 0.72 / n
    for k, (series, look) in enumerate(
        zip(data.series, _shot_looks(data), strict=True)
    ):
        y = np.arange(len(data.shots)) + (k - 0.5 * (n - 1)) * step
        nominal, offset = series.nominal[quantity], series.offset[quantity]
        axes.hlines(y, nominal, offset, color=look["color"], linewidth=0.9, zorder=2)
        axes.plot(nominal, y, linestyle="none", markerfacecolor="white", **look)
        axes.plot(offset, y, linestyle="none", **look)
    for k in range(len(data.shots) - 1):
        axes.axhline(k + 0.5, color="0.8", linewidth=0.6, zorder=0)
    axes.set_ylim(len(data.shots) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)


def _shot_looks(data: ShotsFigure) -> list[dict[str, Any]]:
    looks: list[dict[str, Any]] = []
    for k, series in enumerate(data.series):
        colour, marker = BODY_COLOURS[k % len(BODY_COLOURS)], MARKERS[k % len(MARKERS)]
        look = {"color": colour, "marker": marker}
        if series.paper:
            look = {"color": "black", "marker": "D"}
        looks.append({**look, "markersize": 5.0, "zorder": 3})
    return looks


def _shot_handles(data: ShotsFigure) -> list[Any]:
    handles: list[Any] = []
    for series, look in zip(data.series, _shot_looks(data), strict=True):
        clocks = [
            (f"{series.name}, nominal time", series.nominal, "white"),
            (f"{series.name}, {data.offset_label}", series.offset, look["color"]),
        ]
        for label, values, face in clocks:
            if np.isfinite(values).any():
                dot = {**look, "markerfacecolor": face, "linestyle": "none"}
                handles.append(Line2D([], [], label=label, **dot))
    handles.append(Patch(facecolor="0.9", label=f"±{BAND_PERCENT:g} %"))
    return handles
