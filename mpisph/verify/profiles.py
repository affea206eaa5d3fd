"""Profiles along a line: means of particles, and where they cross a level."""

import math

import numpy as np

from mpisph.verify.problem import Array


def mean_in(field: Array, mass: Array, place: Array, low: float, high: float) -> float:
    """Return the mean of a field by mass where `place` is between two limits.

    NaN where there are no particles.
    """
    inside = (place > low) & (place < high)
    if not inside.any():
        return math.nan
    return float(np.average(field[inside], weights=mass[inside]))


def profile(place: Array, field: Array, width: float) -> tuple[Array, Array]:
    """Return means of a field in layers that hold particles: their middles, the means.

    Parameters
    ----------
    place, field : ndarray, shape (n,)
    width : float
        Of a layer; the first begins at zero, or at a multiple of the width.

    Returns
    -------
    middles, means : ndarray, shape (layers,)
        The mean place of the particles in a layer, increasing.
    """
    layers = np.floor(place / width).astype(np.int64)
    layers -= layers.min()
    number = np.bincount(layers)
    filled = number > 0
    sums = [np.bincount(layers, weights=x)[filled] for x in (place, field)]
    middles, means = (each / number[filled] for each in sums)
    return middles, means


def outermost_crossing(middles: Array, means: Array, level: float) -> float:
    """Return the largest place at which a profile falls through a level.

    NaN where it does nowhere.
    """
    above = means > level
    falls = np.flatnonzero(above[:-1] & ~above[1:])
    if falls.size == 0:
        return math.nan
    k = falls[-1]
    share = (means[k] - level) / (means[k] - means[k + 1])
    return float(middles[k] + share * (middles[k + 1] - middles[k]))
