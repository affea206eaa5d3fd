"""Counters that all ranks share, in the memory of rank 0."""

from types import TracebackType
from typing import Any, Self

import numpy as np
from mpi4py import MPI


class SharedCounters:
    """Whole numbers that any rank reads and adds to, without the others' help.

    Entering and leaving are collective.

    Parameters
    ----------
    comm : MPI.Intracomm
    count : int
        How many numbers; all begin at zero.
    """

    def __init__(self, comm: MPI.Intracomm, count: int) -> None:
        self._comm = comm
        self._count = count

    def __enter__(self) -> Self:
        """Make the numbers."""
        size = 8 * self._count if self._comm.rank == 0 else 0
        self._window = MPI.Win.Allocate(size, 8, comm=self._comm)
        if self._comm.rank == 0:
            memory: Any = self._window.tomemory()
            self.here = np.frombuffer(memory, np.int64)
            self.here[:] = 0
        self._comm.Barrier()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Free them; where an error ends a rank, that ends all."""
        if error is None:
            self._comm.Barrier()
            if self._comm.rank == 0:
                del self.here
            self._window.Free()

    def add(self, index: int, amount: int = 1) -> int:
        """Add to a number and return what it was before.

        Parameters
        ----------
        index : int
        amount : int, optional
            Zero only reads.
        """
        before = np.zeros(1, np.int64)
        self._window.Lock(0)
        self._window.Fetch_and_op(
            np.array([amount], np.int64), before, 0, index, MPI.SUM
        )
        self._window.Unlock(0)
        return int(before[0])
