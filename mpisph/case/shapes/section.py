"""Sections of solids of revolution in the r-z plane."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

__all__ = [
    "Filling",
    "FloatArray",
    "Lattice",
    "Rings",
    "Section",
    "Wall",
    "rounding_of",
]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


def rounding_of(*heights: float) -> float:
    """Return the distance of two faces that is none, by their axial positions [m]."""
    return 1e-9 * max(map(abs, heights))


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
    stride : int, optional
        Columns from one particle of a row to the next.
    """

    z: FloatArray
    first: IntArray
    length: IntArray
    inner: float
    width: float
    area: FloatArray
    spacing: float
    stride: int = 1

    def rings(self, row: IntArray, place: IntArray) -> Rings:
        """Return the particles at places in rows.

        Sums over rings of a mass are then integrals over the body (R1).
        """
        column = (self.first[row] + self.stride * place).astype(np.float64)
        middle = self.inner + (column + 0.5) * self.width
        return Rings(
            r=middle + ring_shift(middle, self.width),
            z=self.z[row],
            mean=middle,
            area=self.area[row],
            spacing=np.full(row.size, self.spacing),
        )


INNERMOST = 0.00767
"""Share of the fourth power of width over radius in the shift of a ring (R1)."""


def ring_shift(middle: FloatArray, width: float | FloatArray) -> FloatArray:
    """Return how far beyond the middles of their sections rings start (R1) [m].

    The midpoint rule leaves ``width^2/24`` of a function's value on the axis, which
    the shift takes away. The second term is felt by the innermost ring alone: it leaves
    that ring without acceleration at constant pressure.
    """
    ratio = width / middle
    shift: FloatArray = width * ratio / 24.0 * (1.0 + INNERMOST * ratio**4)
    return shift


SQUARE, HEXAGONAL, POLAR = "square", "hexagonal", "polar"


def hexagonal_cell(spacing: float) -> tuple[float, float]:
    """Return width and height of what a point of a hexagonal lattice stands for [m].

    Neighbours are a height apart, and the area is that of a square of the spacing.
    """
    height = spacing * math.sqrt(2.0 / math.sqrt(3.0))
    return spacing**2 / height, height


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
    def volume(self) -> float:
        """Volume of the body [m^3]."""

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

    def count(self, spacing: float, filling: str = SQUARE) -> int:
        """Estimate the number of particles at a spacing [m], without making them."""
        return round(self.area / spacing**2)

    def fill(self, spacing: float, filling: str = SQUARE) -> Filling:
        """Divide the section among particles.

        Parameters
        ----------
        spacing : float
            [m].
        filling : str, optional
            One of the fillings that the section knows.
        """
        known = {SQUARE: self.lattice, HEXAGONAL: self.hexagonal}
        return known[filling](spacing)

    def hexagonal(self, spacing: float) -> Lattice:
        """Return the points within of a hexagonal lattice, symmetric about the middle.

        Every point has the same area, such that the volume is exact. The axis lies
        between two columns, of which every other one is shifted along z.
        """
        low, high = self.ends
        width, height = hexagonal_cell(spacing)
        reach = math.ceil((high - low) / height)
        rows = np.arange(-reach, reach + 1)
        z = self.middle + rows.astype(np.float64) * (0.5 * height)
        rows, z = rows[(low < z) & (z < high)], z[(low < z) & (z < high)]
        inner, outer = self.radii(z)
        first = np.ceil(inner / width - 0.5).astype(np.int64)
        first += (first - rows) % 2
        last = np.floor(outer / width - 0.5).astype(np.int64)
        length = np.maximum((last - first) // 2 + 1, 0)
        # The columns of a row, at half their width, sum up to this many widths.
        volume = 2.0 * math.pi * width * (length * (first + length - 0.5)).sum()
        area = self.volume / volume if volume > 0.0 else spacing**2
        return Lattice(
            z, first, length, 0.0, width, np.full(z.size, area), spacing, stride=2
        )

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
