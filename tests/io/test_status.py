"""What status.json says."""

import json
import os

import pytest
from mpi4py import MPI

from mpisph.core.errors import CollectiveError, MpisphError
from mpisph.io.status import STATUS_FILE, StatusFile, read_status
from mpisph.parallel.collectives import on_root

SELF = MPI.COMM_SELF


def test_it_holds_state_reason_step_time_host_and_ranks(tmp_path):
    status = StatusFile(SELF, tmp_path, 6e-6, starts=3)
    status.write("stopped", 12, 1.5e-6, "signal SIGTERM")
    got = json.loads((tmp_path / STATUS_FILE).read_text())
    assert got.pop("started") <= got.pop("updated")
    assert got == {
        "state": "stopped",
        "reason": "signal SIGTERM",
        "step": 12,
        "time": 1.5e-6,
        "end_time": 6e-6,
        "starts": 3,
        "ranks": 1,
        "host": os.uname().nodename,
        "pid": os.getpid(),
    }
    assert read_status(tmp_path).time == 1.5e-6


def test_no_run_has_no_status(tmp_path):
    assert read_status(tmp_path) is None


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"state": "flying"}'])
def test_what_is_no_status_is_an_error(tmp_path, text):
    (tmp_path / STATUS_FILE).write_text(text)
    with pytest.raises(MpisphError, match="not the status of a run"):
        read_status(tmp_path)


def test_a_failure_keeps_step_and_time(tmp_path):
    status = StatusFile(SELF, tmp_path, 6e-6, starts=1)
    status.write("running", 12, 1.5e-6)
    status.refresh(15, 1.8e-6)
    status.fail("rank 1 of 2: broken")
    got = read_status(tmp_path)
    assert (got.state, got.reason) == ("failed", "rank 1 of 2: broken")
    assert (got.step, got.time) == (15, 1.8e-6)


@pytest.mark.parametrize("state", ["completed", "unstable"])
def test_a_run_that_has_ended_does_not_fail_afterwards(tmp_path, state):
    """A rank may still die while checkpoints are removed or figures are drawn."""
    status = StatusFile(SELF, tmp_path, 6e-6, starts=1)
    status.write(state, 12, 6e-6)
    before = (tmp_path / STATUS_FILE).read_text()
    status.fail("rank 1 of 2 has died")
    assert (tmp_path / STATUS_FILE).read_text() == before


def test_only_what_must_be_written_raises(tmp_path):
    status = StatusFile(SELF, tmp_path / "gone", 6e-6, starts=1)
    status.refresh(1, 1e-9)
    status.fail("broken")
    with pytest.raises(CollectiveError, match="No such file"):
        status.write("running", 1, 1e-9)


@pytest.mark.mpi(min_size=2)
def test_it_is_that_of_rank_0(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    StatusFile(comm, mpi_tmp_path, 6e-6, starts=1).write("running", comm.rank, 0.0)
    pid = comm.bcast(os.getpid())

    def check():
        got = read_status(mpi_tmp_path)
        assert (got.step, got.pid, got.ranks) == (0, pid, comm.size)

    on_root(comm, check)
