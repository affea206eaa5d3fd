"""Collective operations whose results do not depend on the number of ranks.

A floating-point sum depends on the order of its terms, and the order depends
on which rank owns which particle. Here the terms become integers first, and
integer sums have no order. What is written to files goes by particle id, so
that a file is the same whichever ranks wrote it.
"""

import errno
import math
from collections.abc import Callable
from functools import lru_cache
from typing import TypeVar

import numpy as np
import numpy.typing as npt
from mpi4py import MPI
from numba import njit

import mpisph.core.jit  # noqa: F401  it sets Numba's cache folder before first use
from mpisph.core.errors import CollectiveError, MpisphError, os_error_text
from mpisph.core.particles import LABELS, VALUES, FloatArray, IntArray, Particles

T = TypeVar("T")

CHUNKS = 4
"""Columns of `fixed_point_chunks`: three chunks, and a count of bad values."""

RECORDS_TAG = 7302
"""Keeps particles on the move apart from messages of the caller's own."""

_BITS = 34
# Bits of one chunk. A chunk is below 2^34, so that int64 holds the sum of up to
# 2^29 particles.

_SMALLEST_EXPONENT = -900
# The scale 2^(34 - exponent) must stay a finite float64.


def fixed_point_chunks(rows: FloatArray, bounds: FloatArray) -> IntArray:
    """Return this rank's part of sums over all ranks, to be added up as integers.

    `from_chunks` of the added-up parts is the sum, with the same bits on any number of
    ranks. Values down to ``2**-49`` of their bound are summed exactly, so the result
    is then the correctly rounded sum. What lies below ``2**-102`` of the bound is cut
    off: the error of `n` values is less than ``n * 2**-102 * bound``, which is 3e-23 of
    the bound for ``2**27`` values.

    Parameters
    ----------
    rows : ndarray of float64, shape (k, n)
        Values of the owned particles; `n` may differ between ranks. At most
        ``2**29`` values a row over all ranks.
    bounds : ndarray of float64, shape (k,)
        A bound on the magnitude of every value of a row, equal on all ranks.
        It may be loose.

    Returns
    -------
    ndarray of int64, shape (k, CHUNKS)
        Sums of the high, middle and low chunks, and the number of values that
        are NaN or larger than their bound.
    """
    assert len(rows) == len(bounds), "one bound a row"
    scales = np.array([math.ldexp(1.0, _BITS - _exponent(b)) for b in bounds])
    chunks: IntArray = _sum_chunks(rows, np.asarray(bounds, np.float64), scales)
    return chunks


def from_chunks(total: IntArray, bounds: FloatArray) -> FloatArray:
    """Return the sums that added-up chunks stand for, correctly rounded.

    Parameters
    ----------
    total : ndarray of int64, shape (k, CHUNKS)
        Sum over all ranks of what `fixed_point_chunks` returned.
    bounds : ndarray of float64, shape (k,)
        The bounds that were given to it.

    Returns
    -------
    ndarray of float64, shape (k,)
        NaN where a value is NaN or larger than its bound, or where the bound is not
        finite.
    """
    sums = np.full(len(bounds), math.nan)
    for row, bound in enumerate(bounds):
        high, middle, low, bad = (int(chunk) for chunk in total[row])
        if bad == 0 and math.isfinite(bound):
            # Python integers are exact, and float() of one rounds correctly.
            fixed_point = (high << 2 * _BITS) + (middle << _BITS) + low
            sums[row] = math.ldexp(float(fixed_point), _exponent(bound) - 3 * _BITS)
    return sums


@lru_cache(maxsize=64)
def _exponent(bound: float) -> int:
    """Return the power of two above `bound`, within what the scale can hold."""
    if not math.isfinite(bound):
        return 0
    return max(math.frexp(bound)[1], _SMALLEST_EXPONENT)


@njit(cache=True, error_model="numpy")  # type: ignore[untyped-decorator]
def _sum_chunks(rows: FloatArray, bounds: FloatArray, scales: FloatArray) -> IntArray:
    """Split each value into three 34-bit integers and sum them.

    The scale is a power of two and a fraction is exact, so nothing is rounded;
    only what is below the last chunk is cut off.
    """
    chunk = 17179869184.0  # 2^34
    total = np.zeros((rows.shape[0], 4), np.int64)
    for row in range(rows.shape[0]):
        values, bound, scale = rows[row], bounds[row], scales[row]
        high = middle = low = good = np.int64(0)
        for i in range(values.size):  # without a branch, so that it vectorises
            inside = abs(values[i]) <= bound  # false for NaN as well
            scaled = (values[i] if inside else 0.0) * scale
            first = np.int64(scaled)
            scaled = (scaled - first) * chunk
            second = np.int64(scaled)
            high += first
            middle += second
            low += np.int64((scaled - second) * chunk)
            good += np.int64(inside)
        total[row] = high, middle, low, values.size - good
    return total


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


def raise_together(comm: MPI.Intracomm, error: Exception | None) -> None:
    """Raise on every rank if any rank met an error, so that none waits for ever.

    Parameters
    ----------
    comm : MPI.Intracomm
    error : Exception or None
        What this rank met.

    Raises
    ------
    CollectiveError
        On all ranks, with the number and text of the lowest failing rank's OSError;
        chained to this rank's own where it has one.
    MpisphError
        On all ranks, the lowest failing rank's own.
    RuntimeError
        On all ranks, with the text of any other error.
    """
    failing = comm.allreduce(comm.size if error is None else comm.rank, MPI.MIN)
    if failing == comm.size:
        return
    where = f"(rank {failing} of {comm.size})"
    raise comm.bcast(error and _shared(error, where), root=failing) from error


def on_root(comm: MPI.Intracomm, action: Callable[[], object]) -> None:
    """Do something on rank 0 and wait for it on all.

    Parameters
    ----------
    comm : MPI.Intracomm
    action : callable
        Called without arguments on rank 0; its result is dropped.

    Raises
    ------
    CollectiveError, MpisphError, RuntimeError
        On all ranks, if the action failed; see `raise_together`.
    """
    raise_together(comm, caught(action) if comm.rank == 0 else None)


def from_root(comm: MPI.Intracomm, action: Callable[[], T]) -> T:
    """Do something on rank 0 and hand its result, or its error, to all ranks.

    Parameters
    ----------
    comm : MPI.Intracomm
    action : callable
        Called without arguments on rank 0.

    Raises
    ------
    CollectiveError, MpisphError, RuntimeError
        On all ranks, if the action failed; see `raise_together`.
    """
    results: list[T] = []
    on_root(comm, lambda: results.append(action()))
    results = comm.bcast(results)
    return results[0]


def caught(action: Callable[[], object]) -> Exception | None:
    """Do something and return the error it met instead of raising it.

    Parameters
    ----------
    action : callable
        Called without arguments; its result is dropped.

    Returns
    -------
    Exception or None
        A RuntimeError becomes an OSError: h5py reports some failures of the file
        system as the former.
    """
    try:
        action()
    except RuntimeError as error:
        return OSError(errno.EIO, str(error))
    except Exception as error:  # raised again on all ranks
        return error
    return None


def _shared(error: Exception, where: str) -> Exception:
    """Return the error that all ranks raise for one that a single rank met."""
    if isinstance(error, MpisphError):
        return error
    if not isinstance(error, OSError):
        return RuntimeError(f"{type(error).__name__}: {error} {where}")
    return CollectiveError(error.errno or errno.EIO, f"{os_error_text(error)} {where}")


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
