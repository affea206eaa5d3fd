"""The debris cloud: which particles form it, and its size (R12)."""

import math
from typing import Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.bodies import Plate
from mpisph.case.sections import Exposure, Measured
from mpisph.core.particles import FloatArray, IntArray, Particles
from mpisph.parallel.redistribution import gather_all

CloudFigure = Literal["outermost", "robust"]
"""Which figure of a cloud is meant: its outermost particle's, or the quantile."""


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
    """

    rear: float
    min_velocity: float
    quantile: float
    direction: float = 1.0


class CloudMeasure(NamedTuple):
    """Size and motion of the cloud; all zero where there is none.

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
        The plate is the one that its measurements name; without any, it is the
        slowest one, whichever way it moves; of two as slow, that along -z.

    Returns
    -------
    Plate or None
    """
    plates = [body for body in case.bodies if isinstance(body, Plate)]
    if case.measured is not None:
        plates = [plate for plate in plates if plate.name == case.measured.plate]
    by_speed = [(abs(plate.velocity), plate.velocity) for plate in plates]
    return plates[by_speed.index(min(by_speed))] if plates else None


def impact_direction(case: Case) -> float:
    """Return 1.0 where what hits the target flies along +z, -1.0 along -z."""
    plate = target_plate(case)
    still = 0.0 if plate is None else plate.velocity
    relative = [body.velocity - still for body in case.bodies]
    return -1.0 if max(relative, key=abs, default=0.0) < 0.0 else 1.0


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
    return plate.rear_face if direction > 0.0 else plate.position


def impact_velocity(case: Case) -> float:
    """Return the largest difference between the velocities of two bodies [m/s]."""
    velocities = [body.velocity for body in case.bodies]
    return max(velocities) - min(velocities)


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
    return CloudDefinition(
        rear=rear_face(case),
        direction=impact_direction(case),
        min_velocity=measured.min_velocity_fraction * impact_velocity(case),
        quantile=measured.quantile,
    )


def in_cloud(
    z: FloatArray, u_z: FloatArray, definition: CloudDefinition
) -> npt.NDArray[np.bool_]:
    """Say which particles are in the cloud, shape (n,)."""
    behind = length_of(z, definition) > 0.0
    return behind & (definition.direction * u_z > definition.min_velocity)


def length_of(z: FloatArray, definition: CloudDefinition) -> FloatArray:
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
    cloud = in_cloud(particles.z, particles.u_z, definition)
    gathered = gather_all(comm, particles.take(cloud))
    result = np.zeros(len(CloudMeasure._fields))
    if gathered is not None:
        p = gathered
        result[:] = measure_arrays(p.id, p.r, p.z, p.u_z, p.m, definition)
    comm.Bcast(result)
    return CloudMeasure(*result.tolist())


def measure_arrays(
    ids: IntArray,
    r: FloatArray,
    z: FloatArray,
    u_z: FloatArray,
    m: FloatArray,
    definition: CloudDefinition,
) -> CloudMeasure:
    """Measure the cloud among the particles given, in any order (R12).

    Parameters
    ----------
    ids : ndarray of int64, shape (n,)
        Settle the order of particles at the same place.
    r, z : ndarray, shape (n,)
        [m].
    u_z : ndarray, shape (n,)
        [m/s].
    m : ndarray, shape (n,)
        [kg].
    definition : CloudDefinition

    Returns
    -------
    CloudMeasure
    """
    cloud = np.flatnonzero(in_cloud(z, u_z, definition))
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
