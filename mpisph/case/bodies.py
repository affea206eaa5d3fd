"""The bodies of a case, each of one of the known shapes."""

from __future__ import annotations

from collections.abc import Iterable
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from mpisph.case.shapes.cylinder import Cylinder
from mpisph.case.shapes.plate import Plate
from mpisph.case.shapes.shape import Shape, load_shapes
from mpisph.case.shapes.sphere import Sphere
from mpisph.case.shapes.spherical_shell import SphericalShell

__all__ = [
    "SHAPES",
    "Body",
    "Cylinder",
    "Plate",
    "Sphere",
    "SphericalShell",
    "particle_count",
]

SHAPES = load_shapes(
    [
        "sphere",
        "spherical_shell",
        "plate",
        "cylinder",
    ]
)
"""All that a body can be. Schema, rules, messages and reports follow from this."""

if TYPE_CHECKING:
    Body = Shape
else:
    Body = Annotated[reduce(or_, SHAPES), Field(discriminator="shape")]


def particle_count(bodies: Iterable[Body], spacing: float) -> int:
    """Estimate the number of particles of all bodies, without making them.

    Parameters
    ----------
    bodies : iterable of Body
    spacing : float
        Particle spacing [m].

    Returns
    -------
    int
        Exact for plates and cylinders; for other shapes the section over the area of a
        cell, which is nearly exact.
    """
    return sum(body.section.count(spacing, body.filling) for body in bodies)
