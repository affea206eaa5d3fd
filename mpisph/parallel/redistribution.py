"""Particles sent from rank to rank: to new owners, by id for files, or to one rank.

What is written to files goes by particle id, so that a file is the same whichever
ranks wrote it.
"""

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

import mpisph.core.jit  # noqa: F401  it sets Numba's cache folder before first use
from mpisph.core.particles import LABELS, VALUES, FloatArray, IntArray, Particles

RECORDS_TAG = 7302
"""Keeps particles on the move apart from messages of the caller's own."""


def block_starts(n_total: int, parts: int) -> IntArray:
    """Return where each of `parts` nearly equal blocks starts, and the end.

    Returns
    -------
    ndarray of int64, shape (parts + 1,)
        Block `k` holds the ids from element `k` up to element ``k + 1``.
    """
    return np.arange(parts + 1, dtype=np.int64) * n_total // parts


def by_id_blocks(comm: MPI.Intracomm, particles: Particles, n_total: int) -> Particles:
    """Redistribute particles to contiguous blocks of ids, sorted by id.

    Parameters
    ----------
    comm : MPI.Intracomm
    particles : Particles
        Owned particles in any order; any rank may own none.
    n_total : int
        Ids run from 0 to ``n_total - 1``. Particles may be missing.

    Returns
    -------
    Particles
        Those whose id lies in this rank's block (see `block_starts`).

    Raises
    ------
    ValueError
        On every rank, where any owned id lies outside the range.
    """
    outside = particles.n > 0 and not (
        0 <= particles.id.min() and particles.id.max() < n_total
    )
    if comm.allreduce(outside, MPI.LOR):
        msg = f"particle ids must lie between 0 and n_total - 1 = {n_total - 1}"
        raise ValueError(msg)
    starts = block_starts(n_total, comm.size)
    destination = np.searchsorted(starts[1:], particles.id, side="right")
    return _sorted_by_id(redistribute(comm, particles, destination))


def redistribute(
    comm: MPI.Intracomm, particles: Particles, destination: IntArray
) -> Particles:
    """Send each particle to the rank that `destination` names.

    Only particles that leave are packed, and only ranks with something to send or to
    receive exchange messages.

    Parameters
    ----------
    comm : MPI.Intracomm
    particles : Particles
        Owned particles.
    destination : ndarray of int64, shape (n,)
        Rank for each.

    Returns
    -------
    Particles
        Those that stay, then those received, ordered by the sending rank; `particles`
        itself where none left and none came.
    """
    leaving = np.flatnonzero(destination != comm.rank)
    leaving = leaving[np.argsort(destination[leaving], kind="stable")]
    send_counts = np.bincount(destination[leaving], minlength=comm.size)
    receive_counts = np.empty(comm.size, np.int64)
    comm.Alltoall(send_counts.astype(np.int64), receive_counts)
    if leaving.size == 0 and not receive_counts.any():
        return particles
    sent = _records(particles.take(leaving))
    received = _exchange_records(comm, sent, send_counts, receive_counts)
    stay = particles.take(np.flatnonzero(destination == comm.rank))
    return _joined(stay, _from_records(received))


def _exchange_records(
    comm: MPI.Intracomm, sent: FloatArray, send_counts: IntArray,
    receive_counts: IntArray,
) -> FloatArray:  # fmt: skip
    """Send the rows of `sent`, rank by rank; return those received, rank by rank."""
    received = _empty_records(int(receive_counts.sum()))
    requests = []
    with _RecordType() as record:
        for rows, counts, start in (
            (received, receive_counts, comm.Irecv),
            (sent, send_counts, comm.Isend),
        ):
            begins = _displacements(counts)
            for rank in np.flatnonzero(counts):
                some = rows[begins[rank] : begins[rank] + counts[rank]]
                message = [some, int(counts[rank]), record]
                requests.append(start(message, int(rank), RECORDS_TAG))
        MPI.Request.Waitall(requests)
    return received


def gather_all(
    comm: MPI.Intracomm, particles: Particles, root: int = 0
) -> Particles | None:
    """Gather the particles of all ranks on one, sorted by id.

    Parameters
    ----------
    comm : MPI.Intracomm
    particles : Particles
        Owned particles in any order; any rank may own none.
    root : int, optional

    Returns
    -------
    Particles or None
        All particles on `root`, None elsewhere.
    """
    counts = np.zeros(comm.size, np.int64)
    comm.Gather(np.array([particles.n], np.int64), counts, root)
    received = _empty_records(int(counts.sum()))
    with _RecordType() as record:
        comm.Gatherv(
            [_records(particles), particles.n, record],
            [received, (counts, _displacements(counts)), record],
            root,
        )
    return _sorted_by_id(_from_records(received)) if comm.rank == root else None


class _RecordType:
    """MPI datatype of one packed particle, freed on leaving the block.

    Counting particles rather than numbers keeps counts within MPI's 32 bits.
    """

    def __enter__(self) -> MPI.Datatype:
        self.datatype = MPI.DOUBLE.Create_contiguous(len(LABELS) + len(VALUES))
        return self.datatype.Commit()

    def __exit__(self, *_: object) -> None:
        self.datatype.Free()


def _empty_records(n: int) -> FloatArray:
    return np.empty((n, len(LABELS) + len(VALUES)))


def _records(particles: Particles) -> FloatArray:
    """Return one row per particle, shape (n, fields)."""
    return np.ascontiguousarray(particles.pack().T)


def _from_records(records: FloatArray) -> Particles:
    return Particles.unpack([np.ascontiguousarray(records.T)])


def _joined(first: Particles, second: Particles) -> Particles:
    return Particles(
        np.concatenate([first.labels, second.labels], axis=1),
        np.concatenate([first.values, second.values], axis=1),
    )


def _sorted_by_id(particles: Particles) -> Particles:
    return particles.take(np.argsort(particles.id, kind="stable"))


def _displacements(counts: npt.NDArray[np.int64]) -> IntArray:
    return np.cumsum(counts) - counts
