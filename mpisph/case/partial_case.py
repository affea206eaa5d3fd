"""What the rules between the parts of a case read, and what they find."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mpisph.case.bodies import Body
from mpisph.case.sections import (
    Boundary,
    Measured,
    Output,
    Resolution,
    Scheme,
    TimeStepping,
)
from mpisph.inputs.findings import Key
from mpisph.materials import Material


class Parts(NamedTuple):
    """The parts of a case, with None for each one that is itself invalid.

    Rules skip what they cannot judge, so that one mistake is reported once
    while everything else in the file is still checked.
    """

    names: Sequence[str | None]
    material_names: Sequence[str | None]
    bodies: Sequence[Body | None]
    resolution: Resolution | None
    scheme: Scheme | None
    output: Output | None
    measured: Measured | None
    time: TimeStepping | None
    materials: Mapping[str, Material | None]
    measured_invalid: bool = False
    gauge_names: Sequence[str | None] = ()
    boundary: Boundary | None = None


def default_reference(bodies: Sequence[Body | None]) -> str | None:
    """Return the name of the first body whose shape may set the spacing, or None."""
    known = (body for body in bodies if body is not None)
    return next((body.name for body in known if body.sets_spacing), None)


def find_spacing(resolution: Resolution, bodies: Sequence[Body | None]) -> float | None:
    """Return the particle spacing [m], or None where it is undetermined."""
    if resolution.spacing is not None or resolution.npr is None:
        return resolution.spacing
    reference = resolution.reference or default_reference(bodies)
    for body in bodies:
        if body is not None and body.name == reference:
            return body.reference_radius / resolution.npr
    return None


def spacing_key(resolution: Resolution) -> Key:
    """Return the key that sets the particle spacing."""
    return ("resolution", "npr" if resolution.spacing is None else "spacing")
