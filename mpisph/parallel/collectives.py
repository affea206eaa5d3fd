"""Results and errors that all ranks share, so that none waits for another for ever."""

import errno
from collections.abc import Callable
from typing import TypeVar

from mpi4py import MPI

import mpisph.core.jit  # noqa: F401  it sets Numba's cache folder before first use
from mpisph.core.errors import CollectiveError, MpisphError, os_error_text

T = TypeVar("T")


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
