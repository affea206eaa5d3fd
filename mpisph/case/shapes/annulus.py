"""The section of spheres and spherical shells."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mpisph.case.shapes.section import FloatArray, Section, Wall


@dataclass(frozen=True)
class Annulus(Section):
    """Half of a ring around a point of the axis [m]."""

    inner: float
    outer: float
    centre: float

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""
        return self.centre - self.outer, self.centre + self.outer

    @property
    def widest(self) -> float:
        """Largest r [m]."""
        return self.outer

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return 0.5 * math.pi * (self.outer**2 - self.inner**2)

    @property
    def walls(self) -> tuple[Wall, ...]:
        """The wall: the row of particles next to the centre must have one in it."""
        return (Wall("r", self.outer - self.inner, 1.0),)

    @property
    def middle(self) -> float:
        """Axial position of the centre [m]."""
        return self.centre

    def outward(self, r: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the r and z of the unit vectors away from the centre at places [m]."""
        distance = np.hypot(r, z - self.centre)
        return r / distance, (z - self.centre) / distance

    def radii(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the inner and the outer r at heights [m]."""
        distance = np.abs(z - self.centre)
        return _half_chord(self.inner, distance), _half_chord(self.outer, distance)

    @property
    def knots(self) -> tuple[float, ...]:
        """The centre, and the poles of the hollow [m]."""
        return (self.centre - self.inner, self.centre, self.centre + self.inner)

    @property
    def origin(self) -> float:
        """Height of the centre: the lattice is the same above and below it [m]."""
        return self.centre


def _half_chord(radius: float, distance: FloatArray) -> FloatArray:
    """Return the half width of a circle at a distance; zero beyond it."""
    # A product: the difference of squares would lose the digits near the pole.
    squared = np.maximum(radius - distance, 0.0) * (radius + distance)
    return np.asarray(np.sqrt(squared))
