"""Spall: matter parts where its tension reaches a strength (R16).

A crack then opens, and the tension that it lets through falls in proportion to its
opening. The damage is that share of its last opening: its memory.
"""

import math
from typing import Literal

from numba import njit

from mpisph.core.jit import ENTRY, EXACT
from mpisph.inputs.quantities import CrackEnergy, PositivePressure
from mpisph.inputs.sourced import Sourced
from mpisph.physics.cracks import crack_growth, largest_deviatoric_stress, ring_size
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
    """Energy that an area of crack takes to open; 0: it opens as fast as it runs."""


@njit(**EXACT)
def opening_growth(stretch, size, strength, crack_energy, bulk_modulus):
    """Return the damage of a crack that opens as its particle stretches (R16).

    The tension falls from the strength to zero over an opening of ``2 crack_energy/
    strength``; the particle gives up its elastic strain meanwhile, which helps to open
    the crack. Where that alone opens it, the result is infinite.

    Parameters
    ----------
    stretch : float
        Growth of the volume over the volume.
    size : float
        Of the particle [m].
    strength : float
        [Pa].
    crack_energy : float
        [J/m2].
    bulk_modulus : float
        [Pa].
    """
    last = 2.0 * crack_energy / strength - size * strength / bulk_modulus
    if last <= 0.0:
        return math.inf
    return max(stretch, 0.0) * size / last


@njit(**EXACT)
def _excess(P, S_rr, S_zz, S_rz, damage, spall):
    """Return by how much the tension exceeds what the crack lets through [Pa]."""
    tension = -P
    if spall.criterion == PRINCIPAL:
        tension += largest_deviatoric_stress(S_rr, S_zz, S_rz)
    return tension - (1.0 - damage) * spall.strength


@njit(**EXACT)
def _limited(P, excess):
    # The principal stress counts only as far as matter is in tension as a whole.
    return P if excess <= 0.0 else min(P + excess, max(P, 0.0))


@njit(**ENTRY)
def _limit_tension(x, k, mat):
    excess = _excess(x.P[k], x.S_rr[k], x.S_zz[k], x.S_rz[k], x.damage[k], mat.spall)
    return _limited(x.P[k], excess), 1.0 - x.damage[k]


@njit(**EXACT)
def _growth(excess, m, r, rho, c, G, div, mat, dt):
    if excess < 0.0:
        return 0.0
    spall = mat.spall
    size = ring_size(m, r, rho)
    growth = crack_growth(c, G, rho, size, dt)
    if spall.crack_energy > 0.0:
        bulk = mat.rho0 * mat.bulk_sound_speed * mat.bulk_sound_speed
        opened = opening_growth(
            div * dt, size, spall.strength, spall.crack_energy, bulk
        )
        growth = min(growth, opened)
    return growth


@njit(**ENTRY)
def _damage_growth(x, k, mat, dt):
    # Without a branch here, no references to the arrays are counted.
    excess = _excess(x.P[k], x.S_rr[k], x.S_zz[k], x.S_rz[k], x.damage[k], mat.spall)
    return _growth(excess, x.m[k], x.r[k], x.rho[k], x.c[k], x.G[k], x.div[k], mat, dt)


MODEL = Model(
    "spall",
    "spall",
    Spall,
    {"limit_tension": _limit_tension, "damage_growth": _damage_growth},
    ("damage",),
)
