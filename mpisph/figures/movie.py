"""Movies of a run: every snapshot a frame, all in one view."""

import math
import os
import shutil
import subprocess
import textwrap
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
from matplotlib.animation import FFMpegWriter
from matplotlib.figure import Figure

from mpisph.case import Case, case_from_dict
from mpisph.core.errors import InputError, MpisphError
from mpisph.figures.dots import (
    BAR_MARGIN,
    BODIES,
    Dots,
    Shading,
    draw_bars,
    find_shadings,
    legend_entries,
)
from mpisph.figures.fields import BODY, Chosen, require_fields
from mpisph.figures.style import STYLE, Out, save
from mpisph.figures.view import (
    View,
    body_view,
    common_view,
    draw_surroundings,
    set_limits,
)
from mpisph.io.files import replace_file
from mpisph.io.snapshot import Snapshot, read_series, read_snapshot

FILM_FILE = "film.mp4"

DURATION = 6.0
"""How long a film takes by default, where `SLOWEST` and `FASTEST` allow it [s]."""

SLOWEST, FASTEST = 2.0, 25.0
"""Limits of the default frame rate [1/s]."""

_MORE = "`--set output.every=0.1us` of `mpisph run` writes more"


class FrameLayout(NamedTuple):
    """Size of a frame and what is written on it.

    Attributes
    ----------
    widest, highest : int
        Largest width of the frame and height of its axes [pixels].
    narrowest : int
        Smallest width of the frame [pixels].
    margins : tuple of float
        Left, right, bottom and top of the axes [in].
    dpi : int
        Pixels per inch.
    lettered : bool
        Whether axes, bodies and time are named on the frame.
    """

    widest: int
    highest: int
    narrowest: int
    margins: tuple[float, float, float, float]
    dpi: int
    lettered: bool


PANEL = FrameLayout(520, 520, 300, (0.31, 0.06, 0.23, 0.06), 200, lettered=False)
"""A small picture among others, which say the same of axes and colours."""

FILM = FrameLayout(1280, 780, 640, (0.6, 0.15, 0.5, 0.12), 160, lettered=True)
"""A frame of a film."""

_COLUMNS = 4
# Of the legend.

_LETTER, _LINE = 0.08, 0.18
# Width of a letter of the title, on the generous side, and height of a line [in].

_TIME_LETTERS = 13


def animate(
    folder: Path,
    out: Path,
    fps: float | None = None,
    chosen: Sequence[Chosen] = (BODY,),
    zoom: str | None = None,
) -> Path:
    """Make a film of a run: every snapshot is a frame, all in one view.

    H.264 in an MP4 file that browsers play. The view holds the cloud at all times and
    is not set by strays.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    out : Path
        The film. It gets its name when it is complete; its folder is made where
        missing.
    fps : float, optional
        Frames a second; by default so many that the film takes `DURATION`, within
        `SLOWEST` and `FASTEST`.
    chosen : sequence of Chosen, optional
        What the colours show: one field, or those above and below the axis.
    zoom : str, optional
        Body that is shown close by, see `body_view`.

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    MpisphError
        If there is no ffmpeg, if the run has fewer than two snapshots, if these lack a
        field or the case the body, or if the film cannot be encoded.
    OSError
        If a snapshot cannot be read or the film cannot be written.
    """
    program = find_ffmpeg()
    paths = [path for path, _ in read_series(folder)]
    if len(paths) < 2:
        raise InputError(
            f"{folder}: {len(paths)} snapshots, a film needs two or more; is it a "
            f"run's folder? {_MORE}"
        )
    first = read_snapshot(paths[0])
    require_fields(chosen, first.arrays, folder)
    case = case_from_dict(tomllib.loads(first.case))
    if zoom is None:
        view = common_view(paths, case, exposures=False, headroom=1.12)
    else:
        view = body_view(paths, case, zoom)
    shadings = find_shadings(chosen, map(read_snapshot, paths), view, case)
    frame = Frame(case, view, FILM, shadings)
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_name(f"{out.name}.{os.uname().nodename}-{os.getpid()}.part")
    try:
        _encode(paths, frame, part, program, fps or default_rate(len(paths)))
        replace_file(part, out)
    finally:
        part.unlink(missing_ok=True)
    return out


def default_rate(frames: int) -> float:
    """Return the frame rate of a film of so many frames [1/s]."""
    return min(max(frames / DURATION, SLOWEST), FASTEST)


def find_ffmpeg() -> str:
    """Return the program ffmpeg: that of imageio-ffmpeg, or else the system's.

    Raises
    ------
    MpisphError
        If there is neither.
    """
    try:
        # Imported here: it is an extra.
        from imageio_ffmpeg import get_ffmpeg_exe

        return str(get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        found = shutil.which("ffmpeg")
        if found is None:
            raise MpisphError(
                'films need ffmpeg: pip install "mpisph[animate]"'
            ) from error
        return found


def _encode(
    paths: list[Path], frame: "Frame", out: Path, program: str, fps: float
) -> None:
    """Write the film to `out`."""
    # The format by name, for the file's own does not end with it; its table goes to the
    # front, so that a browser can start before it has all.
    options = ["-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    options += ["-f", "mp4"]
    writer = FFMpegWriter(fps=fps, codec="libx264", extra_args=options)  # type: ignore
    with mpl.rc_context({**STYLE, "animation.ffmpeg_path": program}):
        try:
            # Absolute: ffmpeg takes "-name" for an option, and "name:" for a protocol.
            with writer.saving(frame.figure, str(out.absolute()), FILM.dpi):
                for path in paths:
                    frame.show(read_snapshot(path))
                    writer.grab_frame()
        except (BrokenPipeError, subprocess.CalledProcessError) as error:
            raise MpisphError(f"{out}: {program} could not write the film") from error


class Frame:
    """A figure that shows one snapshot after another in the same view.

    Parameters
    ----------
    case : Case
    view : View
        Widened where the frame would be too narrow.
    layout : FrameLayout
    shadings : sequence of Shading, optional
        What the colours show, see `Dots`.

    Attributes
    ----------
    figure : matplotlib.figure.Figure
        Width and height are even numbers of pixels, as films need.
    """

    def __init__(
        self,
        case: Case,
        view: View,
        layout: FrameLayout,
        shadings: Sequence[Shading] = BODIES,
    ) -> None:
        self._case = case
        if any(x.has_bar for x in shadings):
            left, _, bottom, top = layout.margins
            layout = layout._replace(margins=(left, BAR_MARGIN, bottom, top))
        self._layout = layout
        self._title = _title_lines(case, view, layout)
        # The legend stands below the label of the axis.
        entries = legend_entries(case, shadings)
        below = math.ceil(entries / _COLUMNS) if layout.lettered else 0
        self.view, self.figure, box = _fit(view, layout, len(self._title), below)
        with mpl.rc_context(STYLE):
            self._axes = self.figure.add_axes(box)
            self._set_axes()
            self._dots = Dots(self._axes, case, self.view, shadings)
            draw_surroundings(self._axes, case)
            draw_bars(self._axes, shadings)
            if layout.lettered:
                self._letter()

    def show(self, snapshot: Snapshot) -> None:
        """Draw the particles of a snapshot in place of those shown before.

        Parameters
        ----------
        snapshot : Snapshot
            Of the frame's case.
        """
        self._dots.show(snapshot)
        if self._layout.lettered:
            self._axes.set_title(f"t = {snapshot.time * 1e6:.2f} µs", loc="right")

    def save(self, out: Out) -> None:
        """Write the frame as a picture; see `style.save`."""
        save(self.figure, out)

    def _set_axes(self) -> None:
        axes = self._axes
        set_limits(axes, self.view)
        axes.locator_params(nbins=8 if self._layout.lettered else 3)

    def _letter(self) -> None:
        """Name the case, the axes and what the legend explains."""
        axes = self._axes
        axes.set_title("\n".join(self._title), loc="left", parse_math=False)
        axes.set_xlabel("axial position z [mm]", loc="left")
        axes.set_ylabel("radius r [mm]")
        handles, names = axes.get_legend_handles_labels()
        self.figure.legend(
            handles,
            names,
            loc="lower left",
            bbox_to_anchor=(axes.get_position().x0 - 0.02, 0.0),
            ncols=_COLUMNS,
        )


def _axes_width(view: View, layout: FrameLayout) -> float:
    """Return the width of the axes that fits the view [pixels]."""
    margin = (layout.margins[0] + layout.margins[1]) * layout.dpi
    fitting = min(layout.widest - margin, layout.highest / view.aspect)
    return max(fitting, layout.narrowest - margin)


def _title_lines(case: Case, view: View, layout: FrameLayout) -> list[str]:
    """Return the title in two lines at most, which leave room for the time."""
    if not layout.lettered:
        return []
    letters = int(_axes_width(view, layout) / (_LETTER * layout.dpi)) - _TIME_LETTERS
    return textwrap.wrap(case.title, letters, max_lines=2, placeholder=" …")


def _fit(
    view: View, layout: FrameLayout, lines: int, below: int
) -> tuple[View, Figure, tuple[float, float, float, float]]:
    """Return the view of the frame's shape, its figure and the place of the axes.

    Rounding to even pixels is left to the radius, so that both scales are one.
    """
    left, right, bottom, top = (margin * layout.dpi for margin in layout.margins)
    top += lines * _LINE * layout.dpi
    bottom += below * _LINE * layout.dpi
    width = _axes_width(view, layout)
    height = min(width * view.aspect, layout.highest)
    columns = 2 * round(0.5 * (left + width + right))
    rows = 2 * round(0.5 * (bottom + height + top))
    width, height = columns - left - right, rows - bottom - top
    span = max(view.z_high - view.z_low, 2.0 * view.r_high * width / height)
    missing = 0.5 * (span - (view.z_high - view.z_low))
    fitted = View(
        view.z_low - missing, view.z_high + missing, 0.5 * span * height / width
    )
    box = (left / columns, bottom / rows, width / columns, height / rows)
    size = (columns / layout.dpi, rows / layout.dpi)
    return fitted, Figure(figsize=size, dpi=layout.dpi), box
