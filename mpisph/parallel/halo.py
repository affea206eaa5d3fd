"""Ghosts: copies of the particles of other ranks that a rank's particles reach.

Two particles interact within ``kappa (h_a + h_b)/2``. So around each particle stands a
box that reaches ``kappa h/2`` both ways along z and along r, and two particles can only
interact if their boxes meet. A rank tells the others the bounding box of all
these; another rank sends it those particles whose own box meets that. This
follows the local h, spans as many parts as the reach does, and needs no assumption on
where the cut lies.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import VALUE, FloatArray, IntArray
from mpisph.core.workspace import Workspace

BOX_SLACK = 1e-9
"""Widens boxes, in units of the reach, against rounding."""

TAG = 7301
"""Keeps ghosts apart from messages of the caller's own on the same communicator."""

NOTHING = np.array([np.inf, -np.inf, np.inf, -np.inf])
"""The bounding box of a rank without particles: it meets no box."""


@dataclass
class Traffic:
    """What this rank has sent to other ranks in exchanges of the halo.

    Attributes
    ----------
    messages : int
    ghosts : int
        Particles, each counted once a rank that it went to.
    bytes : int
    """

    messages: int = 0
    ghosts: int = 0
    bytes: int = 0


class Halo:
    """What lasts from one exchange to the next: buffers and the count of the traffic.

    Attributes
    ----------
    traffic : Traffic
    workspace : Workspace
    """

    def __init__(self) -> None:
        self.traffic = Traffic()
        self.workspace = Workspace()


def boxes(
    r: FloatArray, z: FloatArray, reach_r: FloatArray, reach_z: FloatArray
) -> FloatArray:
    """Return boxes around particles.

    Parameters
    ----------
    r, z : ndarray, shape (n,)
        Positions [m].
    reach_r, reach_z : ndarray, shape (n,)
        How far the box stands out on either side [m].

    Returns
    -------
    ndarray, shape (4, n)
        Lower and upper z, lower and upper r [m].
    """
    return np.array([z - reach_z, z + reach_z, r - reach_r, r + reach_r])


def reach(h: FloatArray, kappa: float) -> FloatArray:
    """Return how far a particle of smoothing length `h` [m] reaches, ``kappa h/2``."""
    return (0.5 * kappa * (1.0 + BOX_SLACK)) * h


@jitted(**EXACT)
def bounding_box(
    values: FloatArray, kappa: float, dt: float, kick: float = 0.5
) -> FloatArray:
    """Return the box that holds those of the owned particles after a step.

    A particle that the step carries across the axis is put back at the same distance
    from it, which lies within its drift as well.

    Parameters
    ----------
    values : ndarray
        Of `Particles`.
    kappa : float
        Cut of the kernel.
    dt : float
        Upper bound of the coming step [s].
    kick : float, optional
        Part of it by which velocities advance before the positions do.

    Returns
    -------
    ndarray, shape (4,)
        As `boxes`; infinite and reversed where the rank owns nothing.
    """
    r, z, h, dh = values[VALUE.r], values[VALUE.z], values[VALUE.h], values[VALUE.dh]
    u_r, u_z = values[VALUE.u_r], values[VALUE.u_z]
    du_r, du_z = values[VALUE.du_r], values[VALUE.du_z]
    reach_h = 0.5 * kappa * (1.0 + BOX_SLACK)
    box = NOTHING.copy()
    for i in range(r.size):
        half = reach_h * (h[i] + dt * abs(dh[i]))
        along_r = half + dt * (abs(u_r[i]) + kick * dt * abs(du_r[i]))
        along_z = half + dt * (abs(u_z[i]) + kick * dt * abs(du_z[i]))
        box[0] = min(box[0], z[i] - along_z)
        box[1] = max(box[1], z[i] + along_z)
        box[2] = min(box[2], r[i] - along_r)
        box[3] = max(box[3], r[i] + along_r)
    return box


def hull(these: FloatArray) -> FloatArray:
    """Return the smallest box, shape (4,), that holds `these`, shape (4, n > 0)."""
    z_low, z_high, r_low, r_high = these
    return np.array([z_low.min(), z_high.max(), r_low.min(), r_high.max()])


def partners_of(rank: int, rank_boxes: FloatArray) -> IntArray:
    """Return the ranks whose bounding boxes meet that of `rank`, ascending.

    Parameters
    ----------
    rank : int
    rank_boxes : ndarray, shape (ranks, 4)
        `bounding_box` of every rank.
    """
    partners: IntArray = _partners_of(rank, rank_boxes)
    return partners


@jitted(**EXACT)
def _partners_of(rank: int, rank_boxes: FloatArray) -> IntArray:
    found = np.empty(rank_boxes.shape[0], np.int64)
    n = 0
    for other in range(rank_boxes.shape[0]):
        found[n] = other
        n += other != rank and _meets(rank_boxes.T, other, rank_boxes[rank])
    return found[:n]


@jitted(**EXACT)
def _meets(these: FloatArray, i: int, other: FloatArray) -> bool:
    along_z = (these[0, i] < other[1]) & (these[1, i] > other[0])
    return bool(along_z & (these[2, i] < other[3]) & (these[3, i] > other[2]))


@jitted(**EXACT)
def select(
    these: FloatArray, rank_boxes: FloatArray
) -> tuple[IntArray, npt.NDArray[np.int64]]:
    """Find for each bounding box the particles whose boxes meet it.

    Parameters
    ----------
    these : ndarray, shape (4, n)
        Boxes of particles.
    rank_boxes : ndarray, shape (k, 4)

    Returns
    -------
    start : ndarray of int64, shape (k + 1,)
        Where the list of each box begins in `index`.
    index : ndarray of int64
        Positions of the particles, ascending for each box.
    """
    start = np.zeros(rank_boxes.shape[0] + 1, np.int64)
    for k in range(rank_boxes.shape[0]):
        found = 0
        for i in range(these.shape[1]):
            found += _meets(these, i, rank_boxes[k])
        start[k + 1] = start[k] + found
    index = np.empty(start[-1], np.int64)
    for k in range(rank_boxes.shape[0]):
        place = start[k]
        for i in range(these.shape[1]):
            if _meets(these, i, rank_boxes[k]):
                index[place] = i
                place += 1
    return start, index


def exchange_halo(
    comm: MPI.Intracomm, fields: FloatArray, these: FloatArray, rank_boxes: FloatArray,
    halo: Halo,
) -> FloatArray:  # fmt: skip
    """Send each rank the particles it needs, return the ghosts received.

    Parameters
    ----------
    comm : MPI.Intracomm
    fields : ndarray, shape (k, n)
        What is sent of the owned particles.
    these : ndarray, shape (4, n)
        Their `boxes` of `reach`.
    rank_boxes : ndarray, shape (ranks, 4)
        `bounding_box` of every rank.
    halo : Halo
        Of earlier exchanges.

    Returns
    -------
    ndarray, shape (k, ghosts)
        Ordered by rank; the order carries no meaning.
    """
    partners = partners_of(comm.rank, rank_boxes)
    start, index = select(these, rank_boxes[partners])
    if partners.size == 0:
        return fields[:, :0]
    k = fields.shape[0]
    packed = halo.workspace.room("sent", k * index.size)
    requests = []
    for rank, (begin, end) in zip(partners, pairwise(start), strict=True):
        message = packed[k * begin : k * end].reshape(k, end - begin)
        # Not the default mode, which would copy once more; no index is out of range.
        np.take(fields, index[begin:end], axis=1, out=message, mode="clip")
        requests.append(comm.Isend(message, dest=int(rank), tag=TAG))
    halo.traffic.messages += partners.size
    halo.traffic.ghosts += index.size
    halo.traffic.bytes += packed.nbytes
    received = _receive(comm, partners, k, halo)
    MPI.Request.Waitall(requests)
    return np.concatenate([fields[:, :0], *received], axis=1)


def _receive(
    comm: MPI.Intracomm, partners: IntArray, k: int, halo: Halo
) -> list[FloatArray]:
    """Receive the ghosts that each partner has sent, however many they are."""
    status = MPI.Status()
    ends = [0]
    for rank in partners:
        comm.Probe(source=int(rank), tag=TAG, status=status)
        ends.append(ends[-1] + status.Get_count(MPI.DOUBLE))
    buffer = halo.workspace.room("received", ends[-1])
    received = [buffer[begin:end].reshape(k, -1) for begin, end in pairwise(ends)]
    for rank, ghosts in zip(partners, received, strict=True):
        comm.Recv(ghosts, source=int(rank), tag=TAG)
    return received
