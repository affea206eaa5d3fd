"""What a figure of particles shows: its limits, and what surrounds the particles."""

import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from mpisph.case import Case, Plate
from mpisph.case.contact import time_origin
from mpisph.case.sections import Exposure
from mpisph.case.shield import Shield
from mpisph.case.target import rear_position
from mpisph.case.times import same_time
from mpisph.core.errors import InputError
from mpisph.core.particles import FloatArray
from mpisph.diagnostics.cloud import (
    CloudDefinition,
    CloudMeasure,
    cloud_definition,
    impact_direction,
    measure_arrays,
    place_of,
    target_plate,
)
from mpisph.figures.style import BEHIND_PLANE, REAR_FACE
from mpisph.io.snapshot import Snapshot, read_snapshot

_STRAY = 0.002
# Fraction of what moves that may fall outside of the limits at each end.

_NOT_STRAY = 1.3
# An outermost particle within this multiple of the robust figure is shown.

_LONE = 0.02
# Fraction of what moves in a shield that may fall outside.

_BEFORE, _BEHIND = 2.0, 0.35
# What is shown of a shield before the first bumper, in diameters of the projectile; at
# most behind the wall, in depths of the shield.

_OF_BODY, _AROUND, _TALL = 0.01, 0.06, 1.6
# Of a body shown close by: the share of its particles that may fall outside at each
# end; the margin over its extent; the view's height over its width, at most.

_STIRRED = 0.01
# Speed over that of the impact from which matter of a shield counts as moving.


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


def measure_cloud(snapshot: Snapshot, case: Case) -> CloudMeasure:
    """Measure the debris cloud of a snapshot."""
    return measure_arrays(snapshot.arrays, cloud_definition(case))


def choose_view(
    snapshot: Snapshot,
    case: Case,
    exposure: Exposure | None,
    measure: CloudMeasure | None = None,
    headroom: float = 1.4,
) -> View:
    """Choose limits that hold the plate, the cloud and what was measured.

    Strays are left to fall outside: the robust measures decide, and where they
    lie near them the outermost ones. Of a shield the limits hold what lies from the
    first bumper to the wall.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case
    exposure : Exposure or None
    measure : CloudMeasure, optional
        By default the cloud is measured from the snapshot.
    headroom : float, optional
        Height of the view over that of the cloud; by default there is room above it
        for labels.

    Returns
    -------
    View
    """
    if case.shield is not None and exposure is None:
        return _shield_view(snapshot, case, case.shield)
    measure = measure or measure_cloud(snapshot, case)
    definition = cloud_definition(case)
    ends, sides = [], []
    for body in case.bodies:
        if isinstance(body, Plate):
            ends += [body.position, body.rear_face]
    if measure.mass > 0.0:
        length = _without_stray(measure.length, measure.length_robust)
        ends.append(place_of(length, definition))
        sides.append(_without_stray(measure.radius, measure.radius_robust))
    else:
        z, r = _moving_extent(snapshot, definition)
        ends += z
        sides.append(r)
    if exposure is not None:
        ends.append(place_of(exposure.length or 0.0, definition))
        sides.append(exposure.radius or 0.0)
    return _round_view(min(ends) * 1e3, max(ends) * 1e3, max(sides) * 1e3, headroom)


def common_view(
    paths: Sequence[Path], case: Case, exposures: bool = True, headroom: float = 1.4
) -> View:
    """Return limits that hold what each snapshot alone would show (`choose_view`).

    Parameters
    ----------
    paths : sequence of Path
        The snapshots, at least one.
    case : Case
    exposures : bool, optional
        Whether to hold as well what was measured at the snapshots' times.
    headroom : float, optional

    Returns
    -------
    View

    Raises
    ------
    OSError
        If a snapshot cannot be read.
    """
    views = []
    for path in paths:
        snapshot = only_finite(read_snapshot(path))
        exposure = exposure_at(case, snapshot.time) if exposures else None
        views.append(choose_view(snapshot, case, exposure, headroom=headroom))
    return View(
        min(view.z_low for view in views),
        max(view.z_high for view in views),
        max(view.r_high for view in views),
    )


def body_view(paths: Sequence[Path], case: Case, name: str) -> View:
    """Return limits that hold one body at all times, but for its strays.

    Parameters
    ----------
    paths : sequence of Path
        The snapshots, at least one.
    case : Case
    name : str
        Of a body of the case.

    Returns
    -------
    View
        No wider than that of the whole run (`common_view`).

    Raises
    ------
    InputError
        If no body has the name; it says which there are.
    OSError
        If a snapshot cannot be read.
    """
    names = [body.name for body in case.bodies]
    if name not in names:
        raise InputError(f"--zoom {name}: no such body; there are {', '.join(names)}")
    whole = common_view(paths, case, exposures=False)
    low, high, radius = [], [], []
    for path in paths:
        arrays = only_finite(read_snapshot(path)).arrays
        mine = arrays["body"] == names.index(name)
        if mine.any():
            ends = np.quantile(arrays["z"][mine], [_OF_BODY, 1.0 - _OF_BODY])
            low.append(1e3 * float(ends[0]))
            high.append(1e3 * float(ends[1]))
            r = np.quantile(arrays["r"][mine], 1.0 - _OF_BODY)
            radius.append(1e3 * float(r))
    if not radius:  # a run from particles of its own may have none of a body
        return whole
    return _within(_close_view(min(low), max(high), max(radius)), whole)


def _close_view(z_low: float, z_high: float, r_high: float) -> View:
    """Add margins [mm], and what a strip lacks in width or height."""
    margin = _AROUND * max(z_high - z_low, 2.0 * r_high)
    r_high = max(r_high + margin, 0.3 * (z_high - z_low + 2.0 * margin), 1e-6)
    span = max(z_high - z_low + 2.0 * margin, 2.0 * r_high / _TALL)
    middle = 0.5 * (z_low + z_high)
    return View(middle - 0.5 * span, middle + 0.5 * span, r_high)


def _within(view: View, whole: View) -> View:
    """Move into another view, and cut off what is wider; not where they do not meet."""
    if view.z_high <= whole.z_low or view.z_low >= whole.z_high:
        return view
    span = min(view.z_high - view.z_low, whole.z_high - whole.z_low)
    low = min(max(view.z_low, whole.z_low), whole.z_high - span)
    return View(low, low + span, min(view.r_high, whole.r_high))


def _shield_view(snapshot: Snapshot, case: Case, shield: Shield) -> View:
    """Hold projectile, bumpers, cloud and wall, and the start of what comes off it.

    What is thrown back, and what flies past the wall, does not widen the view.
    """
    a, d = snapshot.arrays, shield.projectile.diameter
    low, rear = -_BEFORE * d, case.bodies[-1].section.ends[1]
    behind = a["z"][a["z"] > rear] - rear
    reach = float(np.quantile(behind, 1.0 - _LONE)) if behind.size else 0.0
    high = rear + min(1.2 * reach + 0.5 * d, max(_BEHIND * rear, d)) + 0.5 * d
    moving = np.hypot(a["u_r"], a["u_z"]) > _STIRRED * shield.projectile.velocity
    moving &= (a["z"] > 0.0) & (a["z"] < high)
    width = max(body.section.widest for body in case.bodies)
    radius = float(np.quantile(a["r"][moving], 1.0 - _LONE)) if moving.any() else 0.0
    radius = max(min(radius, width), 0.3 * (high - low), d)
    return View(1e3 * low, 1e3 * high, 1.04e3 * radius)


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


def draw_surroundings(axes: Axes, case: Case) -> None:
    """Draw in original rear faces of plates, and what lies behind rigid planes.

    Parameters
    ----------
    axes : Axes
        With its final limits; its legend gets one entry for the faces, and one for the
        planes if any is within them.
    case : Case
    """
    _draw_rear_faces(axes, case)
    _draw_planes(axes, case)


def rear_faces(case: Case) -> list[float]:
    """Return the original rear faces of plates that stand as the target does [m]."""
    target, direction = target_plate(case), impact_direction(case)
    return [
        rear_position(body, direction)
        for body in case.bodies
        if isinstance(body, Plate) and target and body.velocity == target.velocity
    ]


def _draw_rear_faces(axes: Axes, case: Case) -> None:
    """Draw in the rear faces, with one entry in the legend for all."""
    faces = rear_faces(case)
    name = "original rear face" + "s" * (len(faces) > 1)
    for index, z in enumerate(faces):
        axes.axvline(z * 1e3, label="_" * (index > 0) + name, zorder=1, **REAR_FACE)


def _draw_planes(axes: Axes, case: Case) -> None:
    """Hatch what lies behind the rigid planes of a case, up to the edge of the axes."""
    label = "rigid plane"
    left, right = axes.get_xlim()
    low, high = (1e3 * plane for plane in case.boundary.planes)
    for ends in ((left, low), (high, right)):
        if ends[0] < ends[1]:
            axes.axvspan(*ends, zorder=1, label=label, **BEHIND_PLANE)
            label = "_" + label


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
    when = f"t = {time * 1e6:.2f} µs {time_origin(case.bodies, case.boundary)}"
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
