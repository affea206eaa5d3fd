import contextlib
import io
import os
import pty
import subprocess
import sys

import pytest
from launch import environment
from mpi4py import MPI
from rich.console import Console

from mpisph.io.run_log import LOG_FILE, RunLog
from mpisph.run.progress import Progress

SELF = MPI.COMM_SELF


class Clock:
    """A wall clock that the test turns."""

    now = 100.0

    def __call__(self):
        return self.now


def console(**options):
    return Console(file=io.StringIO(), width=200, **options)


def test_plain_lines_come_at_intervals_and_once_at_the_end():
    clock, out = Clock(), console()
    with Progress(SELF, 10e-6, out, interval=5.0, clock=clock) as progress:
        for step in range(1, 13):
            clock.now = 100.0 + step
            progress.update(step * 0.5e-6, step, 1e-9)
    lines = out.file.getvalue().splitlines()
    # Five seconds after the first step, five after that, and the last one.
    assert [line.split("step ")[1].split(",")[0] for line in lines] == ["6", "11", "12"]
    # 0.5 us a second: from 3 us to 10 us it takes 14 s.
    assert lines[0] == (
        " 30.0%  t = 3.000 of 10.000 µs, step 6, dt = 1 ns, 0:00:14 left"
    )


def test_the_last_line_is_not_said_twice():
    clock, out = Clock(), console()
    with Progress(SELF, 1e-6, out, interval=0.0, clock=clock) as progress:
        progress.update(1e-6, 1, 1e-9)
    assert len(out.file.getvalue().splitlines()) == 1


def test_no_step_says_nothing():
    out = console()
    with Progress(SELF, 1e-6, out):
        pass
    assert out.file.getvalue() == ""


def test_a_terminal_gets_a_bar_and_the_log_gets_lines(tmp_path):
    clock, out = Clock(), console(force_terminal=True)
    with (
        RunLog(tmp_path, SELF) as log,
        Progress(SELF, 1e-6, out, log=log, interval=1.0, clock=clock) as progress,
    ):
        progress.update(0.25e-6, 1, 1e-9)
        clock.now += 1.0
        progress.update(0.5e-6, 2, 1e-9)
    shown = out.file.getvalue()
    assert "━" in shown
    assert "50%" in shown
    assert "step 2" in shown
    assert (tmp_path / LOG_FILE).read_text().count("\n") == 1


SHOW = """
from mpi4py import MPI
from mpisph.run.progress import Progress, open_console
with Progress(MPI.COMM_WORLD, 1e-6) as progress:
    progress.update(0.5e-6, 7, 1e-9)
if MPI.COMM_WORLD.rank == 0:
    open_console(stderr=False).print("[bold]said[/]")
"""


@pytest.mark.parametrize(
    ("launcher", "terminal", "told", "bar"),
    [
        ((), True, {}, True),
        ((), False, {}, False),
        # Its ranks have a terminal as standard output either way.
        (("mpirun", "-n", "2"), True, {}, False),
        (("mpirun", "-n", "2"), False, {}, False),
        (("mpirun", "-n", "2"), True, {"TTY_COMPATIBLE": "1"}, True),
    ],
)
def test_a_terminal_gets_a_bar_and_a_file_gets_lines(
    launcher, terminal, told, bar, tmp_path
):
    ours, theirs = pty.openpty()
    with (tmp_path / "out").open("wb+") as file:
        out = theirs if terminal else file
        subprocess.run(
            [*launcher, sys.executable, "-c", SHOW],
            env=environment(TERM="xterm", **told),
            stdout=out,
            stderr=out,
            stdin=subprocess.DEVNULL,
            check=True,
            timeout=60,
        )
        os.close(theirs)
        file.seek(0)
        shown = _drain(ours) if terminal else file.read().decode()
    assert ("\x1b[" in shown) == bar
    assert ("━" in shown) == bar
    assert shown.count("said") == 1
    assert "step 7" in shown


def _drain(terminal):
    """Read what was written to a pseudo-terminal whose other end is closed."""
    parts = []
    with contextlib.suppress(OSError):
        while part := os.read(terminal, 65536):
            parts.append(part)
    os.close(terminal)
    return b"".join(parts).decode()


@pytest.mark.mpi(min_size=2)
def test_only_rank_0_speaks(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    out = console()
    with (
        RunLog(mpi_tmp_path, comm) as log,
        Progress(comm, 1e-6, out, log=log) as progress,
    ):
        log.say(f"rank {comm.rank}")
        progress.update(1e-6, 1, 1e-9)
    comm.barrier()
    assert bool(out.file.getvalue()) == (comm.rank == 0)
    lines = (mpi_tmp_path / LOG_FILE).read_text().splitlines()
    assert len(lines) == 2
    assert lines[0] == "rank 0"
