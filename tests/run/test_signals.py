"""What ends a run before its time."""

import os
import signal
import subprocess
import sys
import time

import pytest
from launch import PATIENCE, environment, launch
from mpi4py import MPI

from mpisph.run.signals import (
    SIGNALS,
    SignalHandler,
    StopRequest,
    is_alive,
    is_stop,
    reason,
)

SELF = MPI.COMM_SELF


def test_requests_have_reasons():
    assert [
        is_stop(request) for request in (StopRequest.NOTHING, StopRequest.CHECKPOINT)
    ] == [False, False]
    assert reason(StopRequest.STOP_FILE) == "file stop"
    assert reason(StopRequest.WALL_TIME) == "wall-time limit"


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_becomes_a_request(number):
    signals = SignalHandler()
    before = signal.getsignal(number)
    with signals.catching_signals(SELF):
        assert signals.signal_request() == StopRequest.NOTHING
        os.kill(os.getpid(), number)
        assert is_stop(signals.signal_request())
        assert reason(signals.signal_request()) == f"signal {number.name}"
        # Whatever else is asked for, it counts.
        assert signals.signal_request() > StopRequest.WALL_TIME
    assert signal.getsignal(number) is before


def test_only_a_second_interrupt_ends_the_process_at_once():
    signals = SignalHandler()
    with signals.catching_signals(SELF):
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) == signal.SIG_DFL


def test_without_a_limit_there_is_no_end_of_time():
    assert SignalHandler().time_left() == float("inf")


def test_the_limit_counts_from_the_start_of_the_process():
    program = (
        "import time; time.sleep(1.5)\n"
        "from mpisph.run.signals import SignalHandler\n"
        "signals = SignalHandler(); signals.limit(100.0); print(signals.time_left())"
    )
    begin = time.monotonic()
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=environment(),
        capture_output=True,
        text=True,
        check=True,
    )
    spent = time.monotonic() - begin
    assert 100.0 - spent - 0.1 <= float(done.stdout) <= 98.6


def test_who_is_alive():
    assert is_alive(os.getpid())
    child = subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE)
    assert is_alive(child.pid)
    child.kill()
    deadline = time.monotonic() + 10.0
    while is_alive(child.pid):  # a zombie until it is waited for
        assert time.monotonic() < deadline
    child.communicate()
    assert not is_alive(child.pid)


# Ranks that fail in some way inside a run; the others wait for them in MPI.
FAILING = """
import os, sys, signal
from pathlib import Path
from mpi4py import MPI
from mpisph.run.signals import SignalHandler
from mpisph.io.status import StatusFile

comm = MPI.COMM_WORLD
signals = SignalHandler()
sys.excepthook = signals.end_all_ranks
folder = Path(sys.argv[1])
status = StatusFile(comm, folder, 1.0, starts=1)
status.write("running", 7, 0.5)

def fail():
    {how}

with signals.catching_signals(comm), signals.working_in(folder, status.fail):
    if comm.rank in {which}:
        fail()
    comm.Barrier()
"""


@pytest.mark.parametrize(
    ("how", "which", "text"),
    [
        ("1 / 0", [1], "rank 1 of 3: ZeroDivisionError: division by zero"),
        ("1 / 0", [0, 1, 2], "rank 0 of 3: ZeroDivisionError: division by zero"),
        ("1 / 0", [1, 2], "rank 1 of 3: ZeroDivisionError: division by zero"),
        ("raise MemoryError", [2], "rank 2 of 3: out of memory"),
        ("open('/no/such')", [1], "rank 1 of 3: No such file or directory: /no/such"),
        ("os.kill(os.getpid(), signal.SIGKILL)", [0], "rank 0 of 3 has died"),
        ("os.kill(os.getpid(), signal.SIGSEGV)", [2], "rank 2 of 3 has died"),
    ],
)
def test_what_one_rank_meets_ends_all_with_one_message(how, which, text, tmp_path):
    program = FAILING.format(how=how, which=which)
    begin = time.monotonic()
    done = launch(3, sys.executable, "-c", program, tmp_path, **{PATIENCE: "1"})
    assert time.monotonic() - begin < 10.0  # the start included
    assert done.returncode not in (0, 2, 3, 75)
    assert done.stderr.count("mpisph: ") == 1
    assert f"mpisph: {text}" in done.stderr
    assert "Traceback" not in done.stderr
    status = (tmp_path / "status.json").read_text()
    assert '"state": "failed"' in status
    assert text in status
    traces = list(tmp_path.glob("mpisph-traceback-rank*.txt"))
    assert len(traces) == ("ZeroDivisionError" in text)
    for path in traces:
        assert str(path) in done.stderr
        assert "in fail" in path.read_text()
