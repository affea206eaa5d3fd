"""How a run stands: every command that says so says the same."""

import os
import subprocess
import sys

import pytest
from click.testing import CliRunner
from mpi4py import MPI
from small_runs import unended

from mpisph.cli.main import cli
from mpisph.io import lock
from mpisph.io.lock import LOCK_FILE, FolderLock
from mpisph.io.stored_run import read_run
from mpisph.study.store import look_up

# Another process that is rank 0 of a run until its input ends.
HOLDER = """
import sys
from pathlib import Path
from mpi4py import MPI
import mpisph.io.lock as lock

def none(*_):
    raise OSError(95, "Operation not supported")

if sys.argv[2] == "without locks":
    lock.fcntl.fcntl = none
with lock.FolderLock(MPI.COMM_SELF, Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def no_locks(*_):
    raise OSError(95, "Operation not supported")


@pytest.fixture(params=["locks", "without locks"])
def file_system(request, monkeypatch):
    """What locks there are."""
    if request.param == "without locks":
        monkeypatch.setattr(lock.fcntl, "fcntl", no_locks)
    return request.param


@pytest.fixture
def running(file_system, finished, tmp_path):
    """The folder of a run that another process is at work on, and that process."""
    folder = unended(tmp_path / "run", finished, state="running", reason=None)
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, folder, file_system],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "held\n"
    yield folder, process
    process.stdin.close()
    process.stdout.close()
    process.wait()


def said_of(folder):
    """What `mpisph status`, a report and a study say of a run."""
    line = CliRunner().invoke(cli, ["status", str(folder)]).output
    place = look_up(folder)
    return (
        line.removeprefix(f"{folder}: ").partition(",")[0],
        read_run(folder).state,
        (place.standing, place.reason),
    )


def test_a_live_run_is_running(running):
    folder, _ = running
    assert said_of(folder) == ("running", "running", ("running", ""))


def test_a_run_that_ended_its_process_was_killed(running, file_system, monkeypatch):
    folder, process = running
    process.kill()
    process.wait()
    if file_system == "without locks":
        # Not at once: its last sign of life is young.
        assert said_of(folder) == ("running", "running", ("running", ""))
        monkeypatch.setattr(lock, "SILENCE", 0.0)
    assert said_of(folder) == ("killed", "killed", ("stopped", "killed"))


def test_a_clock_that_is_wrong_does_not_keep_a_killed_run_alive(
    finished, tmp_path, monkeypatch
):
    monkeypatch.setattr(lock.fcntl, "fcntl", no_locks)
    folder = unended(tmp_path / "run", finished, state="running")
    (folder / LOCK_FILE).write_text("process 1 on another\n")
    for age in (-3600.0, 3600.0):
        then = (folder / "case.toml").stat().st_mtime - age
        os.utime(folder / LOCK_FILE, (then, then))
        assert said_of(folder) == ("killed", "killed", ("stopped", "killed"))


def test_a_run_that_is_resumed_is_running_from_the_first_moment(
    file_system, finished, tmp_path
):
    """Before it says so itself: it may have to compile first."""
    folder = unended(tmp_path / "run", finished, state="stopped", reason="file stop")
    said = ("stopped (file stop)", "stopped", ("stopped", "file stop"))
    assert said_of(folder) == said
    with FolderLock(MPI.COMM_SELF, folder):
        assert said_of(folder) == ("running", "running", ("running", ""))
    assert said_of(folder) == said


@pytest.mark.parametrize("state", ["completed", "unstable"])
def test_a_run_that_has_ended_stays_so(state, file_system, finished, tmp_path):
    """While it still draws its figures, too."""
    folder = unended(tmp_path / "run", finished, state=state)
    with FolderLock(MPI.COMM_SELF, folder):
        assert said_of(folder) == (state, state, (state, ""))


def test_where_there_is_no_run_it_is_to_be_made(file_system, tmp_path):
    said = CliRunner().invoke(cli, ["status", str(tmp_path)]).output
    assert said == f"{tmp_path}: no run\n"
    assert look_up(tmp_path).standing == "to do"
    with FolderLock(MPI.COMM_SELF, tmp_path):
        assert look_up(tmp_path).standing == "running"
