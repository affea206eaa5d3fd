"""The debris cloud: which particles form it, and its size (R12)."""

import math
from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.bodies import Body, Plate
from mpisph.case.sections import Exposure, Measured
from mpisph.case.target import (
    bodies_before,
    bodies_behind,
    default_plate,
    direction_of_impact,
    front_face,
    rear_position,
)
from mpisph.core.jitted import jitable
from mpisph.core.particles import FloatArray, IntArray, Particles
from mpisph.parallel.redistribution import gather_all

CloudFigure = Literal["outermost", "robust"]
"""Which figure of a cloud is meant: its outermost particle's, or the quantile."""

_NO_VELOCITIES = np.empty(0)
_NO_BODIES = np.empty(0, np.bool_)


class CloudDefinition(NamedTuple):
    """Which particles form the cloud, and where the robust measure cuts.

    Attributes
    ----------
    rear : float
        Original axial position of the plate's rear face [m].
    min_velocity : float
        The cloud moves faster than this away from the plate [m/s]. The lip of the hole
        stands behind the plate as well, but hardly moves axially.
    quantile : float
        Fraction of the cloud's mass within the robust measures.
    direction : float
        1.0 where the projectile flies along +z, -1.0 along -z.
    behind : ndarray, shape (bodies,)
        Initial velocity [m/s] of the bodies behind the plate, which are no part of the
        cloud, and NaN of the others; empty where there are none behind it.
    before : ndarray of bool, shape (bodies,)
        Which bodies lie wholly before the nearest of those; empty as well.
    stop : float
        Length at which the nearest of them begins [m]; infinite where that moves.
    stirred : float
        A body behind the plate has been hit where its velocity has changed by more
        than this [m/s].
    """

    rear: float
    min_velocity: float
    quantile: float
    direction: float = 1.0
    behind: FloatArray = _NO_VELOCITIES
    before: npt.NDArray[np.bool_] = _NO_BODIES
    stop: float = math.inf
    stirred: float = 0.0


class CloudMeasure(NamedTuple):
    """Size and motion of the cloud; all zero where there is none.

    All is NaN once it has come to the next body: it can be told from that no longer.

    Attributes
    ----------
    radius : float
        R_b, the largest radius [m].
    length : float
        L_b, from the plate's original rear face to the foremost particle [m].
    radius_robust : float
        Radius that the given fraction of the mass lies within [m].
    length_robust : float
        Length that the given fraction of the mass lies within [m].
    front_velocity : float
        Velocity of the foremost particle, away from the plate [m/s].
    mass : float
        [kg].
    """

    radius: float
    length: float
    radius_robust: float
    length_robust: float
    front_velocity: float
    mass: float


NO_MEASURE = CloudMeasure(*[math.nan] * 6)
"""Of a cloud that has come to the next body."""

NEEDED = ("id", "body", "r", "z", "u_r", "u_z", "m")
"""What the cloud is measured from."""

STIRRED = 0.01
"""Change of velocity over that of the impact by which a body shows that it is hit.
Kernels reach some spacings ahead: soon after that the cloud's front is slowed down."""


class CloudErrors(NamedTuple):
    """Errors of the computed cloud relative to the measured one.

    Attributes
    ----------
    radius, length : float or None
        Computed over measured, less one; None where nothing was measured.
    """

    radius: float | None
    length: float | None


def target_plate(case: Case) -> Plate | None:
    """Return the plate that lengths count from.

    Parameters
    ----------
    case : Case
        The plate is the one that its measurements name; without any, it is the one that
        is hit first (see `target.default_plate`).

    Returns
    -------
    Plate or None
    """
    if case.measured is not None:
        return case.measured_plate
    return default_plate(case.bodies)


def impact_direction(case: Case) -> float:
    """Return 1.0 where what hits the target flies along +z, -1.0 along -z."""
    return direction_of_impact(case.bodies, target_plate(case))


def rear_face(case: Case) -> float:
    """Return the original axial position of the target plate's rear face [m].

    Parameters
    ----------
    case : Case
        See `target_plate`; its rear face is that away from what hits it.

    Returns
    -------
    float
        Infinitely far off where there is no plate: nothing lies behind it.
    """
    plate, direction = target_plate(case), impact_direction(case)
    if plate is None:
        return direction * math.inf
    return rear_position(plate, direction)


def next_body(case: Case) -> Body | None:
    """Return the body behind the target plate that the cloud comes to first, if any."""
    plate = target_plate(case)
    behind = [] if plate is None else bodies_behind(case.bodies, plate)
    return case.bodies[behind[0]] if behind else None


def cloud_definition(case: Case) -> CloudDefinition:
    """Return which particles of a case form its cloud.

    Parameters
    ----------
    case : Case
        Without measurements, their defaults say what the cloud is.

    Returns
    -------
    CloudDefinition
    """
    measured = case.measured or Measured()
    plate, direction = target_plate(case), impact_direction(case)
    behind = [] if plate is None else bodies_behind(case.bodies, plate)
    definition = CloudDefinition(
        rear=rear_face(case),
        direction=direction,
        min_velocity=measured.min_velocity_fraction * case.impact_velocity,
        quantile=measured.quantile,
        stirred=STIRRED * case.impact_velocity,
    )
    if not behind:
        return definition
    nearest, n = case.bodies[behind[0]], len(case.bodies)
    velocities = np.full(n, np.nan)
    velocities[behind] = [case.bodies[k].velocity for k in behind]
    before = np.isin(np.arange(n), bodies_before(case.bodies, behind[0], direction))
    stop = front_face(nearest, direction) - direction * definition.rear
    return definition._replace(
        behind=velocities,
        before=before,
        stop=stop if nearest.velocity == 0.0 else math.inf,
    )


# The four below take the arrays of many particles, or in a jitted function the numbers
# of one.


@jitable
def in_cloud(
    body: IntArray, z: FloatArray, u_z: FloatArray, definition: CloudDefinition
) -> npt.NDArray[np.bool_]:
    """Say which particles are in the cloud, shape (n,)."""
    behind = length_of(z, definition) > 0.0
    cloud: npt.NDArray[np.bool_] = behind & before_next(body, definition)
    cloud = cloud & (definition.direction * u_z > definition.min_velocity)
    return cloud


@jitable
def before_next(body: IntArray, definition: CloudDefinition) -> npt.NDArray[np.bool_]:
    """Say which particles are of no body behind the target plate, shape (n,)."""
    if definition.behind.size == 0:
        return body >= 0  # of all
    return np.isnan(definition.behind[body])


@jitable
def shows_arrival(
    body: IntArray,
    z: FloatArray,
    u_r: FloatArray,
    u_z: FloatArray,
    definition: CloudDefinition,
) -> npt.NDArray[np.bool_]:
    """Say which particles show that the cloud has come to the next body, shape (n,).

    They are those beyond the front face of a body at rest that come from bodies before
    it, and those of a body behind the plate that no longer move as at the start. Once
    there are any, there are always some: what hits a body leaves a crater, or stirs it.
    """
    if definition.behind.size == 0:
        return body < 0  # of none
    change = u_z - definition.behind[body]  # NaN of bodies not behind
    shown: npt.NDArray[np.bool_] = (
        np.sqrt(u_r * u_r + change * change) > definition.stirred
    )
    there = length_of(z, definition) >= definition.stop
    shown = shown | (definition.before[body] & there)
    return shown


@jitable
def length_of(z: Any, definition: CloudDefinition) -> Any:
    """Return how far behind the plate's original rear face positions lie [m]."""
    return definition.direction * (z - definition.rear)


def place_of(length: float, definition: CloudDefinition) -> float:
    """Return the axial position at a length behind the plate's rear face [m]."""
    return definition.rear + definition.direction * length


def measure_cloud(
    comm: MPI.Intracomm, particles: Particles, definition: CloudDefinition
) -> CloudMeasure:
    """Measure the cloud (R12), to the same bits on any number of ranks.

    Parameters
    ----------
    comm : MPI.Intracomm
    particles : Particles
        Owned particles; any rank may own none.
    definition : CloudDefinition

    Returns
    -------
    CloudMeasure
        The same on all ranks.
    """
    p = particles
    arrived = shows_arrival(p.body, p.z, p.u_r, p.u_z, definition).any()
    if comm.allreduce(bool(arrived), MPI.LOR):
        return NO_MEASURE
    gathered = gather_all(comm, p.take(in_cloud(p.body, p.z, p.u_z, definition)))
    result = np.zeros(len(CloudMeasure._fields))
    if gathered is not None:
        arrays = {name: getattr(gathered, name) for name in NEEDED}
        result[:] = measure_arrays(arrays, definition)
    comm.Bcast(result)
    return CloudMeasure(*result.tolist())


def measure_arrays(
    arrays: Mapping[str, npt.NDArray[Any]], definition: CloudDefinition
) -> CloudMeasure:
    """Measure the cloud among the particles given, in any order (R12).

    Parameters
    ----------
    arrays : mapping of str to ndarray
        Those of `NEEDED`, each of shape (n,), in SI units, as in `Snapshot.arrays`. The
        ids settle the order of particles at the same place.
    definition : CloudDefinition

    Returns
    -------
    CloudMeasure
        `NO_MEASURE` where the cloud has come to the next body.
    """
    body, u_r = arrays["body"], arrays["u_r"]
    ids, r, z, u_z, m = (arrays[name] for name in ("id", "r", "z", "u_z", "m"))
    if shows_arrival(body, z, u_r, u_z, definition).any():
        return NO_MEASURE
    cloud = np.flatnonzero(in_cloud(body, z, u_z, definition))
    if not cloud.size:
        return CloudMeasure(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    ids, r, z, u_z, m = ids[cloud], r[cloud], z[cloud], u_z[cloud], m[cloud]
    length = length_of(z, definition)
    front = np.lexsort((ids, length))[-1]
    return CloudMeasure(
        float(r.max()),
        float(length[front]),
        _mass_quantile(r, m, ids, definition.quantile),
        _mass_quantile(length, m, ids, definition.quantile),
        float(definition.direction * u_z[front]),
        math.fsum(m),
    )


def _mass_quantile(
    x: FloatArray, m: FloatArray, ids: IntArray, fraction: float
) -> float:
    """Return the smallest `x` that `fraction` of the mass lies at or below."""
    order = np.lexsort((ids, x))
    below = np.cumsum(m[order])
    place = np.searchsorted(below, fraction * below[-1])
    return float(x[order[min(place, len(order) - 1)]])


def compare(
    measure: CloudMeasure, exposure: Exposure, figure: CloudFigure = "outermost"
) -> CloudErrors:
    """Compare a computed cloud with a measured one.

    Parameters
    ----------
    measure : CloudMeasure
    exposure : Exposure
        Its radius and length may each be missing.
    figure : {"outermost", "robust"}, optional
        Which of the computed figures is compared.

    Returns
    -------
    CloudErrors
        Fractions, positive where the computed cloud is larger.
    """
    radius, length = cloud_size(measure, figure)
    return CloudErrors(
        None if exposure.radius is None else radius / exposure.radius - 1.0,
        None if exposure.length is None else length / exposure.length - 1.0,
    )


def cloud_size(measure: CloudMeasure, figure: CloudFigure) -> tuple[float, float]:
    """Return R_b and L_b [m] by the outermost particle or by the quantile."""
    if figure == "robust":
        return measure.radius_robust, measure.length_robust
    return measure.radius, measure.length
