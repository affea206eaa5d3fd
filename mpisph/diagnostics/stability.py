"""Signs that a run has become unstable, looked for in every step."""

import math
from typing import NamedTuple

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import LABEL, VALUE

STABLE = 0
NON_FINITE = 1
DENSITY = 2
ENERGY = 3
SMOOTHING = 4
NEGATIVE = 5
CROWDED = 6
REASONS = {
    NON_FINITE: ("non_finite", "a field is not finite, or h is not positive"),
    DENSITY: ("density", "the density is out of bounds"),
    ENERGY: ("internal_energy", "the specific internal energy is out of bounds"),
    NEGATIVE: ("negative_energy", "the specific internal energy is too far below zero"),
    CROWDED: ("kernel_sum", "the kernel sum is too far above the density"),
    SMOOTHING: ("smoothing_length", "the smoothing length is out of bounds"),
}
"""Short name and meaning of each fault."""


class Bounds(NamedTuple):
    """Bounds that no sound run reaches.

    Attributes
    ----------
    density_min, density_max : float
        In units of the material's reference density.
    energy_min, energy_max : float
        Specific internal energy [J/kg]; the least one is negative.
    crowding_max : float
        Kernel sum over density.
    h_min, h_max : float
        Smoothing length [m]; within a factor of 10^8 the cells of the neighbour
        search can hold every particle.
    """

    density_min: float
    density_max: float
    energy_min: float
    energy_max: float
    crowding_max: float
    h_min: float
    h_max: float


@jitted(**{**EXACT, "fastmath": {"reassoc"}})
def _all_finite(values):
    """Say whether all values are finite: zero times anything else is not a number."""
    total = 0.0
    for k in range(values.shape[0]):
        for i in range(values.shape[1]):
            total += 0.0 * values[k, i]
    return total == 0.0


@jitted(**EXACT)
def _beyond(eta, E, crowding, h, bounds):
    """Return the kind of fault of a particle by the bounds."""
    if not bounds.density_min < eta < bounds.density_max:
        return DENSITY
    if E > bounds.energy_max:
        return ENERGY
    if E < bounds.energy_min:
        return NEGATIVE
    if crowding > bounds.crowding_max:
        return CROWDED
    if not bounds.h_min < h < bounds.h_max:
        return SMOOTHING
    return STABLE


@jitted(**EXACT)
def first_fault(labels, values, table, bounds):
    """Return the fault among the owned particles, and the particle's id.

    Parameters
    ----------
    labels, values : ndarray
        Of `Particles`.
    table : structured ndarray
        Material constants.
    bounds : Bounds

    Returns
    -------
    fault : int
        `STABLE`, or a key of `REASONS`.
    who : int
        Smallest id of a faulty particle, -1 for none.
    """
    ids, material = labels[LABEL.id], labels[LABEL.material]
    rho, E, h = values[VALUE.rho], values[VALUE.E], values[VALUE.h]
    crowding = values[VALUE.crowding]
    fault, who = STABLE, -1
    all_finite = _all_finite(values)
    for i in range(ids.size):
        eta = rho[i] / table[material[i]].rho0
        finite = h[i] > 0.0
        if not all_finite:
            for k in range(values.shape[0]):
                finite &= math.isfinite(values[k, i])
        kind = _beyond(eta, E[i], crowding[i], h[i], bounds) if finite else NON_FINITE
        if kind != STABLE and (fault == STABLE or ids[i] < who):
            fault, who = kind, ids[i]
    return fault, who
