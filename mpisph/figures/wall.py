"""A figure of a shield's wall, close by: damage, velocity, hole, crater, bulge."""

import re
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes

from mpisph.analysis.shield_history import wall_moments
from mpisph.analysis.wall import Layout, measure_wall, wall_layout
from mpisph.case import Case
from mpisph.case.contact import time_origin
from mpisph.figures.dots import (
    BAR_MARGIN,
    Dots,
    Shading,
    draw_bars,
    draw_plain,
    find_shadings,
)
from mpisph.figures.fields import SHOWN_FIELDS, Chosen, ShownField
from mpisph.figures.shield import add_legend, make_panels
from mpisph.figures.style import COMPUTED, REAR_FACE, STYLE, Out, save
from mpisph.figures.view import View, only_finite
from mpisph.io.snapshot import Snapshot, read_snapshot
from mpisph.io.stored_run import StoredRun
from mpisph.io.verdict import Verdict, WallRecord

WALL_FILE = "wall.png"

VELOCITY = ShownField(
    "axial-velocity", "axial velocity", "m/s", "m/s", 1.0, "berlin", ("u_z",),
    lambda arrays: arrays["u_z"], centred=True,
)  # fmt: skip
"""What the lower half shows."""

_ABOVE = ("damage", "ductile-damage", "plastic-strain")
# What the upper half shows: the first that the wall's models give.

_MOVED = 0.05
# Displacement, in thicknesses of the wall, from which its matter is shown.

_BEHIND = 2.0
# What is shown behind the bulge at most, in thicknesses.

_FACE: dict[str, Any] = {**REAR_FACE, "linewidth": 0.6}
_MARK: dict[str, Any] = {**COMPUTED, "linewidth": 0.9}
_MICROSECONDS = re.compile(r"(?<=\d )us\b")
_OTHER = "0.82"
# Colour of what is not the wall's.

_DAMAGED = 0.5
# Damage from which the wall's matter is shown.

_TALL = 3.4
# Height over width of a panel, at most.

_TITLE_WIDTH = 30
# Letters that stand above a panel.


@dataclass(frozen=True)
class _Shown:
    """A snapshot that is shown: that of the wall, of the rest, and what is measured."""

    wall: Snapshot
    rest: Snapshot
    record: WallRecord
    words: str


def wall_record(layout: Layout, snapshot: Snapshot) -> WallRecord:
    """Measure the wall of a snapshot.

    Parameters
    ----------
    layout : Layout
    snapshot : Snapshot
        Matter without a model of damage is sound.
    """
    arrays = snapshot.arrays
    sound = np.zeros(len(arrays["id"]))
    return measure_wall(layout, {"damage": sound, **arrays}, snapshot.time)


def draw_wall(run: StoredRun, out: Out) -> None:
    """Draw the wall while it is loaded, at the earlier of the verdicts and at the end.

    Above the axis is its damage, or else its plastic strain, below it the axial
    velocity; what is not of the wall is grey.

    Parameters
    ----------
    run : StoredRun
        Of a shield, with at least one snapshot.
    out : Path or BytesIO

    Raises
    ------
    OSError
        If a snapshot cannot be read or the figure cannot be written.
    """
    case = run.case
    shown = _choose(run)
    layout = wall_layout(case)
    view = _close_view(layout, shown)
    shadings = _shadings(case, view, [item.wall for item in shown])
    lines = [*textwrap.wrap(case.title, 88), *_verdict_lines(run)]
    above, below = (shading.field.label for shading in shadings)
    origin = time_origin(case.bodies, case.boundary)
    lines.append(f"above the axis: {above}; below: {below}; times {origin}")
    titles = [_title(item, layout) for item in shown]
    most = max(title.count("\n") for title in titles) + 1
    with mpl.rc_context(STYLE):
        figure, panels = make_panels(view, len(shown), lines, BAR_MARGIN, most)
        for axes, item, title in zip(panels, shown, titles, strict=True):
            axes.set_title(title, loc="left", fontsize=8.5, pad=4.0)
            _draw_panel(axes, case, view, shadings, item)
            _draw_marks(axes, layout, item.record)
        draw_bars(panels[-1], shadings)
        add_legend(figure, panels[0])
        save(figure, out)


def _choose(run: StoredRun) -> list[_Shown]:
    """Return the snapshots that are shown, with what is measured on them."""
    layout = wall_layout(run.case)
    measured = _measured(run, layout)
    shown = []
    for number, words in wall_moments(run.case, [wall for _, wall in measured]):
        path, record = measured[number]
        snapshot = only_finite(read_snapshot(path))
        mine = snapshot.arrays["body"] == layout.body
        parts = (_part(snapshot, mine), _part(snapshot, ~mine))
        shown.append(_Shown(*parts, record, words))
    return shown


def _measured(run: StoredRun, layout: Layout) -> list[tuple[Path, WallRecord]]:
    """Return the snapshots on which the wall is measured, with that.

    The last one of a run that broke down may hold particles that lie nowhere.
    """
    walls = run.result.walls if run.result else ()
    paths = [path for path, _ in run.snapshots]
    if len(walls) == len(paths):
        pairs = list(zip(paths, walls, strict=True))
    else:
        # A run at work, or one of which snapshots have been moved away.
        snapshots = [(path, read_snapshot(path)) for path in paths]
        pairs = [
            (path, wall_record(layout, snapshot))
            for path, snapshot in snapshots
            if only_finite(snapshot) is snapshot
        ]
    return [
        pair for pair in pairs if np.isfinite(list(pair[1].model_dump().values())).all()
    ]


def _part(snapshot: Snapshot, which: npt.NDArray[np.bool_]) -> Snapshot:
    arrays = {name: values[which] for name, values in snapshot.arrays.items()}
    return snapshot._replace(arrays=arrays)


def _close_view(layout: Layout, shown: Sequence[_Shown]) -> View:
    """Hold what is damaged or has moved, the bulge, and a little behind it."""
    t = layout.thickness
    bulge = max(item.record.bulge for item in shown)
    radii = [0.5 * max(item.record.hole, item.record.crater_diameter) for item in shown]
    reach, low = bulge + 0.5 * t, layout.front - 0.7 * t
    for item in shown:
        a = item.wall.arrays
        row = (a["id"] - layout.first_id) // layout.r.size
        moved = a["z"] - layout.z[row]
        hit = np.abs(moved) > max(0.7 * bulge, _MOVED * t)
        hit |= a.get("damage", np.zeros(moved.size)) >= _DAMAGED
        if hit.any():
            radii.append(float(np.quantile(a["r"][hit], 0.95)))
            reach = max(reach, float(np.quantile(a["z"][hit], 0.98)) - layout.rear)
    high = layout.rear + min(reach, bulge + _BEHIND * t)
    span = 1.04 * (high - low)
    radius = min(max(1.15 * max(radii), 0.6 * span), 1.02 * layout.r[-1])
    # Panels beside each other fill the width.
    missing = max(2.0 * radius / _TALL - span, 0.0)
    low, high = low - 0.5 * missing, low + span + 0.5 * missing
    return View(1e3 * low, 1e3 * high, 1e3 * radius)


def _title(item: _Shown, layout: Layout) -> str:
    """Return when a panel is, and what is measured then."""
    record, least = item.record, _MOVED * layout.thickness
    sizes = [("hole", record.hole), ("crater", record.crater_depth)][
        record.hole == 0.0 :
    ]
    parts = [
        f"{name} {1e3 * size:.1f} mm"
        for name, size in [*sizes[:1], ("bulge", record.bulge)]
        if size > least
    ]
    if record.detached > 0.0:
        parts.append(f"{1e3 * record.detached:.2g} g off")
    when = f"{1e6 * record.time:.1f} µs: {item.words}"
    return "\n".join([when, *textwrap.wrap(", ".join(parts), _TITLE_WIDTH)])


def _shadings(case: Case, view: View, walls: Sequence[Snapshot]) -> tuple[Shading, ...]:
    """Return the colours of both halves, the same in all panels."""
    models = case.body_models(case.bodies[-1])
    given = [SHOWN_FIELDS[n] for n in _ABOVE]
    known = [field for field in given if models.fields.issuperset(field.needs)]
    known += [SHOWN_FIELDS["plastic-strain"]]
    return find_shadings((Chosen(known[0]), Chosen(VELOCITY)), walls, view, case)


def _draw_panel(
    axes: Axes, case: Case, view: View, shadings: Sequence[Shading], item: _Shown
) -> None:
    """Draw the wall and, in grey, what lies before and behind it."""
    draw_plain(axes, item.rest, case, view, _OTHER, "projectile and bumpers")
    Dots(axes, case, view, shadings).show(item.wall)


def _draw_marks(axes: Axes, layout: Layout, record: WallRecord) -> None:
    """Draw in the original faces, and how far hole, crater and bulge reach."""
    radius = 1e3 * layout.r[-1]
    for index, z in enumerate((layout.front, layout.rear)):
        label = "_" * index + "original faces"
        axes.vlines(
            1e3 * z, -radius, radius, label=label, zorder=3,
            colors=_FACE["color"], linewidths=_FACE["linewidth"],
        )  # fmt: skip
    if record.hole > 0.0:
        for edge in (0.5e3 * record.hole, -0.5e3 * record.hole):
            axes.axhline(edge, zorder=4, **_MARK)
    else:
        depth = record.crater_depth
        for z, size in (
            (layout.front + record.bulge + depth, depth),
            (layout.rear + record.bulge, record.bulge),
        ):
            if size > _MOVED * layout.thickness:
                axes.axvline(1e3 * z, zorder=4, **_MARK)
    axes.plot([], [], label="hole, or crater and bulge", **_MARK)


def _verdict_lines(run: StoredRun) -> list[str]:
    """Return the verdict in words, where there is one."""
    verdict = run.result.verdict if run.result else None
    if verdict is None:
        return []
    return textwrap.wrap(f"{verdict.outcome}: {reason_text(verdict)}", 88)


def reason_text(verdict: Verdict) -> str:
    """Return what decides a verdict, with the letters that pictures and pages have."""
    return _MICROSECONDS.sub("µs", verdict.reason)
