"""The quantities that are summed up, or whose maximum is taken, in every step.

A quantity is one entry of `SERIES`: the global reduction, the columns of the history
and their figures follow.
"""

import math
from collections.abc import Callable
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import LABEL, VALUE, FloatArray, IntArray, Particles
from mpisph.diagnostics.cloud import (
    CloudDefinition,
    in_cloud,
    length_of,
    shows_arrival,
)
from mpisph.parallel.reproducible_sum import CHUNKS, from_chunks, sum_chunks

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
        How the particles' `Terms` make one number. A maximum is at least zero, a
        minimum at most.
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
    bound: Callable[[Scales], float] = lambda scales: scales.mass
    caption: str = ""
    until_arrival: bool = False


def _momentum_bound(scales: Scales) -> float:
    return scales.mass * (ROOM * scales.speed)


def _energy_bound(scales: Scales) -> float:
    return scales.mass * (ROOM * scales.energy)


SERIES = (
    Series("mass", "kg", "mass", "sum"),
    Series("momentum_z", "kg m/s", "axial momentum", "sum", _momentum_bound),
    Series("kinetic_energy", "J", "kinetic energy", "sum", _energy_bound),
    Series("internal_energy", "J", "internal energy", "sum", _energy_bound),
    Series(
        "energy_min", "J/kg", "lowest specific internal energy", "min",
        caption="Below zero, matter would be colder than at the start of the run: the "
        "artificial viscosity is too low.",
    ),
    Series(
        "cloud_radius", "m", "radius of the cloud, R_b", "max", until_arrival=True,
    ),
    Series(
        "cloud_length", "m", "length of the cloud, L_b", "max", until_arrival=True,
    ),
    Series(
        "cloud_mass", "kg", "mass of the cloud", "sum",
        caption="What lies behind the plate's original rear face and moves away from "
        "it faster than the given fraction of the impact velocity.",
        until_arrival=True,
    ),
    Series(
        "cloud_arrived", "", "1 once the cloud has come to the next body", "max",
    ),
)  # fmt: skip

SUMS = tuple(series for series in SERIES if series.reduce == "sum")
EXTREMES = tuple(series for series in SERIES if series.reduce != "sum")
_SIGNS = np.array([-1.0 if series.reduce == "min" else 1.0 for series in EXTREMES])
# A minimum is sent as the maximum of the opposite.
_SUM_AT = np.array([SERIES.index(series) for series in SUMS])
_EXTREME_AT = np.array([SERIES.index(series) for series in EXTREMES])
_N_SERIES = len(SERIES)
_SUM_NAMES = [series.name for series in SUMS]
_EXTREME_NAMES = [series.name for series in EXTREMES]


class Terms(NamedTuple):
    """What one particle contributes to each of `SERIES`, in their order."""

    mass: float
    momentum_z: float
    kinetic_energy: float
    internal_energy: float
    energy_min: float
    cloud_radius: float
    cloud_length: float
    cloud_mass: float
    cloud_arrived: float


@jitted(**EXACT)
def terms_of(
    labels: IntArray, values: FloatArray, k: int, cloud: CloudDefinition
) -> Terms:
    """Return the terms of particle `k`; what has left the game is in no cloud."""
    body = labels[LABEL.body, k]
    m, r, z = values[VALUE.m, k], values[VALUE.r, k], values[VALUE.z, k]
    u_r, u_z, E = values[VALUE.u_r, k], values[VALUE.u_z, k], values[VALUE.E, k]
    inside = values[VALUE.retired, k] == 0.0 and in_cloud(body, z, u_z, cloud)
    return Terms(
        mass=m,
        momentum_z=m * u_z,
        kinetic_energy=0.5 * m * (u_r * u_r + u_z * u_z),
        internal_energy=m * E,
        energy_min=E,
        cloud_radius=r if inside else 0.0,
        cloud_length=length_of(z, cloud) if inside else 0.0,
        cloud_mass=m if inside else 0.0,
        cloud_arrived=1.0 if shows_arrival(body, z, u_r, u_z, cloud) else 0.0,
    )


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
    return Parts(*parts_of(p.labels, p.values, cloud, bounds))


@jitted(**EXACT)
def parts_of(
    labels: IntArray, values: FloatArray, cloud: CloudDefinition, bounds: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Return the same as `local_parts` of the rows of particles."""
    n = labels.shape[1]
    rows = np.empty((_SUM_AT.size, n))
    extremes = np.empty((_EXTREME_AT.size, n))
    for k in range(n):
        terms = terms_of(labels, values, k, cloud)
        for row in range(_SUM_AT.size):
            rows[row, k] = terms[_SUM_AT[row]]
        for row in range(_EXTREME_AT.size):
            extremes[row, k] = terms[_EXTREME_AT[row]]
    maxima = np.zeros(_EXTREME_AT.size)
    for row in range(_EXTREME_AT.size):
        for term in extremes[row]:
            signed = _SIGNS[row] * term
            if signed > maxima[row] or np.isnan(signed):  # max() may pass over a NaN
                maxima[row] = signed
    return sum_chunks(rows, bounds), maxima


def joined(
    sums: npt.NDArray[np.int64], maxima: FloatArray, bounds: FloatArray
) -> dict[str, float]:
    """Return the series by name, from what the parts of all ranks add up to.

    Parameters
    ----------
    sums : ndarray of int64, shape (sums, CHUNKS)
        Sum over the ranks.
    maxima : ndarray, shape (extremes,)
        Maximum over the ranks.
    bounds : ndarray, shape (sums,)
    """
    found = dict(zip(_SUM_NAMES, from_chunks(sums, bounds).tolist(), strict=True))
    # The sum makes no zero negative.
    extremes = (_SIGNS * maxima + 0.0).tolist()
    found |= zip(_EXTREME_NAMES, extremes, strict=True)
    if found["cloud_arrived"]:
        found.update({s.name: math.nan for s in SERIES if s.until_arrival})
    return {name: found[name] for name in Terms._fields}
