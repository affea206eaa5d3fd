"""The quantities that are summed up, or whose maximum is taken, in every step.

A quantity is one entry of `SERIES`: the global reduction, the columns of the history
and their figures follow.
"""

import math
from collections.abc import Callable
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.core.particles import FloatArray, Particles
from mpisph.diagnostics.cloud import (
    CloudDefinition,
    in_cloud,
    length_of,
    shows_arrival,
)
from mpisph.parallel.reproducible_sum import CHUNKS, fixed_point_chunks, from_chunks

ROOM = 1e6
"""Factor by which a particle's terms may pass the magnitudes of the start. It may be
large: see `reproducible_sum.fixed_point_chunks`."""


class Quantity(NamedTuple):
    """What a column of a table holds.

    Attributes
    ----------
    name : str
    unit : str
        SI unit; empty for a pure number.
    label : str
        What it is, for people.
    """

    name: str
    unit: str
    label: str


def column_name(quantity: Quantity, of: str = "") -> str:
    """Return the name of a column: quantity, what it is of if anything, and unit."""
    unit = quantity.unit.replace("/", " per ").split()
    return "_".join((quantity.name, *[of] * bool(of), *unit))


class Scales(NamedTuple):
    """Magnitudes of a run, taken at its start.

    Attributes
    ----------
    mass : float
        Largest of a particle [kg].
    speed : float
        Largest, or a hundredth of the bulk sound speed where nothing moves [m/s].
    """

    mass: float
    speed: float

    @property
    def energy(self) -> float:
        """Specific kinetic energy of that speed [J/kg]."""
        return 0.5 * self.speed**2


class Sample:
    """The particles of one rank, as the terms of series see them.

    Parameters
    ----------
    particles : Particles
        Owned particles.
    cloud : CloudDefinition
    """

    def __init__(self, particles: Particles, cloud: CloudDefinition) -> None:
        self.p = particles
        self.cloud = cloud

    @cached_property
    def in_cloud(self) -> npt.NDArray[np.bool_]:
        """Which particles are in the cloud, shape (n,); none that has left the game."""
        p = self.p
        at_work: npt.NDArray[np.bool_] = p.retired == 0.0
        return at_work & in_cloud(p.body, p.z, p.u_z, self.cloud)


class Series(NamedTuple):
    """A quantity of a whole run, taken in every step.

    Attributes
    ----------
    name : str
        Its column of the history.
    unit : str
        SI unit; empty for a pure number.
    label : str
        What it is, for people.
    reduce : {"sum", "max", "min"}
        How the particles' terms make one number. A maximum is at least zero, a minimum
        at most.
    terms : callable
        Takes a `Sample`, returns what each particle contributes, shape (n,).
    bound : callable, optional
        For a sum: takes `Scales`, returns what no particle's term exceeds.
    caption : str, optional
        What its figure shows; without one it has none of its own.
    until_arrival : bool, optional
        Whether it ends, with NaN, when the cloud comes to the next body.
    """

    name: str
    unit: str
    label: str
    reduce: Literal["sum", "max", "min"]
    terms: Callable[[Sample], FloatArray]
    bound: Callable[[Scales], float] = lambda scales: scales.mass
    caption: str = ""
    until_arrival: bool = False


def _momentum_bound(scales: Scales) -> float:
    return scales.mass * (ROOM * scales.speed)


def _energy_bound(scales: Scales) -> float:
    return scales.mass * (ROOM * scales.energy)


def _kinetic_energy(s: Sample) -> FloatArray:
    energy: FloatArray = 0.5 * s.p.m * (s.p.u_r * s.p.u_r + s.p.u_z * s.p.u_z)
    return energy


def _cloud_radius(s: Sample) -> FloatArray:
    return np.where(s.in_cloud, s.p.r, 0.0)


def _cloud_length(s: Sample) -> FloatArray:
    return np.where(s.in_cloud, length_of(s.p.z, s.cloud), 0.0)


def _cloud_arrived(s: Sample) -> FloatArray:
    shown = shows_arrival(s.p.body, s.p.z, s.p.u_r, s.p.u_z, s.cloud)
    return shown.astype(np.float64)


SERIES = (
    Series("mass", "kg", "mass", "sum", lambda s: s.p.m),
    Series(
        "momentum_z", "kg m/s", "axial momentum", "sum",
        lambda s: s.p.m * s.p.u_z, _momentum_bound,
    ),
    Series(
        "kinetic_energy", "J", "kinetic energy", "sum",
        _kinetic_energy, _energy_bound,
    ),
    Series(
        "internal_energy", "J", "internal energy", "sum",
        lambda s: s.p.m * s.p.E, _energy_bound,
    ),
    Series(
        "energy_min", "J/kg", "lowest specific internal energy", "min",
        lambda s: s.p.E,
        caption="Below zero, matter would be colder than at the start of the run: the "
        "artificial viscosity is too low.",
    ),
    Series(
        "cloud_radius", "m", "radius of the cloud, R_b", "max", _cloud_radius,
        until_arrival=True,
    ),
    Series(
        "cloud_length", "m", "length of the cloud, L_b", "max", _cloud_length,
        until_arrival=True,
    ),
    Series(
        "cloud_mass", "kg", "mass of the cloud", "sum", lambda s: s.p.m * s.in_cloud,
        caption="What lies behind the plate's original rear face and moves away from "
        "it faster than the given fraction of the impact velocity.",
        until_arrival=True,
    ),
    Series(
        "cloud_arrived", "", "1 once the cloud has come to the next body", "max",
        _cloud_arrived,
    ),
)  # fmt: skip

SUMS = tuple(series for series in SERIES if series.reduce == "sum")
EXTREMES = tuple(series for series in SERIES if series.reduce != "sum")
_SIGNS = np.array([-1.0 if series.reduce == "min" else 1.0 for series in EXTREMES])
# A minimum is sent as the maximum of the opposite.


class Parts(NamedTuple):
    """What one rank contributes to all series.

    Attributes
    ----------
    sums : ndarray of int64, shape (sums, CHUNKS)
    maxima : ndarray, shape (extremes,)
        Minima with the opposite sign.
    """

    sums: npt.NDArray[np.int64]
    maxima: FloatArray


PARTS_TYPE = [
    ("sums", np.int64, (len(SUMS), CHUNKS)),
    ("maxima", np.float64, (len(EXTREMES),)),
]
"""Fields of a structured type that hold `Parts`."""


def bounds_of(scales: Scales) -> FloatArray:
    """Return the bounds of the terms of all sums, shape (sums,)."""
    return np.array([series.bound(scales) for series in SUMS])


def local_parts(p: Particles, cloud: CloudDefinition, bounds: FloatArray) -> Parts:
    """Return what this rank contributes to all series.

    Parameters
    ----------
    p : Particles
        Owned particles; may be none.
    cloud : CloudDefinition
    bounds : ndarray, shape (sums,)
        Of `bounds_of`.
    """
    sample = Sample(p, cloud)
    rows = np.empty((len(SUMS), p.n))
    for row, series in zip(rows, SUMS, strict=True):
        row[:] = series.terms(sample)
    maxima = [
        (sign * series.terms(sample)).max(initial=0.0)
        for sign, series in zip(_SIGNS, EXTREMES, strict=True)
    ]
    return Parts(fixed_point_chunks(rows, bounds), np.array(maxima))


def joined(
    sums: npt.NDArray[np.int64], maxima: FloatArray, bounds: FloatArray
) -> dict[str, float]:
    """Return the series by name, from the parts of all ranks.

    Parameters
    ----------
    sums : ndarray of int64, shape (ranks, sums, CHUNKS)
    maxima : ndarray, shape (ranks, extremes)
    bounds : ndarray, shape (sums,)
    """
    totals = from_chunks(sums.sum(axis=0), bounds).tolist()
    # The sum makes no zero negative.
    extremes = (_SIGNS * maxima.max(axis=0) + 0.0).tolist()
    found = {
        **{s.name: value for s, value in zip(SUMS, totals, strict=True)},
        **{s.name: value for s, value in zip(EXTREMES, extremes, strict=True)},
    }
    if found["cloud_arrived"]:
        found.update({s.name: math.nan for s in SERIES if s.until_arrival})
    return {series.name: found[series.name] for series in SERIES}
