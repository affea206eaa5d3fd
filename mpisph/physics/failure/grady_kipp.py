"""Grady-Kipp: brittle matter breaks from flaws that its strain activates (R17).

Flaws whose activation strain is below eps are spread as ``k eps^m`` a volume (Weibull).
Each particle draws its own, in the order of their strains, from a generator that its
number seeds: the same on any number of ranks, and never stored.

References
----------
Grady, Kipp (1980), Int. J. Rock Mech. Min. Sci. 17, 147.
Benz, Asphaug (1995), Computer Physics Communications 87, 253.
"""

import math
from typing import Annotated

import numpy as np
from pydantic import Field, Strict

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import Positive, Quantity
from mpisph.inputs.sourced import Sourced
from mpisph.physics.cracks import (
    CRACK_SPEED,
    bulk_modulus,
    crack_growth,
    largest_deviatoric_stress,
    ring_size,
)
from mpisph.physics.failure.none import limit_by_damage, undamaged
from mpisph.physics.models import Model


class GradyKipp(Sourced):
    """Constants of brittle failure from flaws (R17)."""

    k: Annotated[float, Field(gt=0, le=1e300), Quantity("1/m^3")]
    """Coefficient of Weibull's law."""
    m: Positive
    """Exponent of Weibull's law."""
    seed: Annotated[int, Strict(), Field(ge=0, lt=2**31)] = 0
    """Another seed gives other flaws."""


PIECE_RADIUS = (0.75 / math.pi) ** (1.0 / 3.0)
"""Radius of a sphere over the side of a cube of the same volume."""

MOST_FLAWS = 64
"""Active flaws that are counted one by one; more are taken as their mean."""


@jitted(**EXACT)
def uniform(seed, number, draw):
    """Return a number within 0 and 1, the same for the same three integers (R17).

    The finaliser of SplitMix64 (Steele, Lea, Flood 2014), once for each of them.
    """
    x = np.uint64(0)
    for word in (np.uint64(seed), np.uint64(number), np.uint64(draw)):
        x = (x ^ word) + np.uint64(0x9E3779B97F4A7C15)
        x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        x ^= x >> np.uint64(31)
    return (np.float64(x >> np.uint64(11)) + 0.5) * 2.0**-53


@jitted(**EXACT)
def active_flaws(seed, number, expected):
    """Return how many flaws of a particle are active (R17).

    Parameters
    ----------
    seed, number : int
        Of the material, and of the particle.
    expected : float
        Their mean, ``k V eps^m``: the arrivals of a Poisson process up to there.
    """
    if expected > MOST_FLAWS:
        return expected
    reached, n = -math.log(uniform(seed, number, 0)), 0
    while reached <= expected:
        n += 1
        reached -= math.log(uniform(seed, number, n))
    return float(n)


@jitted(**EXACT)
def cracks_in_a_piece(n, size, r):
    """Return how many cracks grow in a cubic piece of a ring with n active flaws (R17).

    Their mean over the pieces around the ring; no more than break it at the speed of
    sound.

    Parameters
    ----------
    n : float
    size : float
        Side of the ring's section [m].
    r : float
        Radius of the ring [m].
    """
    return min(n * size / (2.0 * math.pi * r), 1.0 / CRACK_SPEED)


@jitted(**EXACT)
def damage_of_flaws(damage, n, growth):
    """Return the damage after n cracks have grown (R17).

    ``d D^(1/3)/dt = n c_g/R``: the cube root is the length of the cracks over the
    piece's radius, and `growth` its rise for one crack.
    """
    return min(np.cbrt(damage) + n * growth, 1.0) ** 3


@jitted(**EXACT)
def _growth(P, S_rr, S_zz, S_rz, damage, G, c, m, r, rho, number, mat, dt):
    # Stresses of the sound share: the strain is theirs.
    sound = 1.0 - damage
    if sound <= 0.0:
        return 0.0
    shear = largest_deviatoric_stress(S_rr, S_zz, S_rz)
    tension = shear / sound - P
    if tension <= 0.0:
        return 0.0
    bulk = bulk_modulus(mat)
    young = 9.0 * bulk * G / (3.0 * bulk + G)
    if young <= 0.0:
        return 0.0
    flaws = mat.grady_kipp
    strain = tension / young
    expected = flaws.k * m / mat.rho0 * strain**flaws.m
    size = ring_size(m, r, rho)
    n = active_flaws(flaws.seed, number, expected)
    cracks = cracks_in_a_piece(n, size, r)
    growth = crack_growth(c, G, rho, PIECE_RADIUS * size, dt)
    return damage_of_flaws(damage, cracks, growth) - damage


@jitted(**ENTRY)
def _damage_growth(x, k, mat, excess, dt):
    # Without a branch here, no references to the arrays are counted.
    return _growth(
        x.P[k], x.S_rr[k], x.S_zz[k], x.S_rz[k], x.damage[k], x.G[k], x.c[k],
        x.m[k], x.r[k], x.rho[k], x.id[k], mat, dt,
    )  # fmt: skip


MODEL = Model(
    "grady-kipp",
    "Grady-Kipp",
    GradyKipp,
    {
        "sound_share": undamaged,
        "limit_tension": limit_by_damage,
        "damage_growth": _damage_growth,
    },
    ("damage",),
)
