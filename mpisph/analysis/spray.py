"""Which way the debris goes: mass and momentum against the angle of its velocity."""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.core.particles import FloatArray
from mpisph.diagnostics.cloud import CloudDefinition, before_next

BINS = 60
"""By default bins of 3 degrees."""


class Spray(NamedTuple):
    """Moving matter in bins of the angle between its velocity and the axis.

    Attributes
    ----------
    edges : ndarray, shape (bins + 1,)
        From 0, along +z, to 180 [degrees]. Below 90 lies the cloud, above it what is
        thrown back from the front face.
    mass : ndarray, shape (bodies, bins)
        [kg].
    momentum_z, momentum_r : ndarray, shape (bodies, bins)
        Sums of ``m u_z`` and ``m u_r`` [kg m/s]. The vectors of a ring's radial
        momentum cancel around the axis; the sum says how hard it spreads. Matter on
        its way to the axis counts with a negative ``u_r``.
    """

    edges: FloatArray
    mass: FloatArray
    momentum_z: FloatArray
    momentum_r: FloatArray


def measure_spray(
    arrays: Mapping[str, npt.NDArray[Any]],
    definition: CloudDefinition,
    bins: int = BINS,
) -> Spray:
    """Sum what moves over the directions in which it moves.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        ``body``, ``m``, ``u_r`` and ``u_z``, each of shape (n,), in SI units, as in
        `Snapshot.arrays`.
    definition : CloudDefinition
        Only what is faster than its least velocity counts, whichever way it goes, and
        no matter of bodies behind the target plate. Angles count from its direction.
    bins : int, optional
        Number of equal bins from 0 to 180 degrees.

    Returns
    -------
    Spray
        Its sums over the bins are the totals of what moves, to rounding.

    Raises
    ------
    ValueError
        If there is no bin.
    """
    if bins < 1:
        raise ValueError(f"bins = {bins}: expected at least 1")
    m, u_r, u_z, body = (arrays[name] for name in ("m", "u_r", "u_z", "body"))
    moving = np.hypot(u_r, u_z) > definition.min_velocity
    moving &= before_next(body, definition)
    angle = np.degrees(np.arctan2(np.abs(u_r), definition.direction * u_z))
    place = np.minimum((angle * (bins / 180.0)).astype(np.int64), bins - 1)
    bodies = int(body.max(initial=-1)) + 1
    cell = (body * bins + place)[moving]

    def summed(weights: FloatArray) -> FloatArray:
        sums = np.bincount(cell, weights=weights[moving], minlength=bodies * bins)
        return np.asarray(sums.reshape(bodies, bins), np.float64)

    edges = np.linspace(0.0, 180.0, bins + 1)
    return Spray(edges, summed(m), summed(m * u_z), summed(m * u_r))
