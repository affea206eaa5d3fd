"""What is conserved: sums over the particles, and their changes."""

import math
from collections.abc import Mapping
from typing import NamedTuple


class ConservationErrors(NamedTuple):
    """Changes of the totals since the start, relative to their initial values.

    Attributes
    ----------
    mass, momentum_z, energy : float
    """

    mass: float
    momentum_z: float
    energy: float


def conservation_errors(
    initial: Mapping[str, float], now: Mapping[str, float]
) -> ConservationErrors:
    """Compare conserved sums with the initial ones.

    A system that is at rest as a whole has no momentum to compare with; its
    error is then relative to ``sqrt(2 M T)``, the momentum that its mass would
    have if all of its energy moved it one way.

    Parameters
    ----------
    initial, now : mapping of str to float
        Mass, axial momentum, kinetic and internal energy, named as in `series.SERIES`.

    Returns
    -------
    ConservationErrors
    """
    mass, momentum = initial["mass"], initial["momentum_z"]
    energy = _energy(initial)
    scale = math.sqrt(2.0 * mass * abs(energy))
    # Rounding leaves a system at rest some 1e-16 of that momentum.
    momentum_scale = abs(momentum) if abs(momentum) > 1e-9 * scale else scale
    return ConservationErrors(
        _ratio(now["mass"] - mass, mass),
        _ratio(now["momentum_z"] - momentum, momentum_scale),
        _ratio(_energy(now) - energy, abs(energy)),
    )


def _energy(series: Mapping[str, float]) -> float:
    return series["kinetic_energy"] + series["internal_energy"]


def _ratio(change: float, scale: float) -> float:
    """Return the relative change, zero where there was and is nothing."""
    if change == 0.0:
        return 0.0
    return change / scale if scale > 0.0 else math.inf
