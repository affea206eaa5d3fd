"""Matter that has left the game: from then on it flies straight and costs nothing.

A bumper that the cloud has passed, and what flies back from an impact, act on nothing
that matters. Such particles are taken out of the step, between the drift and the next
evaluation of the rates: until then each pair has acted on both of its particles alike,
so mass, momentum and energy stay exactly what they were.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.core.particles import FloatArray, Particles

__all__ = ["Retirement", "has_left"]


class Retirement(NamedTuple):
    """When matter leaves the game, by body.

    Attributes
    ----------
    reach : ndarray, shape (bodies,)
        Axial position that matter must be able to come to [m].
    after : ndarray, shape (bodies,)
        Time from which that counts [s].
    horizon : float
        Time by which it must have come there, at its present velocity [s].
    """

    reach: FloatArray
    after: FloatArray
    horizon: float


def has_left(p: Particles, rule: Retirement, time: float) -> npt.NDArray[np.bool_]:
    """Return which particles have left the game.

    Each one is judged by itself, so the answer depends on no rank.

    Parameters
    ----------
    p : Particles
    rule : Retirement
    time : float
        Of their positions [s].
    """
    remaining = max(rule.horizon - time, 0.0)
    farthest = p.z + np.maximum(p.u_z, 0.0) * remaining
    left: npt.NDArray[np.bool_] = farthest < rule.reach[p.body]
    return left & (time >= rule.after[p.body])
