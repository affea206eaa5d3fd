"""Solid spheres."""

from __future__ import annotations

from typing import ClassVar, Literal

from mpisph.case.shapes.annulus import Annulus
from mpisph.case.shapes.shape import Shape, millimetres
from mpisph.inputs.quantities import PositiveLength


class Sphere(Shape):
    """A solid sphere centred on the axis."""

    sets_spacing: ClassVar[bool] = True

    shape: Literal["sphere"]
    """Shape of the body."""
    filling: Literal["square", "hexagonal", "polar"] = "square"
    """How the particles are arranged; `polar` is in layers around the centre."""
    radius: PositiveLength
    """Radius, half of the diameter."""

    @property
    def section(self) -> Annulus:
        """Section in the r-z plane."""
        return Annulus(0.0, self.radius, self.position)

    def describe(self) -> str:
        """Return the sizes, as they would be ordered from a workshop."""
        return f"diameter {millimetres(2 * self.radius)}"
