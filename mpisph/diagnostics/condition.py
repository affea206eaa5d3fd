"""The condition of each body's matter: what is molten and broken, and how it moves.

The sums have the same bits on any number of ranks.
"""

from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.core.particles import Particles
from mpisph.diagnostics.series import ROOM, Scales
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
    momentum_z : float
        Axial momentum [kg m/s].
    kinetic_energy, internal_energy : float
        [J].
    """

    mass: float
    molten: float
    broken: float
    momentum_z: float
    kinetic_energy: float
    internal_energy: float


def measure_condition(
    comm: MPI.Intracomm, p: Particles, bodies: int, scales: Scales
) -> list[Condition]:
    """Measure the condition of every body; collective.

    Parameters
    ----------
    comm : MPI.Intracomm
    p : Particles
        Owned particles.
    bodies : int
        Their number.
    scales : Scales
        Of the run.

    Returns
    -------
    list of Condition
        NaN in place of the shares of a body without particles.
    """
    kinetic = 0.5 * p.m * (p.u_r * p.u_r + p.u_z * p.u_z)
    parts = [p.m * p.melt, p.m * (p.damage >= BROKEN)]
    terms = np.stack([p.m, *parts, p.m * p.u_z, kinetic, p.m * p.E])
    m, room = scales.mass, scales.mass * ROOM
    momentum, energy = room * scales.speed, room * scales.energy
    bounds = np.array([m, m, m, momentum, energy, energy])
    sums = np.stack(
        [
            fixed_point_chunks(np.ascontiguousarray(terms[:, p.body == body]), bounds)
            for body in range(bodies)
        ]
    )
    comm.Allreduce(MPI.IN_PLACE, sums, MPI.SUM)
    found = []
    for of_body in sums:
        mass, molten, broken, *motion = map(float, from_chunks(of_body, bounds))
        shares = (x / mass if mass else np.nan for x in (molten, broken))
        found.append(Condition(mass, *shares, *motion))
    return found
