"""What ends a run before its time."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from launch import CASES, PATIENCE, call, environment, launch
from mpi4py import MPI

import mpisph.run.signals
from mpisph.core.held_signals import SIGNALS, held, hold_signals
from mpisph.io.status import read_status
from mpisph.run.signals import (
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


def test_the_first_signal_is_the_reason():
    signals = SignalHandler()
    with signals.catching_signals(SELF):
        for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1, signal.SIGTERM):
            os.kill(os.getpid(), number)
        assert reason(signals.signal_request()) == "signal SIGTERM"


@pytest.mark.parametrize(("later", "codes"), [(1.9, []), (2.1, [130])])
def test_only_a_later_second_interrupt_ends_the_process_at_once(
    later, codes, monkeypatch, capsys
):
    ended = []
    monkeypatch.setattr(os, "_exit", ended.append)
    signals = SignalHandler()
    signals._note_interrupt(10.0)
    assert "Ctrl-C again, after 2 s, ends the run at once" in capsys.readouterr().err
    signals._note_interrupt(10.0 + later)
    assert ended == codes


def test_an_interrupt_is_seen_while_the_main_thread_waits(monkeypatch):
    """As it does in MPI, where no handler of Python's runs."""
    seen = threading.Event()
    monkeypatch.setattr(SignalHandler, "_note_interrupt", lambda *_: seen.set())
    before = signal.getsignal(signal.SIGINT)
    with SignalHandler().catching_signals(SELF):
        signal.raise_signal(signal.SIGINT)
        assert seen.wait(10.0)
    assert signal.getsignal(signal.SIGINT) is before


@pytest.fixture
def holding():
    """Signals of this process are held, as while the program loads."""
    before = {number: signal.getsignal(number) for number in SIGNALS}
    hold_signals()
    yield
    held.clear()
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_before_the_run_stops_it(number, holding, tmp_path):
    os.kill(os.getpid(), number)
    short = ("--set", "resolution.npr=4", "--set", "time.end=0.2us")
    case = CASES / "piekutowski-4-1353.toml"
    done = call("run", case, *short, "-o", tmp_path)
    assert done.returncode == 75, done.stderr
    status = read_status(tmp_path)
    assert status.state == "stopped"
    assert status.reason == f"signal {number.name}, before any step"


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_before_another_command_ends_it_with_a_message(number, holding):
    os.kill(os.getpid(), number)
    done = call("schema")
    assert done.returncode == 128 + number
    assert done.stderr.strip() == f"mpisph: interrupted ({number.name})"
    assert done.stdout == ""


# The program, with signals while it loads and while it ends.
SIGNALLED = """
import atexit, os, signal, sys
import mpisph.core.held_signals as held_signals
hold, numbers = held_signals.hold_signals, held_signals.SIGNALS

def kill():
    for number in numbers:
        os.kill(os.getpid(), number)

held_signals.hold_signals = lambda: (hold(), kill())
atexit.register(kill)
from mpisph.__main__ import main
main()
"""


@pytest.mark.parametrize(("command", "code"), [("run", 75), ("schema", 143)])
def test_more_signals_do_not_change_the_exit_code(command, code, tmp_path):
    short = ("--set", "resolution.npr=4", "-o", tmp_path)
    words = [CASES / "piekutowski-4-1353.toml", *short] if command == "run" else []
    done = launch(1, sys.executable, "-c", SIGNALLED, command, *words)
    assert done.returncode == code, done.stderr
    assert "Traceback" not in done.stderr


def test_the_signal_that_a_script_was_sent_is_the_reason(tmp_path, monkeypatch):
    path = tmp_path / "signals"
    monkeypatch.setenv("MPISPH_SIGNALS", str(path))
    for text, expected in (
        ("INT\nTERM\n", signal.SIGINT),
        ("HUP\n", signal.SIGHUP),
        ("", signal.SIGUSR1),
        ("NONSENSE\n", signal.SIGUSR1),
    ):
        path.write_text(text)
        assert mpisph.run.signals._original(signal.SIGUSR1) == expected
        assert mpisph.run.signals._original(signal.SIGTERM) == signal.SIGTERM
    path.unlink()
    assert mpisph.run.signals._original(signal.SIGUSR1) == signal.SIGUSR1


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
    done = launch(
        3, sys.executable, "-c", program, tmp_path, timeout=60, **{PATIENCE: "1"}
    )
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
