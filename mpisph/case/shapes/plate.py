"""Plates."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

from mpisph.case.shapes.rectangle import Rectangle
from mpisph.case.shapes.shape import Shape, inner_mistakes, millimetres
from mpisph.inputs.quantities import NonNegativeLength, PositiveLength


class Plate(Shape):
    """A flat round plate across the axis; its front face is at the lowest z."""

    shape: Literal["plate"]
    """Shape of the body."""
    filling: Literal["square", "hexagonal"] = "square"
    """How the particles are arranged."""
    thickness: PositiveLength
    """Thickness along z."""
    radius: PositiveLength
    """Outer radius."""
    inner_radius: NonNegativeLength = 0.0
    """Radius of a central hole; 0 for none."""

    @property
    def section(self) -> Rectangle:
        """Section in the r-z plane."""
        return Rectangle(self.inner_radius, self.radius, self.position, self.rear_face)

    @property
    def rear_face(self) -> float:
        """Axial position of the face with the highest z [m]."""
        return self.position + self.thickness

    def describe(self) -> str:
        """Return the sizes, as they would be ordered from a workshop."""
        diameter = millimetres(2 * self.radius)
        size = f"{millimetres(self.thickness)} thick, diameter {diameter}"
        hole = millimetres(2 * self.inner_radius)
        return f"{size}, hole {hole}" if self.inner_radius else size

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Return what is wrong with the radius of the hole."""
        return inner_mistakes(self.inner_radius, radius=self.radius)
