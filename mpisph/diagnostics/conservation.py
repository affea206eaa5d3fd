"""What is conserved: sums over the particles, and their changes."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.core.particles import FloatArray, Particles

TOTALS = ("mass", "momentum_z", "kinetic_energy", "internal_energy")
"""Rows of `totals`."""


class ConservationErrors(NamedTuple):
    """Changes of the totals since the start, relative to their initial values.

    Attributes
    ----------
    mass, momentum_z, energy : float
    """

    mass: float
    momentum_z: float
    energy: float


def totals(particles: Particles) -> FloatArray:
    """Return what each particle adds to the totals, to be summed reproducibly.

    Parameters
    ----------
    particles : Particles
        Owned particles.

    Returns
    -------
    ndarray of float64, shape (len(TOTALS), n)
        Mass [kg], axial momentum [kg m/s], kinetic and internal energy [J].
    """
    p = particles
    terms: FloatArray = _totals(p.m, p.u_r, p.u_z, p.E)
    return terms


@njit(**EXACT)  # type: ignore[untyped-decorator]
def _totals(
    m: FloatArray, u_r: FloatArray, u_z: FloatArray, E: FloatArray
) -> FloatArray:
    terms = np.empty((4, m.size))
    for i in range(m.size):
        terms[0, i] = m[i]
        terms[1, i] = m[i] * u_z[i]
        terms[2, i] = 0.5 * m[i] * (u_r[i] * u_r[i] + u_z[i] * u_z[i])
        terms[3, i] = m[i] * E[i]
    return terms


def conservation_errors(
    initial: Sequence[float] | FloatArray, now: Sequence[float] | FloatArray
) -> ConservationErrors:
    """Compare totals with the initial ones.

    A system that is at rest as a whole has no momentum to compare with; its
    error is then relative to ``sqrt(2 M T)``, the momentum that its mass would
    have if all of its energy moved it one way.

    Parameters
    ----------
    initial, now : sequence of float, shape (len(TOTALS),)
        Sums of the rows of `totals`.

    Returns
    -------
    ConservationErrors
    """
    mass, momentum, kinetic, internal = (float(x) for x in initial)
    energy = kinetic + internal
    scale = math.sqrt(2.0 * mass * abs(energy))
    # Rounding leaves a system at rest some 1e-16 of that momentum.
    momentum_scale = abs(momentum) if abs(momentum) > 1e-9 * scale else scale
    return ConservationErrors(
        _ratio(float(now[0]) - mass, mass),
        _ratio(float(now[1]) - momentum, momentum_scale),
        _ratio(float(now[2]) + float(now[3]) - energy, abs(energy)),
    )


def _ratio(change: float, scale: float) -> float:
    """Return the relative change, zero where there was and is nothing."""
    if change == 0.0:
        return 0.0
    return change / scale if scale > 0.0 else math.inf
