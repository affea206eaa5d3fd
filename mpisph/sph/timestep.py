"""The stable time step (R11).

Each limit is scaled by the Courant factor, so that halving it halves every step.
"""

import math
from typing import NamedTuple

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitable, jitted
from mpisph.core.particles import LABEL, VALUE
from mpisph.physics.heat import diffusivity

VISCOUS_SHARE = 0.6
"""Share of the viscous signal speed in the Courant limit (Monaghan 1989, J. Comp.
Phys. 82, 1-15)."""

STRAIN_SHARE = 0.3
"""Share of its volume by which a particle may change within a limit. Cold matter has no
other: a ball that expands freely to twice its size is then right to 1 % of its density,
with a share of 1 to 45 %."""


@jitted(**EXACT)
def signal_limit(h, c, rho, G, damping):
    """Return the Courant limit of longitudinal waves and viscosity (R11) [s]."""
    longitudinal = np.sqrt(c * c + 4.0 * G / (3.0 * rho))
    return h / (longitudinal + VISCOUS_SHARE * damping)


@jitted(**EXACT)
def heat_limit(h, zeta, crowding):
    """Return the limit of artificial heat (R11) [s]."""
    rate = 4.0 * zeta * crowding
    return h * h / rate if rate > 0.0 else np.inf


@jitted(**EXACT)
def force_limit(h, du_r, du_z):
    """Return the time in which the acceleration moves a particle by h (R11) [s]."""
    acceleration = np.sqrt(du_r * du_r + du_z * du_z)
    return np.sqrt(h / acceleration) if acceleration > 0.0 else np.inf


@jitted(**EXACT)
def strain_limit(div):
    """Return the time in which the volume changes by a share of its size (R11) [s]."""
    return STRAIN_SHARE / abs(div) if div != 0.0 else np.inf


@jitted(**EXACT)
def smoothing_limit(h, dh):
    """Return the time in which h changes by its own size (R11) [s]."""
    return h / abs(dh) if dh != 0.0 else np.inf


@jitted(**EXACT)
def local_limit(labels, values, scheme):
    """Return the smallest limit among the owned particles, without Courant factor.

    Parameters
    ----------
    labels, values : ndarray
        Of `Particles`.
    scheme : SchemeConstants

    Returns
    -------
    limit : float
        Infinite where the rank owns no particle [s].
    where : int
        Index of the particle that sets it, of several the one of smallest id; -1 for
        none.
    """
    ids, h, dh = labels[LABEL.id], values[VALUE.h], values[VALUE.dh]
    c, rho, G = values[VALUE.c], values[VALUE.rho], values[VALUE.G]
    div, damping = values[VALUE.div], values[VALUE.damping]
    crowding = values[VALUE.crowding]
    du_r, du_z = values[VALUE.du_r], values[VALUE.du_z]
    limits = np.empty(h.size)
    for i in range(h.size):  # choices, not branches, so that it vectorises
        zeta = diffusivity(scheme.g1, scheme.g2, h[i], c[i], div[i])
        limit = signal_limit(h[i], c[i], rho[i], G[i], damping[i])
        limit = _smaller(heat_limit(h[i], zeta, crowding[i]), limit)
        limit = _smaller(force_limit(h[i], du_r[i], du_z[i]), limit)
        limit = _smaller(strain_limit(div[i]), limit)
        limits[i] = _smaller(smoothing_limit(h[i], dh[i]), limit)
    smallest = np.inf
    where = -1
    for i in range(h.size):
        tie = limits[i] == smallest and where >= 0 and ids[i] < ids[where]
        if limits[i] < smallest or tie:
            smallest = limits[i]
            where = i
    return smallest, where


@jitted(**EXACT)
def _smaller(a, b):
    return a if a < b else b


class StepRule(NamedTuple):
    """How the length of a step follows from the limits.

    Attributes
    ----------
    fixed : bool
        Whether every step is `longest`, whatever the limits.
    longest : float
        The fixed step, or a cap, may be infinite [s].
    courant : float
        Courant factor of an automatic step.
    kick : float
        Part of a step by which velocities advance before the positions do: half of it,
        or with first-order stepping all.
    """

    fixed: bool
    longest: float
    courant: float
    kick: float = 0.5


@jitable
def allowed_step(rule: StepRule, limit: float) -> float:
    """Return the step for the smallest `limit` [s] among some particles."""
    return rule.longest if rule.fixed else min(rule.courant * limit, rule.longest)


def step_to(remaining: float, dt: float) -> float:
    """Return `dt`, shortened so that `remaining` [s] is met without a tiny last step.

    Within two steps of the target the rest is split into equal steps.
    """
    steps = max(math.ceil(remaining / dt * (1.0 - 1e-12)), 1)
    return remaining / steps if steps <= 2 else dt
