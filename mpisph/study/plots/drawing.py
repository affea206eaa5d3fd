"""The figure of a study: its table, made ready for `figures`, and drawn."""

from collections.abc import Callable, Sequence
from pathlib import Path

from mpisph.figures.convergence import draw_convergence
from mpisph.study.model import FigureSpec, Study
from mpisph.study.plots.curves import lines_figure
from mpisph.study.plots.levels import convergence_panels
from mpisph.study.plots.maps import map_figure
from mpisph.study.plots.shots import shots_figure
from mpisph.study.plots.study_lines import draw_lines
from mpisph.study.plots.study_map import draw_map
from mpisph.study.plots.study_shots import draw_shots
from mpisph.study.store import study_folder
from mpisph.study.table import Row

FIGURE_FILE = "figure.png"


def draw_study(study: Study, rows: Sequence[Row], root: Path) -> Path | None:
    """Draw the figure of a study into its folder.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        From `collect`.
    root : Path
        See `store`.

    Returns
    -------
    Path or None
        The figure; None where the study describes none, or no run has come so far as
        to be drawn.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    spec = study.file.figure
    if spec is None or not any(row["status"] == "completed" for row in rows):
        return None
    out_png = study_folder(root, study) / FIGURE_FILE
    return _DRAW[spec.kind](study, spec, rows, out_png)


def _draw_lines(study: Study, spec: FigureSpec, rows: Sequence[Row], out: Path) -> Path:
    return draw_lines(lines_figure(study, spec, rows), out)


def _draw_map(study: Study, spec: FigureSpec, rows: Sequence[Row], out: Path) -> Path:
    return draw_map(map_figure(study, spec, rows), out)


def _draw_shots(study: Study, spec: FigureSpec, rows: Sequence[Row], out: Path) -> Path:
    return draw_shots(shots_figure(study, spec, rows), out)


def _draw_convergence(
    study: Study, spec: FigureSpec, rows: Sequence[Row], out: Path
) -> Path | None:
    panels = convergence_panels(study, spec, rows)
    return draw_convergence(panels, out) if panels else None


_DRAW: dict[str, Callable[[Study, FigureSpec, Sequence[Row], Path], Path | None]] = {
    "lines": _draw_lines,
    "map": _draw_map,
    "shots": _draw_shots,
    "convergence": _draw_convergence,
}
