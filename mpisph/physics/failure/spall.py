"""Spall: matter parts where its tension reaches a strength (R16).

A crack then opens, and the tension that it lets through falls in proportion to its
opening, whose share of the last one is its memory. It opens at once, or in a relaxation
time, so that a short pulse may exceed the strength. Where it closes again, matter is
relieved elastically.

References
----------
Hillerborg, Modeer, Petersson (1976), Cement and Concrete Research 6, 773: cracks that
open against a tension. Bazant, Oh (1983), Materials and Structures 16, 155: in a band.
Tuler, Butcher (1968), Int. J. Fract. Mech. 4, 431: a strength that depends on how long
the tension lasts.
"""

from typing import Literal

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import CrackEnergy, NonNegativeTime, PositivePressure
from mpisph.inputs.sourced import Sourced
from mpisph.physics.cracks import (
    BAND,
    borne,
    bulk_modulus,
    crack_growth,
    largest_deviatoric_stress,
    ring_size,
)
from mpisph.physics.eos import pressure
from mpisph.physics.failure.none import undamaged
from mpisph.physics.models import Model

PRESSURE = 0
PRINCIPAL = 1

LEAST_LENGTH = 2.0
"""Characteristic length of a crack, ``K G_c / strength**2``, in widths of the band: a
shorter one is not resolved."""


class Spall(Sourced):
    """Constants of spall (R16)."""

    strength: PositivePressure
    """Tension at which matter parts."""
    criterion: Literal["pressure", "principal"] = "pressure"
    """Which tension: minus the pressure, or the largest principal stress."""
    crack_energy: CrackEnergy = 0.0
    """Energy that an area of crack takes; at least what the spacing resolves."""
    relaxation_time: NonNegativeTime = 0.0
    """Time in which cracks take up what exceeds the strength; 0: at once."""


@jitted(**EXACT)
def opening_strain(h, strength, crack_energy, bulk):
    """Return the strain of the band of a crack at its last opening (R16).

    The tension falls from the strength to zero over an opening of ``2 crack_energy/
    strength``, or a larger one that the spacing resolves.

    Parameters
    ----------
    h : float
        Smoothing length [m].
    strength : float
        [Pa].
    crack_energy : float
        [J/m2].
    bulk : float
        Bulk modulus [Pa].
    """
    resolved = 2.0 * LEAST_LENGTH * strength / bulk
    return max(2.0 * crack_energy / (strength * BAND * h), resolved)


@jitted(**EXACT)
def opening_growth(excess, last, strength, bulk):
    """Return by what share of its last opening a crack takes up a tension (R16).

    It opens by what the elastic strain of its band does not take, which falls as the
    tension does and so helps to open it.

    Parameters
    ----------
    excess : float
        Tension above what the crack lets through [Pa].
    last : float
        `opening_strain`.
    strength, bulk : float
        [Pa].
    """
    return excess / (bulk * last - strength)


@jitted(**EXACT)
def relaxed_share(dt, relaxation_time):
    """Return the share of an excess of tension that cracks take up in a time (R16).

    The excess falls by its own share per relaxation time, counted with the excess at
    the end: so one that grows at a constant rate settles at rate times relaxation time,
    whatever the step.

    Parameters
    ----------
    dt, relaxation_time : float
        [s].
    """
    return dt / (dt + relaxation_time) if relaxation_time > 0.0 else 1.0


@jitted(**EXACT)
def untorn_share(damage, opening):
    """Return the share that is not torn, of matter whose cracks are open (R16).

    The damage is what cracks and tearing (R18) have taken together:
    ``1 - damage = (1 - opening) untorn``.
    """
    return min((1.0 - damage) / (1.0 - opening), 1.0) if opening < 1.0 else 0.0


@jitted(**EXACT)
def _between_cracks(P, rho, E, alpha, opening, h, mat):
    """Return the pressure of matter without the opening of its cracks, none above 0."""
    if P >= 0.0 or opening <= 0.0 or opening >= 1.0:
        return P
    spall = mat.spall
    last = opening_strain(h, spall.strength, spall.crack_energy, bulk_modulus(mat))
    solid = alpha * rho * (1.0 + opening * last)
    return min(pressure(solid, E, mat)[0] / alpha, 0.0)


@jitted(**EXACT)
def _excess(P, S_rr, S_zz, S_rz, damage, opening, spall):
    """Return by how much the tension exceeds what the crack lets through [Pa]."""
    untorn = untorn_share(damage, opening)
    if untorn <= 0.0:
        return 0.0
    tension = -P
    if spall.criterion == PRINCIPAL:
        tension += largest_deviatoric_stress(S_rr, S_zz, S_rz) / untorn
    return tension - (1.0 - opening) * spall.strength


@jitted(**EXACT)
def _limited(P, excess, damage, opening):
    # The principal stress counts only as far as matter is in tension as a whole.
    P = P if excess <= 0.0 else min(P + excess, max(P, 0.0))
    return borne(P, untorn_share(damage, opening))


@jitted(**ENTRY)
def _limit_tension(x, k, mat, dt):
    # Without a branch here, no references to the arrays are counted.
    D, opening = x.damage[k], x.opening[k]
    P = _between_cracks(x.P[k], x.rho[k], x.E[k], x.distension[k], opening, x.h[k], mat)
    excess = _excess(P, x.S_rr[k], x.S_zz[k], x.S_rz[k], D, opening, mat.spall)
    excess *= relaxed_share(dt, mat.spall.relaxation_time)
    return _limited(P, excess, D, opening), excess


@jitted(**EXACT)
def _growth(excess, opening, m, r, h, rho, c, G, mat, dt):
    if excess <= 0.0:
        return 0.0
    spall, bulk = mat.spall, bulk_modulus(mat)
    last = opening_strain(h, spall.strength, spall.crack_energy, bulk)
    growth = min(
        opening_growth(excess, last, spall.strength, bulk),
        crack_growth(c, G, rho, ring_size(m, r, rho), dt),
    )
    return min(growth, 1.0 - opening)


@jitted(**ENTRY)
def _damage_growth(x, k, mat, excess, dt):
    opening = x.opening[k]
    growth = _growth(
        excess, opening, x.m[k], x.r[k], x.h[k], x.rho[k], x.c[k], x.G[k], mat, dt
    )
    x.opening[k] = opening + growth
    return growth * untorn_share(x.damage[k], opening)


MODEL = Model(
    "spall",
    "spall",
    Spall,
    {
        "sound_share": undamaged,
        "limit_tension": _limit_tension,
        "damage_growth": _damage_growth,
    },
    ("damage", "opening"),
)
