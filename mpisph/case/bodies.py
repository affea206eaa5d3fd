"""The bodies of a case: solids of revolution, described by their r-z section."""

from __future__ import annotations

import math
from typing import Annotated, Literal, NamedTuple

from pydantic import Field

from mpisph.inputs.quantities import (
    FrozenModel,
    Identifier,
    NonNegativeLength,
    Position,
    PositiveLength,
    Velocity,
)
from mpisph.materials.model import EquationOfState

__all__ = [
    "Annulus",
    "Body",
    "Cylinder",
    "Plate",
    "Rectangle",
    "Region",
    "Sphere",
    "SphericalShell",
    "extent",
    "regions_overlap",
]

# Faces that coincide up to rounding touch; they do not overlap. The first is a fraction
# of the smaller body, the second of the coordinates that were rounded.
_TOUCHING = 1e-9
_ROUNDING = 1e-15


class Annulus(NamedTuple):
    """Half of a ring around a point of the axis: the section of a sphere or shell."""

    inner: float
    outer: float
    centre: float


class Rectangle(NamedTuple):
    """A rectangle ``inner <= r <= outer``, ``low <= z <= high``."""

    inner: float
    outer: float
    low: float
    high: float


Region = Annulus | Rectangle


class _BodyBase(FrozenModel):
    """What all shapes have in common."""

    name: Identifier
    """Name of the body, unique in the case."""
    material: Identifier
    """Material card, or a name of the case's own materials."""
    velocity: Velocity = 0.0
    """Initial velocity along +z."""
    position: Position = 0.0
    """Axial position: the centre of a sphere or shell, else the lowest z."""
    eos: EquationOfState | None = None
    """Equation of state of this body; the scheme's, if left out."""


class Sphere(_BodyBase):
    """A solid sphere centred on the axis."""

    shape: Literal["sphere"]
    """Shape of the body."""
    radius: PositiveLength
    """Radius, half of the diameter."""

    @property
    def reference_radius(self) -> float:
        """Radius that `npr` counts particles along [m]."""
        return self.radius

    @property
    def region(self) -> Annulus:
        """Section in the r-z plane."""
        return Annulus(0.0, self.radius, self.position)


class SphericalShell(_BodyBase):
    """A hollow sphere centred on the axis."""

    shape: Literal["spherical_shell"]
    """Shape of the body."""
    outer_radius: PositiveLength
    """Outer radius."""
    inner_radius: PositiveLength
    """Inner radius, less than the outer one."""

    @property
    def reference_radius(self) -> float:
        """Radius that `npr` counts particles along [m]."""
        return self.outer_radius

    @property
    def region(self) -> Annulus:
        """Section in the r-z plane."""
        return Annulus(self.inner_radius, self.outer_radius, self.position)


class Plate(_BodyBase):
    """A flat round plate across the axis; its front face is at the lowest z."""

    shape: Literal["plate"]
    """Shape of the body."""
    thickness: PositiveLength
    """Thickness along z."""
    radius: PositiveLength
    """Outer radius."""
    inner_radius: NonNegativeLength = 0.0
    """Radius of a central hole; 0 for none."""

    @property
    def reference_radius(self) -> float:
        """Radius that `npr` counts particles along [m]."""
        return self.radius

    @property
    def region(self) -> Rectangle:
        """Section in the r-z plane."""
        return Rectangle(self.inner_radius, self.radius, self.position, self.rear_face)

    @property
    def rear_face(self) -> float:
        """Axial position of the face with the highest z [m]."""
        return self.position + self.thickness


class Cylinder(_BodyBase):
    """A cylinder or tube along the axis, starting at its lowest z."""

    shape: Literal["cylinder"]
    """Shape of the body."""
    radius: PositiveLength
    """Outer radius."""
    length: PositiveLength
    """Length along z."""
    inner_radius: NonNegativeLength = 0.0
    """Radius of the bore; 0 for a solid cylinder."""

    @property
    def reference_radius(self) -> float:
        """Radius that `npr` counts particles along [m]."""
        return self.radius

    @property
    def region(self) -> Rectangle:
        """Section in the r-z plane."""
        high = self.position + self.length
        return Rectangle(self.inner_radius, self.radius, self.position, high)


Body = Annotated[
    Sphere | SphericalShell | Plate | Cylinder, Field(discriminator="shape")
]


def regions_overlap(one: Region, other: Region) -> bool:
    """Say whether two sections share an area; touching does not count.

    Parameters
    ----------
    one, other : Annulus or Rectangle
        Sections in the r-z plane [m].

    Returns
    -------
    bool
        True where the bodies would occupy the same space.
    """
    size = min(one.outer, other.outer)
    tolerance = _TOUCHING * size + _ROUNDING * max(extent(one), extent(other))
    if isinstance(one, Rectangle):
        if isinstance(other, Rectangle):
            return _rectangles_overlap(one, other, tolerance)
        return _annulus_meets_rectangle(other, one, tolerance)
    if isinstance(other, Rectangle):
        return _annulus_meets_rectangle(one, other, tolerance)
    return _annuli_overlap(one, other, tolerance)


def extent(region: Region) -> float:
    """Return the largest of the coordinates r and |z| of a section [m]."""
    if isinstance(region, Annulus):
        return abs(region.centre) + region.outer
    return max(abs(region.low), abs(region.high), region.outer)


def _rectangles_overlap(a: Rectangle, b: Rectangle, tolerance: float) -> bool:
    in_r = min(a.outer, b.outer) - max(a.inner, b.inner)
    in_z = min(a.high, b.high) - max(a.low, b.low)
    return in_r > tolerance and in_z > tolerance


def _annulus_meets_rectangle(a: Annulus, b: Rectangle, tolerance: float) -> bool:
    # Over the connected rectangle the distance from the annulus's centre takes
    # every value between its least and its greatest.
    below, above = b.low - a.centre, b.high - a.centre
    least_z = max(below, -above, 0.0)
    greatest_z = max(-below, above)
    least = math.hypot(b.inner, least_z)
    greatest = math.hypot(b.outer, greatest_z)
    return min(a.outer, greatest) - max(a.inner, least) > tolerance


def _annuli_overlap(a: Annulus, b: Annulus, tolerance: float) -> bool:
    # Points at distance s from the centre of a lie between |d - s| and d + s from
    # the centre of b; ask for an s inside a whose range meets the inside of b.
    d = abs(a.centre - b.centre)
    least = max(a.inner, b.inner - d, d - b.outer)
    greatest = min(a.outer, d + b.outer)
    return greatest - least > tolerance
