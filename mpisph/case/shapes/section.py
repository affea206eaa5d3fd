"""Sections of solids of revolution in the r-z plane."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

__all__ = ["Filling", "FloatArray", "Lattice", "Rings", "Section", "Wall"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


class Wall(NamedTuple):
    """A thickness of a section in which particles must have room.

    Attributes
    ----------
    axis : str
        Axis along which it is measured.
    thickness : float
        [m].
    least : float
        Thickness needed, in particle spacings.
    """

    axis: str
    thickness: float
    least: float


class Rings(NamedTuple):
    """Particles of a section, and the part of it that each stands for.

    Attributes
    ----------
    r, z : ndarray, shape (n,)
        Where they are [m].
    mean : ndarray, shape (n,)
        Mean radius of the part [m].
    area : ndarray, shape (n,)
        Area of the part [m^2].
    spacing : ndarray, shape (n,)
        Distance of neighbours [m].
    """

    r: FloatArray
    z: FloatArray
    mean: FloatArray
    area: FloatArray
    spacing: FloatArray


class Filling(Protocol):
    """How a section is divided among particles, which stand in rows."""

    @property
    def length(self) -> IntArray:
        """Number of particles in each row, shape (rows,)."""

    def rings(self, row: IntArray, place: IntArray) -> Rings:
        """Return the particles at places, counted from 0, in rows."""


class Lattice(NamedTuple):
    """Particles of a section in rows along r, which share their columns.

    Attributes
    ----------
    z : ndarray, shape (rows,)
        Heights of the rows, ascending [m].
    first, length : ndarray of int64, shape (rows,)
        Each row's first column, and its number of particles.
    inner, width : float
        Where the columns begin, and their width [m].
    area : ndarray, shape (rows,)
        Section of one particle of each row [m^2].
    spacing : float
        [m].
    """

    z: FloatArray
    first: IntArray
    length: IntArray
    inner: float
    width: float
    area: FloatArray
    spacing: float

    def rings(self, row: IntArray, place: IntArray) -> Rings:
        """Return the particles at places in rows (S1)."""
        column = (self.first[row] + place).astype(np.float64)
        middle = self.inner + (column + 0.5) * self.width
        return Rings(
            r=middle + self.width**2 / (24.0 * middle),
            z=self.z[row],
            mean=middle,
            area=self.area[row],
            spacing=np.full(row.size, self.spacing),
        )


class Section(ABC):
    """A section that at each height is one interval of r.

    Its ends change continuously with the height. What is not abstract follows from
    them.
    """

    @property
    @abstractmethod
    def ends(self) -> tuple[float, float]:
        """Lowest and highest z [m]."""

    @property
    @abstractmethod
    def widest(self) -> float:
        """Largest r [m]."""

    @property
    @abstractmethod
    def area(self) -> float:
        """Area [m^2]."""

    @property
    @abstractmethod
    def walls(self) -> tuple[Wall, ...]:
        """Thicknesses in which particles must have room."""

    @abstractmethod
    def radii(self, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the inner and the outer r at heights between the ends [m]."""

    @property
    def knots(self) -> tuple[float, ...]:
        """Heights between the ends where the radii have extremes or kinks [m]."""
        return ()

    @property
    def origin(self) -> float:
        """Height that lies between two rows of the lattice [m]."""
        return self.ends[0]

    def holds(self, r: float, z: float) -> bool:
        """Say whether a place [m] lies within the section or on its edge."""
        low, high = self.ends
        inner, outer = self.radii(np.array([z]))
        return bool(low <= z <= high and inner[0] <= r <= outer[0])

    @property
    def middle(self) -> float:
        """Axial position halfway between the ends [m]."""
        return 0.5 * (self.ends[0] + self.ends[1])

    def outward(self, r: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the r and z of the unit vectors away from the axis at places [m]."""
        return np.ones_like(r), np.zeros_like(z)

    @property
    def extent(self) -> float:
        """Largest of the coordinates r and abs(z) [m]."""
        return max(abs(self.ends[0]), abs(self.ends[1]), self.widest)

    def count(self, spacing: float) -> int:
        """Estimate the number of particles at a spacing [m], without making them."""
        return round(self.area / spacing**2)

    def lattice(self, spacing: float) -> Lattice:
        """Return the points within of a square lattice.

        Parameters
        ----------
        spacing : float
            [m].

        Returns
        -------
        Lattice
            The axis lies between two of its columns.
        """
        low, high = self.ends
        lowest = math.floor((low - self.origin) / spacing)
        highest = math.ceil((high - self.origin) / spacing)
        rows = np.arange(lowest, highest, dtype=np.float64)
        z = self.origin + (rows + 0.5) * spacing
        inner, outer = self.radii(z)
        first = np.ceil(inner / spacing - 0.5)
        length = np.floor(outer / spacing - 0.5) - first + 1.0
        length[(z < low) | (z > high) | (length < 0.0)] = 0.0
        return Lattice(
            z=z,
            first=first.astype(np.int64),
            length=length.astype(np.int64),
            inner=0.0,
            width=spacing,
            area=np.full(z.size, spacing**2),
            spacing=spacing,
        )
