"""Cylinders and tubes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from mpisph.case.shapes.rectangle import Rectangle
from mpisph.case.shapes.shape import Shape, inner_mistakes, millimetres
from mpisph.inputs.quantities import NonNegativeLength, PositiveLength


class Cylinder(Shape):
    """A cylinder or tube along the axis, starting at its lowest z."""

    shape: Literal["cylinder"]
    """Shape of the body."""
    filling: Literal["square", "hexagonal"] = "square"
    """How the particles are arranged."""
    radius: PositiveLength
    """Outer radius."""
    length: PositiveLength
    """Length along z."""
    inner_radius: NonNegativeLength = 0.0
    """Radius of the bore; 0 for a solid cylinder."""

    @property
    def section(self) -> Rectangle:
        """Section in the r-z plane."""
        high = self.position + self.length
        return Rectangle(self.inner_radius, self.radius, self.position, high)

    def describe(self) -> str:
        """Return the sizes, as they would be ordered from a workshop."""
        diameter = millimetres(2 * self.radius)
        size = f"diameter {diameter}, {millimetres(self.length)} long"
        bore = millimetres(2 * self.inner_radius)
        return f"{size}, bore {bore}" if self.inner_radius else size

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Return what is wrong with the radius of the bore."""
        return inner_mistakes(self.inner_radius, radius=self.radius)
