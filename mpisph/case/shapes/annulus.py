"""The section of spheres and spherical shells."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from mpisph.case.shapes.section import (
    POLAR,
    SQUARE,
    Filling,
    FloatArray,
    IntArray,
    Rings,
    Section,
    Wall,
)


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
    def volume(self) -> float:
        """Volume [m^3]."""
        R, a = self.outer, self.inner
        return 4.0 / 3.0 * math.pi * (R - a) * (R * R + R * a + a * a)

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

    def fill(self, spacing: float, filling: str = SQUARE) -> Filling:
        """Divide the section among particles."""
        if filling == POLAR:
            return self.polar(spacing)
        return super().fill(spacing, filling)

    def count(self, spacing: float, filling: str = SQUARE) -> int:
        """Estimate the number of particles at a spacing [m], without making them."""
        if filling != POLAR:
            return super().count(spacing)
        layers, depth = self._layers(spacing)
        # Of a wall without thickness, which is refused, the depth is zero.
        around = math.pi * 0.5 * (self.inner + self.outer) / (depth or spacing)
        return round(layers * around)

    def _layers(self, spacing: float) -> tuple[int, float]:
        """Return the number of layers and their depth [m]."""
        wall = self.outer - self.inner
        count = max(1, round(wall / spacing))
        return count, wall / count

    def polar(self, spacing: float) -> Layers:
        """Return layers around the centre, each divided into equal angles."""
        count, depth = self._layers(spacing)
        middle = self.inner + (np.arange(count, dtype=np.float64) + 0.5) * depth
        length = np.maximum(1, np.rint(math.pi * middle / depth)).astype(np.int64)
        return Layers(self.centre, middle, depth, length)

    @property
    def origin(self) -> float:
        """Height of the centre: the lattice is the same above and below it [m]."""
        return self.centre


class Layers(NamedTuple):
    """Particles of an annulus in layers around its centre.

    Attributes
    ----------
    centre : float
        Axial position of the centre [m].
    middle : ndarray, shape (layers,)
        Distance of the middle of each layer from it [m].
    depth : float
        Of each layer [m].
    length : ndarray of int64, shape (layers,)
        Particles of each layer, from its lowest z on.
    """

    centre: float
    middle: FloatArray
    depth: float
    length: IntArray

    def rings(self, row: IntArray, place: IntArray) -> Rings:
        """Return the particles at places in layers.

        A volume element is proportional to ``s^2 cos(b)``, at a distance s from the
        centre and an angle b above the equator. As in `Lattice.rings`, the middle of
        each part is shifted by the square of its width over 24, times the logarithmic
        derivative of that.
        """
        s, count = self.middle[row], self.length[row]
        angle = math.pi / count
        b = (place + 0.5 - 0.5 * count) * angle
        area = s * self.depth * angle
        second = s**2 + self.depth**2 / 12.0  # mean of the square of the distance
        mean = second / s * (2.0 * np.sin(0.5 * angle) / angle) * np.cos(b)
        b = b - angle**2 / 24.0 * np.tan(b)
        s = s + self.depth**2 / (12.0 * s)
        return Rings(
            r=s * np.cos(b),
            z=self.centre + s * np.sin(b),
            mean=mean,
            area=area,
            spacing=np.sqrt(area),
        )


def _half_chord(radius: float, distance: FloatArray) -> FloatArray:
    """Return the half width of a circle at a distance; zero beyond it."""
    # A product: the difference of squares would lose the digits near the pole.
    squared = np.maximum(radius - distance, 0.0) * (radius + distance)
    return np.asarray(np.sqrt(squared))
