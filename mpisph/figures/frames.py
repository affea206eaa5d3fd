"""Frames: snapshots of a run in one view, as panels side by side or as a film."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from mpisph.case import Case
from mpisph.diagnostics.cloud import cloud_definition, measure_arrays
from mpisph.figures.cloud import View, choose_view, only_finite, smallest_dot
from mpisph.figures.style import BODY_COLOURS, REAR_FACE, STYLE, WIDTH
from mpisph.io.snapshot import Snapshot, read_snapshot

_MOST_POINTS = 400_000
# Of one frame; more only cover each other.


class Layout(NamedTuple):
    """Size of a frame and what is written on it.

    Attributes
    ----------
    width : int
        [pixels].
    highest : int
        Largest height of the axes [pixels].
    margins : tuple of float
        Left, right, bottom and top of the axes [in].
    dpi : int
        Pixels per inch.
    font : float
        Size of the letters [pt].
    lettered : bool
        Whether axes, bodies and time are named on the frame.
    """

    width: int
    highest: int
    margins: tuple[float, float, float, float]
    dpi: int
    font: float
    lettered: bool


PANEL = Layout(520, 520, (0.31, 0.06, 0.23, 0.06), 200, 9.0, lettered=False)
"""A small picture among others, which say the same of axes and colours."""

FILM = Layout(1280, 780, (0.6, 0.15, 0.5, 0.3), 160, 9.0, lettered=True)
"""A frame of a film."""


def common_view(paths: Sequence[Path], case: Case) -> View:
    """Return limits that hold what each snapshot's own figure would show.

    Strays do not set them (see `choose_view`).

    Parameters
    ----------
    paths : sequence of Path
        The snapshots, at least one.
    case : Case

    Returns
    -------
    View

    Raises
    ------
    OSError
        If a snapshot cannot be read.
    """
    definition = cloud_definition(case)
    views = []
    for path in paths:
        snapshot = only_finite(read_snapshot(path))
        a = snapshot.arrays
        measure = measure_arrays(a["id"], a["r"], a["z"], a["u_z"], a["m"], definition)
        views.append(choose_view(snapshot, case, definition, measure, None))
    return View(
        min(view.z_low for view in views),
        max(view.z_high for view in views),
        max(view.r_high for view in views),
    )


class Frame:
    """A figure that shows one snapshot after another in the same view.

    Parameters
    ----------
    case : Case
    view : View
        Widened where the frame would be too high.
    layout : Layout

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        Width and height are even numbers of pixels, as films need.
    """

    def __init__(self, case: Case, view: View, layout: Layout) -> None:
        self._case = case
        self._layout = layout
        self.view, self.figure, box = _fit(view, layout)
        with mpl.rc_context({**STYLE, "font.size": layout.font}):
            self._axes = self.figure.add_axes(box)
            self._dots = [self._body(k) for k in range(len(case.bodies))]
            self._set_axes()
            if layout.lettered:
                self._letter()

    def show(self, snapshot: Snapshot) -> None:
        """Draw the particles of a snapshot in place of those shown before.

        Parameters
        ----------
        snapshot : Snapshot
            Of the frame's case.
        """
        a = snapshot.arrays
        z, r = a["z"] * 1e3, a["r"] * 1e3
        every = 1 + len(z) // _MOST_POINTS
        drawn = self.view.shows(z, r) & (a["id"] % every == 0)
        for index, dots in enumerate(self._dots):
            mine = drawn & (a["body"] == index)
            dots.set_data(np.tile(z[mine], 2), np.concatenate([r[mine], -r[mine]]))
            dots.set_markersize(self._dot_size(every, len(z)))
        if self._layout.lettered:
            self._axes.set_title(f"t = {snapshot.time * 1e6:.2f} µs", loc="right")

    def save(self, out_png: Path) -> None:
        """Write the frame as a PNG file, in a folder that is made where missing.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        out_png.parent.mkdir(parents=True, exist_ok=True)
        self.figure.savefig(out_png, dpi=self._layout.dpi)

    def _body(self, index: int) -> Line2D:
        """Return the dots of a body, none so far."""
        colour = BODY_COLOURS[index % len(BODY_COLOURS)]
        (dots,) = self._axes.plot([], [], "o", markeredgewidth=0.0, color=colour)
        return dots

    def _dot_size(self, every: int, n: int) -> float:
        """Return the diameter of a dot that stands for `every` of `n` [pt]."""
        inches = float(self.figure.get_figwidth())
        width = float(self._axes.get_position().width) * inches * 72.0
        spacing = self._case.spacing * 1e3 * math.sqrt(every)
        size = spacing * width / (self.view.z_high - self.view.z_low)
        return max(size, smallest_dot(n) * math.sqrt(inches / WIDTH))

    def _set_axes(self) -> None:
        axes, view = self._axes, self.view
        axes.set_xlim(view.z_low, view.z_high)
        axes.set_ylim(-view.r_high, view.r_high)
        axes.yaxis.set_major_formatter(lambda r, _: f"{abs(r):g}")
        axes.locator_params(nbins=8 if self._layout.lettered else 3)
        axes.axhline(0.0, color="0.6", linewidth=0.6, linestyle=(0, (8, 2, 1, 2)))
        rear = cloud_definition(self._case).rear
        if np.isfinite(rear):
            axes.axvline(rear * 1e3, zorder=1, **REAR_FACE)

    def _letter(self) -> None:
        """Name the case, the axes and the bodies."""
        axes = self._axes
        title = self._case.title
        shown = title if len(title) <= 80 else f"{title[:79]}…"
        axes.set_title(shown, loc="left", parse_math=False)
        axes.set_xlabel("axial position z [mm]", loc="left")
        axes.set_ylabel("radius r [mm]")
        for index, body in enumerate(self._case.bodies):
            colour = BODY_COLOURS[index % len(BODY_COLOURS)]
            axes.plot([], [], "o", markersize=6.0, color=colour, label=body.name)
        self.figure.legend(
            loc="lower right",
            bbox_to_anchor=(axes.get_position().x1 + 0.01, 0.0),
            ncols=min(len(self._case.bodies), 4),
        )


def _fit(
    view: View, layout: Layout
) -> tuple[View, Figure, tuple[float, float, float, float]]:
    """Return the view of the frame's shape, its figure and the place of the axes."""
    left, right, bottom, top = layout.margins
    width = layout.width / layout.dpi - left - right
    most = layout.highest / layout.dpi / width
    span = max(view.z_high - view.z_low, 2.0 * view.r_high / most)
    missing = 0.5 * (span - (view.z_high - view.z_low))
    height = width * 2.0 * view.r_high / span
    pixels = 2 * round(0.5 * (bottom + height + top) * layout.dpi)
    size = (layout.width / layout.dpi, pixels / layout.dpi)
    # Rounding to even pixels is left to the radius, so that both scales are one.
    height = size[1] - bottom - top
    fitted = View(
        view.z_low - missing, view.z_high + missing, 0.5 * span * height / width
    )
    box = (left / size[0], bottom / size[1], width / size[0], height / size[1])
    return fitted, Figure(figsize=size, dpi=layout.dpi), box
