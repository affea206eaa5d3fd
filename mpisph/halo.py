"""Ghosts: copies of the particles of other ranks that a rank's particles reach.

Two particles interact within ``kappa (h_a + h_b)/2``. So each particle claims the
axial interval ``z +- kappa h/2``, and two particles can only interact if their
intervals meet. A rank publishes the union of its claims, `lower` and `upper`; another
rank sends it those particles whose own claim meets that. This is as little as the
axial distance allows, follows the local h, spans as many slabs as the reach does, and
needs no assumption on slab widths.
"""

import numpy as np
from mpi4py import MPI

from mpisph.particles import FloatArray, Particles

SLACK = 1e-9
"""Widens claims, in units of the reach, against rounding."""

TAG = 7301
"""Keeps ghosts apart from messages of the caller's own on the same communicator."""


def claim(p: Particles, kappa: float, dt: float) -> tuple[float, float]:
    """Return the union of the owned particles' claims after a step of at most `dt`.

    Parameters
    ----------
    p : Particles
    kappa : float
        Cut of the kernel.
    dt : float
        Upper bound of the coming step [s].

    Returns
    -------
    lower, upper : float
        Axial interval [m]; infinite and reversed where the rank owns nothing.
    """
    if p.n == 0:
        return np.inf, -np.inf
    drift = dt * (np.abs(p.u_z) + 0.5 * dt * np.abs(p.du_z))
    reach = 0.5 * kappa * (p.h + dt * np.abs(p.dh)) * (1.0 + SLACK) + drift
    return float((p.z - reach).min()), float((p.z + reach).max())


def exchange_halo(
    comm: MPI.Intracomm, fields: FloatArray, z: FloatArray, h: FloatArray,
    claims: FloatArray, kappa: float,
) -> FloatArray:  # fmt: skip
    """Send each rank the particles it needs, return the ghosts received.

    Parameters
    ----------
    comm : MPI.Intracomm
    fields : ndarray, shape (k, n)
        What is sent of the owned particles.
    z, h : ndarray, shape (n,)
        Their axial positions and smoothing lengths [m].
    claims : ndarray, shape (ranks, 2)
        `claim` of every rank.
    kappa : float
        Cut of the kernel.

    Returns
    -------
    ndarray, shape (k, ghosts)
        Ordered by rank; the order carries no meaning.
    """
    lower, upper = claims[comm.rank]
    meets = (claims[:, 0] < upper) & (claims[:, 1] > lower)
    meets[comm.rank] = False
    partners = np.flatnonzero(meets)
    reach = 0.5 * kappa * h * (1.0 + SLACK)
    low, high = z - reach, z + reach
    requests = []
    for rank in partners:
        wanted = np.flatnonzero((low < claims[rank, 1]) & (high > claims[rank, 0]))
        ghosts = np.take(fields, wanted, axis=1)
        requests.append(comm.Isend(ghosts, dest=int(rank), tag=TAG))
    received = [_receive(comm, int(rank), fields.shape[0]) for rank in partners]
    MPI.Request.Waitall(requests)
    return np.concatenate([fields[:, :0], *received], axis=1)


def _receive(comm: MPI.Intracomm, rank: int, k: int) -> FloatArray:
    """Receive the ghosts that a rank has sent, however many they are."""
    status = MPI.Status()
    comm.Probe(source=rank, tag=TAG, status=status)
    ghosts = np.empty((k, status.Get_count(MPI.DOUBLE) // k))
    comm.Recv(ghosts, source=rank, tag=TAG)
    return ghosts
