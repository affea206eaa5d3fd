"""The section of plates and cylinders."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mpisph.case.shapes.section import (
    SQUARE,
    FloatArray,
    Lattice,
    Section,
    Wall,
    hexagonal_cell,
)

_FLATTEST = 0.1
"""Least height over the spacing, where one layer of particles stands for it."""


@dataclass(frozen=True)
class Rectangle(Section):
    """A rectangle ``inner <= r <= outer``, ``low <= z <= high`` [m].

    It is divided into whole cells, so that the mass is exact.
    """

    inner: float
    outer: float
    low: float
    high: float

    @property
    def ends(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""
        return self.low, self.high

    @property
    def widest(self) -> float:
        """Largest r [m]."""
        return self.outer

    @property
    def area(self) -> float:
        """Area [m^2]."""
        return (self.outer - self.inner) * (self.high - self.low)

    @property
    def volume(self) -> float:
        """Volume [m^3]."""
        return math.pi * (self.outer + self.inner) * self.area

    @property
    def walls(self) -> tuple[Wall, ...]:
        """Width and height; along each there is one cell at least."""
        return (
            Wall("r", self.outer - self.inner, 0.5),
            Wall("z", self.high - self.low, _FLATTEST),
        )

    def radii(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the inner and the outer r at heights [m]."""
        return np.full(z.shape, self.inner), np.full(z.shape, self.outer)

    def count(self, spacing: float, filling: str = SQUARE) -> int:
        """Return the number of particles at a spacing [m]."""
        if filling == SQUARE:
            rows, columns = self._cells(spacing, spacing)
            return rows * columns
        rows, columns = self._cells(*hexagonal_cell(spacing))
        return rows * columns + columns // 2

    def lattice(self, spacing: float) -> Lattice:
        """Return the centres of cells of about the size `spacing` [m]."""
        rows, columns = self._cells(spacing, spacing)
        height = (self.high - self.low) / rows
        width = (self.outer - self.inner) / columns
        return Lattice(
            z=self.low + (np.arange(rows, dtype=np.float64) + 0.5) * height,
            first=np.zeros(rows, np.int64),
            length=np.full(rows, columns, np.int64),
            inner=self.inner,
            width=width,
            area=np.full(rows, width * height),
            spacing=spacing,
        )

    def hexagonal(self, spacing: float) -> Lattice:
        """Return the centres of cells of which every other column is shifted.

        It is shifted by half a cell, so it begins and ends with half of one.
        """
        rows, columns = self._cells(*hexagonal_cell(spacing))
        height = (self.high - self.low) / rows
        width = (self.outer - self.inner) / columns
        half = np.arange(2 * rows + 1)  # heights, in half cells
        odd = (half + 1) % 2
        above = half.astype(np.float64)
        above[0], above[-1] = 0.5, 2.0 * rows - 0.5
        area = np.full(half.size, width * height)
        area[[0, -1]] *= 0.5
        return Lattice(
            z=self.low + above * (0.5 * height),
            first=odd,
            length=(columns + 1 - odd) // 2,
            inner=self.inner,
            width=width,
            area=area,
            spacing=spacing,
            stride=2,
        )

    def _cells(self, wide: float, high: float) -> tuple[int, int]:
        """Return the numbers of cells of about that size, along z and along r."""
        width, height = self.outer - self.inner, self.high - self.low
        return max(1, round(height / high)), max(1, round(width / wide))
