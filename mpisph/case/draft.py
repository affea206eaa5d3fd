"""A first case file: a sphere on a plate, a rear wall if there is one, or a shield."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import NamedTuple

from mpisph.core.errors import CaseError, Problem

__all__ = ["Draft", "draft_case", "draft_shield"]

FINEST, COARSEST, LEAST_ROWS = 40, 10, 4
# Resolution (NPR): as much as gives the plate so many rows of particles.

FEWEST_ROWS = 3
"""Rows of particles that a plate must have unless the resolution is given."""

PLATE_RADIUS = 4.0
"""Radius of a plate in diameters of the sphere: its rim does not matter."""

WALL_RADIUS = 0.7
"""Least radius of a wall in its distance; a cloud is about as wide as it is long."""

CLOUD_LENGTH = 6.0
"""Flight after the impact in diameters of the sphere, where there is no wall."""

AFTER_ARRIVAL = 1.6
"""Duration with a wall, in times that the sphere would need to get there."""

SNAPSHOTS = 12
"""About so many are written."""


class Draft(NamedTuple):
    """What a first case is made of; lengths [m], velocity [m/s], time [s].

    Attributes
    ----------
    diameter : float
        Of the sphere.
    thickness : float
        Of the plate.
    velocity : float
    sphere_material, plate_material : str
    plate_radius : float, optional
    wall : float, optional
        From the plate's rear face to the wall's front face.
    wall_thickness : float, optional
        By default three times the plate's.
    npr : int, optional
    end : float, optional
    wall_material : str, optional
        By default the plate's.
    """

    diameter: float
    thickness: float
    velocity: float
    sphere_material: str
    plate_material: str
    plate_radius: float | None = None
    wall: float | None = None
    wall_thickness: float | None = None
    npr: int | None = None
    end: float | None = None
    wall_material: str | None = None


def draft_case(draft: Draft) -> str:
    """Return a case file with comments.

    Parameters
    ----------
    draft : Draft
        What it leaves out has sensible values: a plate whose rim does not matter, four
        rows of particles in it where that takes an NPR of at most `FINEST`, and an end
        when the cloud, or what comes through the wall, has formed.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    CaseError
        If the plate is so thin that a resolution must be chosen.
    """
    d, t, v = draft.diameter, draft.thickness, draft.velocity
    radius = draft.plate_radius or PLATE_RADIUS * d
    npr = draft.npr or _resolution(d, t)
    rows = t / (d / 2 / npr)
    if draft.npr is None and round(rows) < FEWEST_ROWS:
        text = f"a plate of {_mm(t)} has {rows:.2g} rows of particles at npr {npr}"
        raise CaseError([Problem(f"{text}; give a resolution with --npr")])
    way = d + t + (CLOUD_LENGTH * d if draft.wall is None else draft.wall)
    duration = way / v * (1.0 if draft.wall is None else AFTER_ARRIVAL)
    end = _round(duration) if draft.end is None else draft.end
    names = [draft.sphere_material, draft.plate_material]
    sphere, plate = (Path(name).name.removesuffix(".toml") for name in names)
    title = f"{_mm(d)} {sphere} sphere at {_text(v / 1e3)} km/s on {_mm(t)} of {plate}"
    if draft.wall is not None:
        title += f", wall at {_mm(draft.wall)}"
    sphere_material, plate_material = map(_quoted, names)
    parts = [
        f"title = {_quoted(title)}\n",
        _SPHERE.format(
            diameter=_mm(d),
            radius=_mm(d / 2),
            velocity=f"{_text(v / 1e3)} km/s",
            material=sphere_material,
        ),
        _PLATE.format(thickness=_mm(t), radius=_mm(radius), material=plate_material),
    ]
    if draft.wall is not None:
        parts.append(
            _WALL.format(
                distance=_mm(draft.wall),
                position=_mm(t + draft.wall),
                thickness=_mm(draft.wall_thickness or 3.0 * t),
                radius=_mm(max(radius, WALL_RADIUS * draft.wall)),
                material=_quoted(draft.wall_material or draft.plate_material),
            )
        )
    parts.append(_RESOLUTION.format(npr=npr, rows=f"{rows:.3g}"))
    parts.append(_TIMES.format(end=_us(end), every=_us(_round(end / SNAPSHOTS))))
    return "\n".join(parts)


def draft_shield(draft: Draft) -> str:
    """Return a case file of a shield, with comments.

    Parameters
    ----------
    draft : Draft
        The plate is the bumper; a wall must be given.

    Returns
    -------
    str
        TOML. Sizes and times that are left out are left to the program.
    """
    assert draft.wall is not None, "a shield has a wall"
    d, t, v = draft.diameter, draft.thickness, draft.velocity
    wall_thickness = draft.wall_thickness or 3.0 * t
    title = (
        f"{_mm(d)} sphere at {_text(v / 1e3)} km/s on a shield: {_mm(t)}, "
        f"{_mm(draft.wall)} behind it {_mm(wall_thickness)}"
    )
    radius = draft.plate_radius
    text = _SHIELD.format(
        title=_quoted(title),
        diameter=_mm(d),
        velocity=f"{_text(v / 1e3)} km/s",
        sphere_material=_quoted(draft.sphere_material),
        thickness=_mm(t),
        standoff=_mm(draft.wall),
        plate_material=_quoted(draft.plate_material),
        radius="" if radius is None else f'radius = "{_mm(radius)}"\n',
        wall_thickness=_mm(wall_thickness),
        wall_material=_quoted(draft.wall_material or draft.plate_material),
    )
    if draft.npr is not None:
        text += f"\n[resolution]\nnpr = {draft.npr}\n"
    if draft.end is not None:
        text += f'\n[time]\nend = "{_us(draft.end)}"\n'
    return text


def _resolution(diameter: float, thickness: float) -> int:
    """Return the NPR that gives the plate its least rows, within its bounds."""
    needed = math.ceil(LEAST_ROWS * diameter / 2 / thickness - 1e-9)
    return min(max(needed, COARSEST), FINEST)


def _round(value: float) -> float:
    """Return a value of two digits that is not less."""
    digits = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / digits - 1e-9) * digits


def _quoted(text: str) -> str:
    return json.dumps(text, ensure_ascii=False)


def _text(value: float) -> str:
    return f"{value:.6g}"


def _mm(length: float) -> str:
    return f"{_text(1e3 * length)} mm"


def _us(time: float) -> str:
    return f"{_text(1e6 * time)} us"


_SHIELD = """\
title = {title}

# Numbers are SI; a string carries its unit. The program makes the bodies, and chooses
# the resolution, the radii of the plates and the end of the run; case.toml of a run
# shows them all. `mpisph limit` finds the largest sphere that the shield stops.
[shield.projectile]
diameter = "{diameter}"
velocity = "{velocity}"
material = {sphere_material}  # `mpisph materials` lists the cards

# A table for each bumper, in the order in which they are hit.
[[shield.bumpers]]
thickness = "{thickness}"
standoff = "{standoff}"  # to the front face of what stands behind it
material = {plate_material}
{radius}
[shield.wall]
thickness = "{wall_thickness}"
material = {wall_material}
"""

_SPHERE = """\
# Numbers are SI; a string carries its unit. Every other setting has a default, and the
# materials choose how they harden, melt and break: `mpisph schema`, and case.toml of a
# run, show it all.

# The sphere touches the plate's front face, z = 0, at t = 0, and moves along +z.
[[bodies]]
name = "sphere"
shape = "sphere"
radius = "{radius}"  # half of the diameter, {diameter}
position = "-{radius}"  # of the centre
velocity = "{velocity}"
material = {material}  # `mpisph materials` lists the cards
"""

_PLATE = """\
# Wide enough that its rim does not matter.
[[bodies]]
name = "plate"
shape = "plate"
thickness = "{thickness}"
radius = "{radius}"
position = 0.0  # of the front face
material = {material}
"""

_WALL = """\
# The rear wall, {distance} behind the plate.
[[bodies]]
name = "wall"
shape = "plate"
thickness = "{thickness}"
radius = "{radius}"
position = "{position}"  # of the front face
material = {material}
"""

_RESOLUTION = """\
# Particles along the sphere's radius; the plate has {rows} rows of them. Twice as many
# take eight times as long: compare two resolutions before a figure is believed.
[resolution]
npr = {npr}
"""

_TIMES = """\
[time]
end = "{end}"

# A snapshot for ParaView, and a measure of the cloud, at each of these times.
[output]
every = "{every}"
"""
