"""Figures of the debris cloud, beside the measured one."""

import math
import textwrap
import tomllib
from pathlib import Path
from typing import NamedTuple

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from mpisph.case import Case, Plate, case_from_dict
from mpisph.case.sections import Exposure
from mpisph.case.times import same_time
from mpisph.core.particles import FloatArray
from mpisph.diagnostics.cloud import (
    CloudDefinition,
    CloudErrors,
    CloudMeasure,
    cloud_definition,
    compare,
    in_cloud,
    measure_arrays,
)
from mpisph.figures.style import (
    BODY_COLOURS,
    BOX,
    COMPUTED,
    DPI,
    MEASURED,
    REAR_FACE,
    STYLE,
    WIDTH,
)
from mpisph.io.snapshot import Snapshot, read_series, read_snapshot

FIGURES_FOLDER = "figures"

_NO_ERRORS = CloudErrors(None, None)

_MOST_POINTS = 400_000
# More points than this in a figure of 1400 pixels only cover each other.

_STRAY = 0.002
# Fraction of what moves that may fall outside of the limits at each end.

_NOT_STRAY = 1.3
# An outermost particle within this multiple of the robust figure is shown.


class View(NamedTuple):
    """Limits of the axes, mirrored about the axis of symmetry [mm].

    Attributes
    ----------
    z_low, z_high : float
    r_high : float
        Both upwards and downwards.
    """

    z_low: float
    z_high: float
    r_high: float

    @property
    def aspect(self) -> float:
        """Height over width."""
        return 2.0 * self.r_high / (self.z_high - self.z_low)

    def shows(self, z: FloatArray, r: FloatArray) -> npt.NDArray[np.bool_]:
        """Say which of the particles [mm] are within the limits."""
        return (z >= self.z_low) & (z <= self.z_high) & (r <= self.r_high)


def draw_run(folder: Path) -> list[Path]:
    """Draw every snapshot of a run to ``figures/cloud_<time>us.png``.

    Exposures are drawn in at their nominal times and at those with the clock
    offset added.

    Parameters
    ----------
    folder : Path
        Folder of the run.

    Returns
    -------
    list of Path
        The figures, in order of time.

    Raises
    ------
    OSError
        If a snapshot cannot be read or a figure cannot be written.
    """
    series = read_series(folder)
    names = _figure_names([time for _, time in series])
    figures = [folder / FIGURES_FOLDER / name for name in names]
    for (path, time), out in zip(series, figures, strict=True):
        case = case_from_dict(tomllib.loads(read_snapshot(path).case))
        draw_cloud(path, case, out, exposure=exposure_at(case, time))
    return figures


def _figure_names(times: list[float]) -> list[str]:
    """Return names with the times in us, and with digits enough to differ."""
    names: list[str] = []
    for digits in range(2, 10):
        width = digits + 3
        names = [f"cloud_{time * 1e6:0{width}.{digits}f}us.png" for time in times]
        if len(set(names)) == len(names):
            break
    return names


def exposure_at(case: Case, time: float) -> Exposure | None:
    """Return the exposure of a case that is to be compared at a time, if any.

    Parameters
    ----------
    case : Case
    time : float
        Nominal, or with the clock offset added [s].

    Returns
    -------
    Exposure or None
    """
    if case.measured is None:
        return None
    for exposure in case.measured.exposures:
        for shift in (0.0, case.measured.clock_offset):
            if same_time(time, exposure.time + shift):
                return exposure
    return None


def draw_cloud(
    snapshot_path: Path,
    case: Case,
    out_png: Path,
    measure: CloudMeasure | None = None,
    exposure: Exposure | None = None,
) -> None:
    """Draw the particles of a snapshot, mirrored about the axis.

    Parameters
    ----------
    snapshot_path : Path
    case : Case
    out_png : Path
        Its folder is made where it is missing.
    measure : CloudMeasure, optional
        By default the cloud is measured from the snapshot.
    exposure : Exposure, optional
        What was measured; without it nothing is drawn in beside the cloud.

    Raises
    ------
    OSError
        If the snapshot cannot be read or the figure cannot be written.
    """
    snapshot = only_finite(read_snapshot(snapshot_path))
    a = snapshot.arrays
    definition = cloud_definition(case)
    if measure is None:
        measure = measure_arrays(a["id"], a["r"], a["z"], a["u_z"], a["m"], definition)
    view = choose_view(snapshot, case, definition, measure, exposure)
    lines = title_lines(case, snapshot.time, exposure)
    with mpl.rc_context(STYLE):
        figure, axes = _make_axes(view, len(lines), max(len(case.bodies) + 1, 3))
        # A dollar sign of the user's title begins no formula.
        axes.set_title("\n".join(lines), loc="left", parse_math=False)
        draw_particles(axes, snapshot, case, view)
        _draw_rear_face(axes, definition)
        if exposure is not None:
            _draw_sizes(axes, definition, measure, exposure, view)
        _add_hidden_count(axes, snapshot, definition, view)
        figure.legend(
            loc="lower left",
            bbox_to_anchor=(axes.get_position().x0 - 0.01, 0.0),
            ncols=1 if exposure is None else 2,
        )
        out_png.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(out_png)


def only_finite(snapshot: Snapshot) -> Snapshot:
    """Leave out particles of which a number is not finite.

    The last snapshot of an unstable run may have such; they lie nowhere.

    Parameters
    ----------
    snapshot : Snapshot

    Returns
    -------
    Snapshot
        The same where all is finite.
    """
    sound = np.logical_and.reduce([np.isfinite(x) for x in snapshot.arrays.values()])
    if sound.all():
        return snapshot
    return snapshot._replace(arrays={n: x[sound] for n, x in snapshot.arrays.items()})


def choose_view(
    snapshot: Snapshot,
    case: Case,
    definition: CloudDefinition,
    measure: CloudMeasure,
    exposure: Exposure | None,
    headroom: float = 1.4,
) -> View:
    """Choose limits that hold the plate, the cloud and what was measured.

    Strays are left to fall outside: the robust measures decide, and where they
    lie near them the outermost ones.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case
    definition : CloudDefinition
    measure : CloudMeasure
    exposure : Exposure or None
    headroom : float, optional
        Height of the view over that of the cloud; by default there is room above it
        for labels.

    Returns
    -------
    View
    """
    ends, sides = [], []
    for body in case.bodies:
        if isinstance(body, Plate):
            ends += [body.position, body.rear_face]
    if measure.mass > 0.0:
        ends.append(
            definition.rear + _without_stray(measure.length, measure.length_robust)
        )
        sides.append(_without_stray(measure.radius, measure.radius_robust))
    else:
        z, r = _moving_extent(snapshot, definition)
        ends += z
        sides.append(r)
    if exposure is not None:
        ends.append(definition.rear + (exposure.length or 0.0))
        sides.append(exposure.radius or 0.0)
    return _round_view(min(ends) * 1e3, max(ends) * 1e3, max(sides) * 1e3, headroom)


def _without_stray(outermost: float, robust: float) -> float:
    return outermost if outermost <= _NOT_STRAY * robust else robust


def _moving_extent(
    snapshot: Snapshot, definition: CloudDefinition
) -> tuple[list[float], float]:
    """Return the range in z and the radius [m] of what moves, but for a few strays."""
    a = snapshot.arrays
    moving = np.hypot(a["u_r"], a["u_z"]) > definition.min_velocity
    if not moving.any():
        moving[:] = True
    z = np.quantile(a["z"][moving], [_STRAY, 1.0 - _STRAY]).tolist()
    return z, float(np.quantile(a["r"][moving], 1.0 - _STRAY))


def _round_view(z_low: float, z_high: float, r_high: float, headroom: float) -> View:
    """Add margins [mm], and length or height where the figure would be a strip."""
    span = max(z_high - z_low, 2.2 * r_high, 1e-6)
    missing = 0.5 * (span - (z_high - z_low))
    r_high = max(headroom * r_high, 0.3 * span)
    return View(z_low - missing - 0.15 * span, z_high + missing + 0.1 * span, r_high)


def _make_axes(view: View, title_lines: int, legend_lines: int) -> tuple[Figure, Axes]:
    """Return a figure whose axes have one scale for both directions."""
    left, right = 0.62, 0.12
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


def set_limits(axes: Axes, view: View) -> None:
    """Give axes the limits of a view, and draw in the axis of symmetry.

    Parameters
    ----------
    axes : Axes
        Of the view's aspect.
    view : View
    """
    axes.set_xlim(view.z_low, view.z_high)
    axes.set_ylim(-view.r_high, view.r_high)
    axes.yaxis.set_major_formatter(lambda r, _: f"{abs(r):g}")
    axes.axhline(0.0, color="0.6", linewidth=0.6, linestyle=(0, (8, 2, 1, 2)), zorder=1)


def draw_particles(axes: Axes, snapshot: Snapshot, case: Case, view: View) -> None:
    """Draw every body's particles as dots of the size of the spacing.

    Parameters
    ----------
    axes : Axes
        With the limits of the view; its legend gets an entry for each body.
    snapshot : Snapshot
    case : Case
    view : View
        What is outside of it is not drawn.
    """
    a = snapshot.arrays
    z, r = a["z"] * 1e3, a["r"] * 1e3
    every = 1 + len(z) // _MOST_POINTS
    drawn = view.shows(z, r) & (a["id"] % every == 0)
    points_per_mm = axes.bbox.width * 72.0 / DPI / (view.z_high - view.z_low)
    # Each dot stands for `every` particles and covers their area.
    size = case.spacing * 1e3 * every**0.5 * points_per_mm
    size = max(size, smallest_dot(len(z)))
    for index, body in enumerate(case.bodies):
        mine = drawn & (a["body"] == index)
        colour = BODY_COLOURS[index % len(BODY_COLOURS)]
        axes.plot(
            np.concatenate([z[mine], z[mine]]),
            np.concatenate([r[mine], -r[mine]]),
            linestyle="none",
            marker="o",
            markersize=size,
            markeredgewidth=0.0,
            color=colour,
            rasterized=True,
            zorder=2,
        )
        count = f"{np.count_nonzero(a['body'] == index):,}".replace(",", "\u2009")
        label = f"{body.name} ({count} particles)"
        axes.plot([], [], "o", markersize=6.0, color=colour, label=label)


def smallest_dot(n: int) -> float:
    """Return a diameter at which few dots do not fade and many do not merge.

    Parameters
    ----------
    n : int
        Number of particles.

    Returns
    -------
    float
        [pt], in a figure as wide as `WIDTH`.
    """
    return min(max(120.0 / math.sqrt(max(n, 1)), 0.5), 1.8)


def _draw_rear_face(axes: Axes, definition: CloudDefinition) -> None:
    if math.isfinite(definition.rear):
        axes.axvline(definition.rear * 1e3, label="original rear face", **REAR_FACE)


def _draw_sizes(
    axes: Axes,
    definition: CloudDefinition,
    measure: CloudMeasure,
    exposure: Exposure,
    view: View,
) -> None:
    """Draw in the measured and the computed R_b and L_b, with their labels."""
    rear = definition.rear * 1e3
    lengths = (_in_mm(exposure.length), measure.length * 1e3)
    radii = (_in_mm(exposure.radius), measure.radius * 1e3)
    errors = compare(measure, exposure)
    labels = (
        _size_label("measured", radii[0], lengths[0], _NO_ERRORS),
        _size_label("computed, outermost", radii[1], lengths[1], errors),
    )
    for kind, style in enumerate((MEASURED, COMPUTED)):
        axes.plot([], [], label=labels[kind], **style)
        length, radius = lengths[kind], radii[kind]
        if length is not None:
            axes.axvline(rear + length, zorder=3, **style)
        if radius is not None:
            end = rear + (length or 0.0)
            axes.hlines([-radius, radius], rear, end, zorder=3, **style)
    share = f"computed, {100 * definition.quantile:g} % of the mass"
    robust = (1e3 * measure.radius_robust, 1e3 * measure.length_robust)
    axes.plot([], [], " ", label=_size_label(share, *robust, _NO_ERRORS))
    _label_length(axes, rear, lengths, view)
    _label_radius(axes, rear, radii)


def _label_length(
    axes: Axes, rear: float, lengths: tuple[float | None, float | None], view: View
) -> None:
    """Label the lines across the axis; the outer one on its outer side."""
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
    axes: Axes, rear: float, radii: tuple[float | None, float | None]
) -> None:
    """Label the lines along the axis; the outer one on its outer side."""
    for name, radius, other in _with_other(radii):
        outer = other is None or radius >= other
        axes.annotate(
            f"$R_b$ {name}",
            (rear, radius),
            (5, 3 if outer else -3),
            textcoords="offset points",
            ha="left",
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


def title_lines(case: Case, time: float, exposure: Exposure | None) -> list[str]:
    """Return the case's title, and the time with the reading of the clock.

    Parameters
    ----------
    case : Case
    time : float
        [s].
    exposure : Exposure or None
        What was exposed at that time.

    Returns
    -------
    list of str
        Lines of at most 88 characters.
    """
    lines = textwrap.wrap(case.title, 88)
    when = f"t = {time * 1e6:.2f} µs after first contact"
    if exposure is not None:
        nominal = f"{exposure.time * 1e6:g} µs"
        offset = time - exposure.time
        if same_time(time, exposure.time):
            when += f": the exposure at nominal {nominal}, no clock offset"
        else:
            sign = "+" if offset > 0 else "\u2212"
            when += (
                f": the exposure at nominal {nominal} {sign} "
                f"{abs(offset) * 1e6:.2f} µs clock offset"
            )
    return [*lines, when]


def _add_hidden_count(
    axes: Axes, snapshot: Snapshot, definition: CloudDefinition, view: View
) -> None:
    """Say how many particles the limits leave out."""
    a = snapshot.arrays
    hidden = ~view.shows(a["z"] * 1e3, a["r"] * 1e3)
    debris = in_cloud(a["z"], a["u_z"], definition)
    of_cloud = np.count_nonzero(hidden & debris)
    others = np.count_nonzero(hidden) - of_cloud
    if of_cloud or others:
        axes.annotate(
            f"outside this view: {of_cloud} particles of the cloud, {others} others",
            (1.0, 0.0),
            (0, -22),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="right",
            va="top",
            fontsize=7.5,
            color="0.3",
        )


def _in_mm(length: float | None) -> float | None:
    return None if length is None else 1e3 * length
