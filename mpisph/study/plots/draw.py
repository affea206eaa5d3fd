"""The figure of a study, of whichever kind its file asks for."""

from collections.abc import Sequence
from pathlib import Path

from mpisph.figures.style import Out
from mpisph.study.model import Study
from mpisph.study.plots.convergence import convergence_panels, draw_convergence
from mpisph.study.plots.lines import draw_lines, lines_figure
from mpisph.study.plots.map import draw_map, map_figure
from mpisph.study.plots.shots import draw_shots, shots_figure
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
        The figure; None where it cannot be drawn, see `can_draw`.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    if not can_draw(study, rows):
        return None
    out = study_folder(root, study) / FIGURE_FILE
    draw_figure(study, rows, out)
    return out


def can_draw(study: Study, rows: Sequence[Row]) -> bool:
    """Say whether a study describes a figure, and its runs have come so far.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        From `collect`.
    """
    spec = study.file.figure
    if spec is None or not any(row["status"] == "completed" for row in rows):
        return False
    return spec.kind != "convergence" or bool(convergence_panels(study, spec, rows))


def draw_figure(study: Study, rows: Sequence[Row], out: Out) -> None:
    """Draw the figure of a study; only where it can be drawn.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        From `collect`.
    out : Path or BytesIO

    Raises
    ------
    OSError
        If it cannot be written.
    """
    spec = study.file.figure
    assert spec is not None, "it can be drawn"
    match spec.kind:
        case "lines":
            draw_lines(lines_figure(study, spec, rows), out)
        case "map":
            draw_map(map_figure(study, spec, rows), out)
        case "shots":
            draw_shots(shots_figure(study, spec, rows), out)
        case "convergence":
            panels = convergence_panels(study, spec, rows)
            draw_convergence(panels, study.file.title, out)
