"""Hollow spheres."""

from __future__ import annotations

from collections.abc import Iterator
from typing import ClassVar, Literal

from mpisph.case.shapes.annulus import Annulus
from mpisph.case.shapes.shape import Shape, inner_mistakes, millimetres
from mpisph.inputs.quantities import PositiveLength


class SphericalShell(Shape):
    """A hollow sphere centred on the axis."""

    sets_spacing: ClassVar[bool] = True

    shape: Literal["spherical_shell"]
    """Shape of the body."""
    filling: Literal["square", "hexagonal", "polar"] = "square"
    """How the particles are arranged; `polar` is in layers around the centre."""
    outer_radius: PositiveLength
    """Outer radius."""
    inner_radius: PositiveLength
    """Inner radius, less than the outer one."""

    @property
    def section(self) -> Annulus:
        """Section in the r-z plane."""
        return Annulus(self.inner_radius, self.outer_radius, self.position)

    def describe(self) -> str:
        """Return the sizes, as they would be ordered from a workshop."""
        inner = millimetres(2 * self.inner_radius)
        return f"diameter {millimetres(2 * self.outer_radius)}, inside {inner}"

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Return what is wrong with the inner radius."""
        return inner_mistakes(self.inner_radius, outer_radius=self.outer_radius)
