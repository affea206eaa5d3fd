"""The section of plates and cylinders."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mpisph.case.shapes.section import FloatArray, Lattice, Section, Wall

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
    def walls(self) -> tuple[Wall, ...]:
        """Width and height; along each there is one cell at least."""
        return (
            Wall("r", self.outer - self.inner, 0.5),
            Wall("z", self.high - self.low, _FLATTEST),
        )

    def radii(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the inner and the outer r at heights [m]."""
        return np.full(z.shape, self.inner), np.full(z.shape, self.outer)

    def count(self, spacing: float) -> int:
        """Return the number of particles at a spacing [m]."""
        rows, columns = self._cells(spacing)
        return rows * columns

    def lattice(self, spacing: float) -> Lattice:
        """Return the centres of cells of about the size `spacing` [m]."""
        rows, columns = self._cells(spacing)
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

    def _cells(self, spacing: float) -> tuple[int, int]:
        """Return the numbers of cells along z and along r."""
        width, height = self.outer - self.inner, self.high - self.low
        return max(1, round(height / spacing)), max(1, round(width / spacing))
