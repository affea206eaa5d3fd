"""Spall: matter parts where its tension reaches a strength (R16).

The damage then grows while the crack opens: no faster than a crack crosses the
particle, and no faster than its energy allows. Its memory is the damage.
"""

from typing import Literal

from numba import njit

from mpisph.core.jit import ENTRY, EXACT
from mpisph.inputs.quantities import CrackEnergy, PositivePressure
from mpisph.inputs.sourced import Sourced
from mpisph.physics.cracks import crack_growth, largest_principal_stress, ring_size
from mpisph.physics.failure.none import unlimited
from mpisph.physics.models import Model

PRESSURE = 0
PRINCIPAL = 1


class Spall(Sourced):
    """Constants of spall (R16)."""

    strength: PositivePressure
    """Tension at which matter parts."""
    criterion: Literal["pressure", "principal"] = "pressure"
    """Which tension: minus the pressure, or the largest principal stress."""
    crack_energy: CrackEnergy = 0.0
    """Energy that an area of crack takes to open; 0: as fast as a crack runs."""


@njit(**EXACT)
def opening_growth(div, size, strength, crack_energy, dt):
    """Return the damage of a crack that opens with its particle (R16).

    The tension falls in proportion to the opening from the strength to zero, so that
    the crack takes ``crack_energy`` by an opening of twice that over the strength.

    Parameters
    ----------
    div : float
        Divergence of the velocity [1/s].
    size : float
        Of the particle [m].
    strength : float
        [Pa].
    crack_energy : float
        [J/m2].
    dt : float
        [s].
    """
    return 0.5 * max(div, 0.0) * size * strength / crack_energy * dt


@njit(**ENTRY)
def _damage_growth(x, k, mat, dt):
    spall = mat.spall
    tension = -x.P[k]
    if spall.criterion == PRINCIPAL:
        tension = largest_principal_stress(x.P[k], x.S_rr[k], x.S_zz[k], x.S_rz[k])
    if tension < (1.0 - x.damage[k]) * spall.strength:
        return 0.0
    size = ring_size(x.m[k], x.r[k], x.rho[k])
    growth = crack_growth(x.c[k], x.G[k], x.rho[k], size, dt)
    if spall.crack_energy > 0.0:
        opened = opening_growth(x.div[k], size, spall.strength, spall.crack_energy, dt)
        growth = min(growth, opened)
    return growth


MODEL = Model(
    "spall",
    "spall",
    Spall,
    {"limit_pressure": unlimited, "damage_growth": _damage_growth},
)
