"""The oracle of a sum is math.fsum, which is exact; it never meets the module."""

import errno

import pytest
from mpi4py import MPI

from mpisph.core.errors import CollectiveError
from mpisph.parallel.collectives import caught, on_root, raise_together

SELF = MPI.COMM_SELF


def test_caught_turns_runtime_errors_into_os_errors():
    def broken():
        raise RuntimeError("unable to close file")

    error = caught(broken)
    assert isinstance(error, OSError)
    assert "unable to close" in str(error)
    assert caught(lambda: 1) is None
    with pytest.raises(KeyError):
        raise caught(lambda: {}[1])


def test_an_error_names_the_file_and_keeps_its_number(tmp_path):
    with pytest.raises(
        CollectiveError, match=r"missing\.txt \(rank 0 of 1\)"
    ) as raised:
        on_root(SELF, (tmp_path / "missing.txt").read_text)
    assert raised.value.errno == errno.ENOENT


@pytest.mark.mpi(min_size=2)
def test_any_error_of_rank_0_is_raised_on_all():
    with pytest.raises(RuntimeError, match="ValueError: not so"):
        on_root(MPI.COMM_WORLD, _refuse)


def _refuse():
    raise ValueError("not so")


@pytest.mark.mpi(min_size=2)
def test_an_error_on_one_rank_is_raised_on_all():
    comm = MPI.COMM_WORLD
    mine = OSError(errno.ENOSPC, "disk full", "a.h5") if comm.rank == 1 else None
    with pytest.raises(OSError, match=r"disk full: a\.h5") as caught_error:
        raise_together(comm, mine)
    assert caught_error.value.errno == errno.ENOSPC
    raise_together(comm, None)


@pytest.mark.mpi(min_size=2)
def test_on_root_acts_on_rank_0_only():
    comm = MPI.COMM_WORLD
    calls = []
    on_root(comm, lambda: calls.append(comm.rank))
    assert calls == [0] * (comm.rank == 0)
