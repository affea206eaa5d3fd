"""Films of a run's snapshots."""

import os
import shutil
import subprocess
import tomllib
from pathlib import Path

import matplotlib as mpl
from matplotlib.animation import FFMpegWriter

from mpisph.case import Case, case_from_dict
from mpisph.core.errors import MpisphError
from mpisph.figures.frames import FILM, Frame, common_view
from mpisph.figures.style import STYLE
from mpisph.io.files import replace_file
from mpisph.io.snapshot import read_series, read_snapshot

FILM_FILE = "film.mp4"

DURATION = 6.0
"""How long a film takes by default, where `SLOWEST` and `FASTEST` allow it [s]."""

SLOWEST, FASTEST = 2.0, 25.0
"""Limits of the default frame rate [1/s]."""

_MORE = "`--set output.every=0.1us` of `mpisph run` writes more"


def animate(folder: Path, out: Path, fps: float | None = None) -> Path:
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

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    MpisphError
        If there is no ffmpeg, if the run has fewer than two snapshots, or if the film
        cannot be encoded.
    OSError
        If a snapshot cannot be read or the film cannot be written.
    """
    program = find_ffmpeg()
    paths = [path for path, _ in read_series(folder)]
    if len(paths) < 2:
        raise MpisphError(
            f"{folder}: {len(paths)} snapshots, a film needs two or more; is it a "
            f"run's folder? {_MORE}"
        )
    case = case_from_dict(tomllib.loads(read_snapshot(paths[0]).case))
    out.parent.mkdir(parents=True, exist_ok=True)
    part = out.with_name(f"{out.name}.{os.uname().nodename}-{os.getpid()}.part")
    try:
        _encode(paths, case, part, program, fps or default_rate(len(paths)))
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


def _encode(paths: list[Path], case: Case, out: Path, program: str, fps: float) -> None:
    """Write the film to `out`."""
    frame = Frame(case, common_view(paths, case), FILM)
    # The format by name, for the file's own does not end with it; its table goes to the
    # front, so that a browser can start before it has all.
    options = ["-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    options += ["-f", "mp4"]
    writer = FFMpegWriter(fps=fps, codec="libx264", extra_args=options)  # type: ignore
    with mpl.rc_context({**STYLE, "animation.ffmpeg_path": program}):
        try:
            with writer.saving(frame.figure, str(out), FILM.dpi):
                for path in paths:
                    frame.show(read_snapshot(path))
                    writer.grab_frame()
        except (BrokenPipeError, subprocess.CalledProcessError) as error:
            raise MpisphError(f"{out}: {program} could not write the film") from error
