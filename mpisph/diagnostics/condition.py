"""The condition of each body's matter: how much of it is molten, and how much broken.

The sums have the same bits on any number of ranks.
"""

from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.core.particles import Particles
from mpisph.parallel.reproducible_sum import fixed_point_chunks, from_chunks

BROKEN = 1.0
"""Damage of matter that bears neither tension nor shear."""


class Condition(NamedTuple):
    """What the matter of a body is like.

    Attributes
    ----------
    mass : float
        [kg].
    molten : float
        Share of the mass that is molten.
    broken : float
        Share of the mass that is `BROKEN`.
    """

    mass: float
    molten: float
    broken: float


def measure_condition(
    comm: MPI.Intracomm, p: Particles, bodies: int, heaviest: float
) -> list[Condition]:
    """Measure the condition of every body; collective.

    Parameters
    ----------
    comm : MPI.Intracomm
    p : Particles
        Owned particles.
    bodies : int
        Their number.
    heaviest : float
        Mass that no particle exceeds [kg].

    Returns
    -------
    list of Condition
        NaN in place of the shares of a body without particles.
    """
    terms = np.stack([p.m, p.m * p.melt, p.m * (p.damage >= BROKEN)])
    bounds = np.full(len(terms), heaviest)
    sums = np.stack(
        [
            fixed_point_chunks(np.ascontiguousarray(terms[:, p.body == body]), bounds)
            for body in range(bodies)
        ]
    )
    comm.Allreduce(MPI.IN_PLACE, sums, MPI.SUM)
    found = []
    for of_body in sums:
        mass, *parts = (float(x) for x in from_chunks(of_body, bounds))
        found.append(Condition(mass, *(x / mass if mass else np.nan for x in parts)))
    return found
