"""Figures of the debris cloud, beside the measured one."""

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.case import Case, case_from_dict
from mpisph.case.sections import Exposure
from mpisph.core.words import grouped
from mpisph.diagnostics.cloud import (
    CloudDefinition,
    CloudErrors,
    CloudMeasure,
    cloud_definition,
    compare,
    in_cloud,
)
from mpisph.figures.dots import (
    BAR_MARGIN,
    BODIES,
    Dots,
    Shading,
    draw_bars,
    find_shadings,
    halves_text,
    legend_entries,
)
from mpisph.figures.fields import Chosen, condition_fields, require_fields
from mpisph.figures.history import RunHistory, draw_history, shield_figures
from mpisph.figures.shield import SHIELD_FILE, draw_shield
from mpisph.figures.style import (
    BOX,
    COMPUTED,
    DPI,
    MEASURED,
    STYLE,
    WIDTH,
    Out,
    save,
)
from mpisph.figures.view import (
    View,
    body_view,
    choose_view,
    common_view,
    draw_surroundings,
    exposure_at,
    measure_cloud,
    only_finite,
    set_limits,
    title_lines,
)
from mpisph.io.snapshot import Snapshot, read_series, read_snapshot
from mpisph.io.stored_run import read_run

FIGURES_FOLDER = "figures"
CONDITION_FILE = "condition.png"

_MARGIN = 0.12
# Right of the axes, where no colour bar is [in].

_COLUMNS = 4
# Of the legend where it names bodies alone.

_SIZES = 3
# Lines of the legend that tell sizes of the cloud.

_NO_ERRORS = CloudErrors(None, None)


def draw_run(
    folder: Path, chosen: Sequence[Chosen] = (), zoom: str | None = None
) -> list[Path]:
    """Draw every snapshot of a run, all in one view and with the same colours.

    The files are ``figures/cloud_<time>us.png``, with the fields instead of ``cloud``
    where these are chosen; of a shield without measurements there are none but with
    fields. Exposures are drawn in at their nominal times and at those
    with the clock offset added. Of a body alone they are
    ``figures/cloud_<body>_<time>us.png``, without exposures.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    chosen : sequence of Chosen, optional
        What the colours show: one field, or those above and below the axis. By default
        it is the bodies; where models give it, the condition of the matter at the end
        is drawn as well, in `CONDITION_FILE`, and of a shield cuts, wall and momentum.
    zoom : str, optional
        Body that is shown close by (`body_view`), instead of all other figures.

    Returns
    -------
    list of Path
        The figures, in order of time; those of the whole run are the last.

    Raises
    ------
    InputError
        If the snapshots lack a field, or the case the body.
    OSError
        If a snapshot cannot be read or a figure cannot be written.
    """
    series = read_series(folder)
    if not series:
        return []
    paths = [path for path, _ in series]
    first = read_snapshot(paths[0])
    require_fields(chosen, first.arrays, folder)
    case = case_from_dict(tomllib.loads(first.case))
    home = folder / FIGURES_FOLDER
    name = "_".join(each.field.name for each in chosen) or "cloud"
    stamps = _time_stamps([time for _, time in series])
    if zoom is not None:
        view = body_view(paths, case, zoom)
        figures = [home / f"{name}_{zoom}_{stamp}.png" for stamp in stamps]
        _draw_series(case, view, chosen, series, figures, exposures=False)
        return figures
    view = common_view(paths, case)
    figures = []
    if chosen or case.shield is None or case.measured is not None:
        figures = [home / f"{name}_{stamp}.png" for stamp in stamps]
        _draw_series(case, view, chosen, series, figures)
    if not chosen and (condition := condition_fields(case)):
        figures.append(home / CONDITION_FILE)
        _draw_series(case, view, condition, series[-1:], figures[-1:])
    if not chosen and case.shield is not None:
        figures += _draw_judged(folder, home)
    return figures


def _draw_judged(folder: Path, home: Path) -> list[Path]:
    """Draw what tells how the wall of a shield comes to its verdict."""
    # Imported here: of all cases, only shields need scipy.
    from mpisph.figures.wall import WALL_FILE, draw_wall

    run = read_run(folder)
    draw_shield(run, home / SHIELD_FILE)
    draw_wall(run, home / WALL_FILE)
    drawn = [home / SHIELD_FILE, home / WALL_FILE]
    history = RunHistory.of(run)
    for figure in shield_figures(history):
        drawn.append(home / f"{figure.name}.png")
        draw_history(figure, history, drawn[-1])
    return drawn


def _draw_series(
    case: Case,
    view: View,
    chosen: Sequence[Chosen],
    series: Sequence[tuple[Path, float]],
    figures: Sequence[Path],
    exposures: bool = True,
) -> None:
    """Draw snapshots, given with their times [s], with the same colours."""
    snapshots = (read_snapshot(path) for path, _ in series)
    shadings = find_shadings(chosen, snapshots, view, case) or BODIES
    for (path, time), out in zip(series, figures, strict=True):
        exposure = exposure_at(case, time) if exposures else None
        draw_cloud(path, case, out, None, exposure, view, shadings)


def _time_stamps(times: list[float]) -> list[str]:
    """Return the times in us, with digits enough to differ."""
    names: list[str] = []
    for digits in range(2, 10):
        width = digits + 3
        names = [f"{time * 1e6:0{width}.{digits}f}us" for time in times]
        if len(set(names)) == len(names):
            break
    return names


def draw_cloud(
    snapshot_path: Path,
    case: Case,
    out: Out,
    measure: CloudMeasure | None = None,
    exposure: Exposure | None = None,
    view: View | None = None,
    shadings: Sequence[Shading] = BODIES,
) -> None:
    """Draw the particles of a snapshot, mirrored about the axis.

    Parameters
    ----------
    snapshot_path : Path
    case : Case
    out : Path or BytesIO
    measure : CloudMeasure, optional
        By default the cloud is measured from the snapshot.
    exposure : Exposure, optional
        What was measured; without it nothing is drawn in beside the cloud.
    view : View, optional
        By default that of this snapshot alone.
    shadings : sequence of Shading, optional
        What the colours show, see `Dots`.

    Raises
    ------
    OSError
        If the snapshot cannot be read or the figure cannot be written.
    """
    snapshot = only_finite(read_snapshot(snapshot_path))
    definition = cloud_definition(case)
    measure = measure or measure_cloud(snapshot, case)
    view = view or choose_view(snapshot, case, exposure, measure)
    lines = title_lines(case, snapshot.time, exposure) + halves_text(shadings)
    with mpl.rc_context(STYLE):
        right = BAR_MARGIN if any(x.has_bar for x in shadings) else _MARGIN
        legend_lines = _legend_lines(case, shadings)
        figure, axes = _make_axes(view, right, len(lines), legend_lines)
        # A dollar sign of the user's title begins no formula.
        axes.set_title("\n".join(lines), loc="left", parse_math=False)
        Dots(axes, case, view, shadings).show(snapshot)
        draw_bars(axes, shadings)
        draw_surroundings(axes, case)
        if exposure is not None:
            _fill_first_column(axes)
            _draw_sizes(axes, definition, measure, exposure, view)
        _add_count(axes, snapshot, definition, view, right - _MARGIN)
        handles, names = axes.get_legend_handles_labels()
        figure.legend(
            handles,
            names,
            loc="lower left",
            bbox_to_anchor=(axes.get_position().x0 - 0.01, 0.0),
            ncols=_COLUMNS if exposure is None else 2,
        )
        save(figure, out)


def _make_axes(
    view: View, right: float, title_lines: int, legend_lines: int
) -> tuple[Figure, Axes]:
    """Return a figure whose axes have one scale for both directions."""
    left = 0.62
    bottom, top = 0.6 + 0.175 * legend_lines, 0.2 + 0.19 * title_lines
    width = WIDTH - left - right
    height = width * view.aspect
    size = (WIDTH, bottom + height + top)
    figure = Figure(figsize=size, dpi=DPI)
    box = (left / size[0], bottom / size[1], width / size[0], height / size[1])
    axes = figure.add_axes(box)
    set_limits(axes, view)
    axes.set_xlabel("axial position z [mm]", loc="left")
    axes.set_ylabel("radius r [mm]")
    return figure, axes


def _legend_lines(case: Case, shadings: Sequence[Shading]) -> int:
    """Return the lines of the legend, as many in all figures of a run."""
    entries = legend_entries(case, shadings)
    if case.measured is not None and case.measured.exposures:
        return max(entries, _SIZES)
    return math.ceil(entries / _COLUMNS)


def _fill_first_column(axes: Axes) -> None:
    """Add empty entries to the legend, so that sizes stand in its second column."""
    for _ in range(len(axes.get_legend_handles_labels()[0]), _SIZES):
        axes.plot([], [], " ", label=" ")


def _draw_sizes(
    axes: Axes,
    definition: CloudDefinition,
    measure: CloudMeasure,
    exposure: Exposure,
    view: View,
) -> None:
    """Draw in the measured and the computed R_b and L_b, with their labels."""
    rear, direction = definition.rear * 1e3, definition.direction
    arrived = math.isnan(measure.mass)
    lengths = (_in_mm(exposure.length), None if arrived else measure.length * 1e3)
    radii = (_in_mm(exposure.radius), None if arrived else measure.radius * 1e3)
    errors = _NO_ERRORS if arrived else compare(measure, exposure)
    outermost = _size_label("computed, outermost", radii[1], lengths[1], errors)
    labels = (
        _size_label("measured", radii[0], lengths[0], _NO_ERRORS),
        "computed: the cloud has reached the next body" if arrived else outermost,
    )
    for kind, style in enumerate((MEASURED, COMPUTED)):
        axes.plot([], [], label=labels[kind], **style)
        length, radius = lengths[kind], radii[kind]
        if length is not None:
            axes.axvline(rear + direction * length, zorder=3, **style)
        if radius is not None:
            end = rear + direction * (length or 0.0)
            axes.hlines([-radius, radius], rear, end, zorder=3, **style)
    ends = [length and direction * length for length in lengths]
    _label_length(axes, rear, (ends[0], ends[1]), view)
    _label_radius(axes, definition, radii)
    if arrived:
        return
    share = f"computed, {100 * definition.quantile:g} % of the mass"
    robust = (1e3 * measure.radius_robust, 1e3 * measure.length_robust)
    axes.plot([], [], " ", label=_size_label(share, *robust, _NO_ERRORS))


def _label_length(
    axes: Axes, rear: float, lengths: tuple[float | None, float | None], view: View
) -> None:
    """Label the lines across the axis; that at the higher z to its right."""
    for name, length, other in _with_other(lengths):
        outer = other is None or length >= other
        axes.annotate(
            f"$L_b$ {name}",
            (rear + length, view.r_high),
            (3 if outer else -3, -5),
            textcoords="offset points",
            ha="left" if outer else "right",
            va="top",
            rotation=90,
            fontsize=8.5,
            bbox=BOX,
            zorder=4,
        )


def _label_radius(
    axes: Axes,
    definition: CloudDefinition,
    radii: tuple[float | None, float | None],
) -> None:
    """Label the lines along the axis; the outer one on its outer side."""
    for name, radius, other in _with_other(radii):
        outer = other is None or radius >= other
        axes.annotate(
            f"$R_b$ {name}",
            (definition.rear * 1e3, radius),
            (5 * definition.direction, 3 if outer else -3),
            textcoords="offset points",
            ha="left" if definition.direction > 0.0 else "right",
            va="bottom" if outer else "top",
            fontsize=8.5,
            bbox=BOX,
            zorder=4,
        )


def _with_other(
    sizes: tuple[float | None, float | None],
) -> list[tuple[str, float, float | None]]:
    """Return name and size of what there is, and the size of its counterpart."""
    measured, computed = sizes
    both = [("measured", measured, computed), ("computed", computed, measured)]
    return [(name, size, other) for name, size, other in both if size is not None]


def _size_label(
    name: str, radius: float | None, length: float | None, errors: CloudErrors
) -> str:
    """Return a line of the legend with the sizes [mm] and their errors."""
    parts = []
    sizes = (("R_b", radius, errors.radius), ("L_b", length, errors.length))
    for symbol, size, error in sizes:
        if size is not None:
            percent = "" if error is None else f" ({_percent(error)})"
            parts.append(f"${symbol}$ {size:.1f} mm{percent}")
    return f"{name}: {', '.join(parts)}"


def _percent(error: float) -> str:
    """Return a signed percentage of at most six characters."""
    percent = 100.0 * error
    return f"{percent:+.{int(abs(percent) < 100.0)}f} %".replace("-", "\u2212")


def _add_count(
    axes: Axes,
    snapshot: Snapshot,
    definition: CloudDefinition,
    view: View,
    beyond: float,
) -> None:
    """Say how many particles there are, and how many the limits leave out.

    The text may go beyond the axes, by so much [in].
    """
    a = snapshot.arrays
    hidden = ~view.shows(a["z"] * 1e3, a["r"] * 1e3)
    n, left_out = len(hidden), np.count_nonzero(hidden)
    text = f"{grouped(n)} particles, mirrored about the axis"
    if left_out:
        debris = in_cloud(a["body"], a["z"], a["u_z"], definition)
        of_cloud = np.count_nonzero(hidden & debris)
        text += f"; {left_out} outside this view, {of_cloud} of them of the cloud"
    axes.annotate(
        text,
        (1.0, 0.0),
        (72.0 * beyond, -22),
        xycoords="axes fraction",
        textcoords="offset points",
        ha="right",
        va="top",
        fontsize=7.5,
        color="0.3",
    )


def _in_mm(length: float | None) -> float | None:
    return None if length is None else 1e3 * length
