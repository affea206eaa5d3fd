"""One run a folder."""

import os
import subprocess
import sys
import threading
import time

import pytest
from mpi4py import MPI
from oracles import agree

import mpisph.io.lock
from mpisph.core.errors import MpisphError
from mpisph.io.lock import LOCK_FILE, FolderLock, InUseError, in_use

SELF = MPI.COMM_SELF

# Another process that holds one rank's share of the lock until its input ends.
HOLDER = """
import fcntl, os, sys
from mpisph.io.lock import _locked
file = os.open(sys.argv[1], os.O_RDWR | os.O_CREAT)
assert _locked(file, fcntl.F_RDLCK)
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, tmp_path / LOCK_FILE],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.stdin.close()
    process.stdout.close()
    process.wait()


def test_a_folder_in_use_is_refused(tmp_path, holder, monkeypatch):
    monkeypatch.setattr(mpisph.io.lock, "PATIENCE", 0.1)
    assert in_use(tmp_path)
    with (
        pytest.raises(MpisphError, match="another run is at work here"),
        FolderLock(SELF, tmp_path),
    ):
        pass


def test_a_run_that_was_killed_leaves_no_lock(tmp_path, holder):
    holder.kill()
    with FolderLock(SELF, tmp_path):
        pass


def test_the_lock_names_its_process_and_ends_with_the_block(tmp_path):
    with FolderLock(SELF, tmp_path):
        assert in_use(tmp_path)
        assert f"process {os.getpid()} on" in (tmp_path / LOCK_FILE).read_text()
    assert not in_use(tmp_path)
    assert not in_use(tmp_path / "nowhere")


def test_looking_takes_no_lock(tmp_path, monkeypatch):
    """Looks at the same moment cannot collide, nor refuse a run that starts."""
    with FolderLock(SELF, tmp_path):
        pass
    calls = []
    real = mpisph.io.lock._lock_call
    monkeypatch.setattr(
        mpisph.io.lock,
        "_lock_call",
        lambda file, command, kind: calls.append(command) or real(file, command, kind),
    )
    assert not in_use(tmp_path)
    assert calls == ["F_OFD_GETLK"]


def test_a_run_starts_at_once_beside_those_who_look(tmp_path, monkeypatch):
    """Whatever a looker has done before it closes the file, nothing is held."""
    (tmp_path / LOCK_FILE).touch()
    monkeypatch.setattr(mpisph.io.lock, "PATIENCE", 0.0)
    close, met = os.close, []

    def start_before_closing(file):
        monkeypatch.setattr(mpisph.io.lock.os, "close", close)
        with FolderLock(SELF, tmp_path):
            met.append(file)
        close(file)

    monkeypatch.setattr(mpisph.io.lock.os, "close", start_before_closing)
    assert not in_use(tmp_path)
    assert met


def test_who_may_only_read_sees_the_lock(tmp_path, holder, monkeypatch):
    """And needs no more than that: the folder may be of another user."""
    opened, flags = os.open, []
    monkeypatch.setattr(
        mpisph.io.lock.os, "open", lambda p, f: flags.append(f) or opened(p, f)
    )
    assert in_use(tmp_path)
    assert flags[0] & os.O_ACCMODE == os.O_RDONLY


def test_a_pipe_in_place_of_the_lock_does_not_block(tmp_path):
    os.mkfifo(tmp_path / LOCK_FILE)
    assert not in_use(tmp_path)


def test_an_error_in_the_block_ends_the_lock(tmp_path):
    with pytest.raises(ZeroDivisionError), FolderLock(SELF, tmp_path):
        raise ZeroDivisionError
    assert not in_use(tmp_path)


@pytest.fixture
def no_locks(monkeypatch):
    """A file system that has none, and short waits."""

    def none(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(mpisph.io.lock.fcntl, "fcntl", none)
    for name, seconds in (("BEAT", 0.1), ("SILENCE", 0.8), ("SETTLE", 0.2)):
        monkeypatch.setattr(mpisph.io.lock, name, seconds)


def test_a_file_system_without_locks_is_no_hindrance(no_locks, tmp_path):
    for _ in range(2):
        said = []
        with FolderLock(SELF, tmp_path, said.append):
            assert in_use(tmp_path)
        assert not in_use(tmp_path)
        assert said == []  # the last run has ended: there is nothing to wait for


def test_without_locks_a_live_run_keeps_others_out(no_locks, tmp_path):
    lock = tmp_path / LOCK_FILE
    with FolderLock(SELF, tmp_path):
        for age in (0.0, 1e6):  # whatever the clock of its machine says
            then = lock.stat().st_mtime - age
            os.utime(lock, (then, then))
            with (
                pytest.raises(InUseError, match=f"at work here, process {os.getpid()}"),
                FolderLock(SELF, tmp_path),
            ):
                pass
        assert in_use(tmp_path)


def test_without_locks_a_killed_run_is_waited_for(no_locks, tmp_path):
    (tmp_path / LOCK_FILE).write_text("process 1 on another\n")
    said, begin = [], time.monotonic()
    with FolderLock(SELF, tmp_path, said.append):
        assert time.monotonic() - begin >= 0.8
        assert "process 1 " not in (tmp_path / LOCK_FILE).read_text()
    assert len(said) == 1


def test_without_locks_one_of_two_that_start_at_once_is_refused(
    no_locks, tmp_path, monkeypatch
):
    outcomes, looked = [], threading.Barrier(2)
    silent = FolderLock._is_silent
    monkeypatch.setattr(
        FolderLock, "_is_silent", lambda lock: silent(lock) and looked.wait() >= 0
    )

    def start(name):
        lock = FolderLock(SELF, tmp_path)
        # Two processes, as far as the file can tell.
        lock._name = f"process {name} on here\n".encode()
        try:
            lock._take()
        except InUseError:
            outcomes.append("refused")
        else:
            outcomes.append("taken")
            time.sleep(0.5)
        lock._release()

    threads = [threading.Thread(target=start, args=(k,)) for k in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(outcomes) == ["refused", "taken"]


def test_a_run_that_is_refused_writes_nothing(tmp_path, holder, monkeypatch):
    monkeypatch.setattr(mpisph.io.lock, "PATIENCE", 0.1)
    (tmp_path / LOCK_FILE).write_text("process 1 on another\n")
    before = (tmp_path / LOCK_FILE).stat()
    with (
        pytest.raises(InUseError, match="process 1 on another"),
        FolderLock(SELF, tmp_path),
    ):
        pass
    after = (tmp_path / LOCK_FILE).stat()
    assert (after.st_size, after.st_mtime_ns) == (before.st_size, before.st_mtime_ns)


@pytest.mark.mpi(min_size=2)
def test_the_lock_lasts_until_the_last_rank_lets_go(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    lock = FolderLock(comm, mpi_tmp_path)
    lock.__enter__()
    comm.Barrier()
    if comm.rank == 0:
        lock.__exit__(None, None, None)
    comm.Barrier()
    held = in_use(mpi_tmp_path)
    comm.Barrier()
    lock.__exit__(None, None, None)
    comm.Barrier()
    free = not in_use(mpi_tmp_path)
    agree(comm, [] if held and free else [f"held {held}, then free {free}"])


@pytest.mark.mpi(min_size=2)
def test_all_ranks_are_refused(mpi_tmp_path, monkeypatch):
    comm = MPI.COMM_WORLD
    monkeypatch.setattr(mpisph.io.lock, "PATIENCE", 0.1)
    other = comm.Split(comm.rank == 0, comm.rank)
    first = FolderLock(other, mpi_tmp_path)
    if comm.rank == 0:
        first.__enter__()
    comm.Barrier()
    with (
        pytest.raises(MpisphError, match="another run"),
        FolderLock(comm, mpi_tmp_path),
    ):
        pass
    comm.Barrier()
    if comm.rank == 0:
        first.__exit__(None, None, None)
    other.Free()
