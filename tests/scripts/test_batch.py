"""Batch scripts under stand-ins for schedulers, and scripts/run told to stop.

Where a run computes, Slurm's time is counted in the run's steps: on a busy machine all
takes longer, and nothing else happens.
"""

import fcntl
import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest
from launch import CASES, TOP, call, environment
from run_folders import assert_same, short_starts, status
from scheduler import Pbs, Slurm, kill, processes

from mpisph.case import load_case

SHOT = CASES / "piekutowski-4-1353.toml"
SLURM = TOP / "scripts/slurm.sh"
PBS = TOP / "scripts/pbs.sh"
SETTINGS = {
    "one": ("resolution.npr=6", "time.end=2us", "checkpoints.interval=0.06us"),
    "two": ("resolution.npr=5", "time.end=1.6us", "checkpoints.interval=0.06us"),
}


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """A folder with two case files, and their runs in runs/."""
    folder = tmp_path_factory.mktemp("uninterrupted")
    cases = [folder / f"{name}.toml" for name in SETTINGS]
    for path, settings in zip(cases, SETTINGS.values(), strict=True):
        case = load_case(SHOT, [*settings, "output.figures=false"])
        path.write_text(case.to_toml())
    done = call("run", *cases, "-o", folder / "runs")
    assert done.returncode == 0, done.stderr
    return folder


def steps_made(folder):
    """The steps of all runs in a folder, as of their last checkpoints."""
    return sum(status(path.parent)["step"] for path in folder.glob("*/status.json"))


def slurm_of(tmp_path, **variables):
    """Slurm with jobs of two tasks, whose time is counted in steps."""
    scheduler = Slurm(tmp_path / "slurm", **variables)
    scheduler.clock = lambda: steps_made(scheduler.work / "runs")
    return scheduler


def submit(scheduler, *arguments, **options):
    return scheduler.submit(SLURM, *arguments, **{"ntasks": "2", **options})


# The runs have 129 and 89 steps; the script asks to be warned 180 before the limit.
WARNED = {"limit": "265"}


def test_slurm_stops_before_the_limit_and_requeues_until_done(tmp_path, uninterrupted):
    slurm = slurm_of(tmp_path)
    [job] = submit(slurm, uninterrupted / "one.toml", **WARNED)
    slurm.run(job)
    folder = slurm.work / "runs/one"
    assert job.code == 0, job.text()
    assert job.restarts >= 1
    assert job.text().count("not done yet; requeueing job 7\n") == job.restarts
    assert job.text().count(": mpisph run --walltime ") == 1
    assert job.text().count(": mpisph resume --walltime ") == job.restarts
    assert job.text().endswith("runs/one: done\n")
    assert status(folder)["starts"] == 1 + job.restarts
    assert_same(folder, uninterrupted / "runs/one")


def test_each_element_of_a_slurm_array_runs_its_case(tmp_path, uninterrupted):
    slurm = slurm_of(tmp_path, MPISPH_LAUNCH="srun", MPISPH_RUNS="elsewhere")
    slurm.clock = lambda: steps_made(slurm.work / "elsewhere")
    cases = [uninterrupted / f"{name}.toml" for name in SETTINGS]
    jobs = submit(slurm, *cases, array="0-1", limit="270")
    slurm.run(*jobs)
    assert jobs[0].restarts >= 1
    for job, name in zip(jobs, SETTINGS, strict=True):
        assert job.code == 0, job.text()
        assert job.text().count(f"requeueing job {job.name}\n") == job.restarts
        assert_same(slurm.work / "elsewhere" / name, uninterrupted / "runs" / name)


def test_after_a_kill_the_run_goes_on(tmp_path, uninterrupted):
    """As when a node fails, or when the warning came too late."""
    slurm = slurm_of(tmp_path)
    slurm.grace = 0.0
    [job] = submit(slurm, uninterrupted / "one.toml", limit="60", signal="none@0")
    slurm.run(job)
    assert job.timed_out
    assert job.code == -signal.SIGKILL
    assert job.restarts == 0
    assert status(slurm.work / "runs/one")["state"] == "running"
    job.restarts = 1  # somebody has requeued it
    del job.options["limit"]
    slurm.run(job)
    assert job.code == 0, job.text()
    assert ": mpisph resume " in job.text()
    assert "continuing from checkpoint_" in job.text()
    assert_same(slurm.work / "runs/one", uninterrupted / "runs/one")


def test_a_cancelled_job_stops_and_does_not_come_back(tmp_path, uninterrupted):
    slurm = slurm_of(tmp_path)
    [job] = submit(slurm, uninterrupted / "one.toml", limit="40", signal="none@0")
    slurm.run(job)
    assert job.timed_out
    assert job.restarts == 0
    assert job.code == 75, job.text()
    assert "told to end; submit it again to continue" in job.text()
    assert status(slurm.work / "runs/one")["state"] == "stopped"


def test_the_stop_file_ends_the_chain(tmp_path, uninterrupted):
    slurm = slurm_of(tmp_path)
    folder = slurm.work / "runs/one"

    def make_stop_file(job, shell, elapsed):
        if elapsed > 10:
            (folder / "stop").touch()

    slurm.meanwhile = make_stop_file
    [job] = submit(slurm, uninterrupted / "one.toml")
    slurm.run(job)
    assert job.restarts == 0
    assert job.code == 75, job.text()
    assert "not started again because of the file 'stop'" in job.text()
    assert status(folder)["state"] == "stopped"
    assert status(folder)["reason"] == "file stop"


@pytest.mark.parametrize(
    ("change", "code", "text"),
    [
        ("time.step=fixed time.dt=200ns", 3, "runs/one: the run is unstable\n"),
        ("time.cfl=-1", 2, "runs/one: bad input\n"),
    ],
)
def test_what_another_start_would_not_mend_ends_the_chain(
    change, code, text, tmp_path, uninterrupted
):
    slurm = slurm_of(tmp_path)
    options = [x for word in change.split() for x in ("--set", word)]
    [job] = submit(slurm, uninterrupted / "one.toml", "--", *options)
    slurm.run(job)
    assert job.code == code, job.text()
    assert job.restarts == 0
    assert job.text().endswith(text)


def test_pbs_stops_by_the_wall_time_and_submits_itself_until_done(
    tmp_path, uninterrupted
):
    pbs = Pbs(tmp_path / "pbs", PYTHONPATH=str(short_starts(tmp_path, 70)))
    size = ("-l", "select=1:ncpus=2:mpiprocs=2")
    names = "CASE,MPISPH_HOME,MPISPH_MARGIN"
    variables = {
        "CASE": str(uninterrupted / "one.toml"),
        "MPISPH_HOME": str(TOP),
        "MPISPH_MARGIN": "10",
    }
    folder = pbs.work / "runs/one"
    pbs.submit("-l", "walltime=0:05:00", *size, "-v", names, PBS, **variables)
    jobs = pbs.run()
    assert len(jobs) == 2
    assert all(re.search(r" --walltime 2[89]\ds ", job.text()) for job in jobs)
    assert [job.code for job in jobs] == [75] * (len(jobs) - 1) + [0], jobs[-1].text()
    assert not any(job.timed_out for job in jobs)
    for job in jobs[:-1]:
        assert "runs/one: not done yet; submitting again\n" in job.text()
    assert [": mpisph resume " in job.text() for job in jobs] == [False] + [True] * (
        len(jobs) - 1
    )
    assert_same(folder, uninterrupted / "runs/one")


# What follows needs no run: a stand-in for mpisph notes how it was called.

STAND_IN = """#!/usr/bin/env python3
import json, os, sys
from pathlib import Path

words = sys.argv[1:]
folder = Path(words[words.index("-o") + 1] if words[0] == "run" else words[-1])
folder.mkdir(parents=True, exist_ok=True)
calls = folder / "calls"
with calls.open("a") as file:
    print(*words, file=file)
number = len(calls.read_text().splitlines())
step = min(number, int(os.environ.get("STEPS", 100)))
(folder / "case.toml").touch()
status = json.dumps({"state": "stopped", "step": step}, indent=2)
(folder / "status.json").write_text(status)
sys.exit(0 if number == 4 else 75)
"""


def copy_scripts(folder):
    """Copy the scripts, and what they take from the package."""
    shutil.copytree(TOP / "scripts", folder / "scripts")
    (folder / "mpisph/study").mkdir(parents=True)
    shutil.copy(TOP / "mpisph/study/job.sh", folder / "mpisph/study")


@pytest.fixture
def home(tmp_path):
    """A checkout whose mpisph is done at the fourth start."""
    folder = tmp_path / "home"
    copy_scripts(folder)
    (folder / ".venv/bin").mkdir(parents=True)
    mpisph = folder / ".venv/bin/mpisph"
    mpisph.write_text(STAND_IN)
    mpisph.chmod(0o755)
    return folder


def calls(folder):
    return (folder / "calls").read_text().splitlines()


def test_slurm_passes_on_what_it_was_given(tmp_path, home):
    slurm = Slurm(tmp_path / "slurm", MPISPH_LAUNCH="env")
    script = home / "scripts/slurm.sh"
    options = ("--set", "time.end=1 us", "-o", "here")
    jobs = slurm.submit(script, "a/one.toml", "b/two.v2.toml", "--", *options)
    slurm.run(*jobs)
    assert jobs[0].code == 2  # no array
    jobs = slurm.submit(script, "b/two.v2.toml", "--", *options)
    slurm.run(*jobs)
    assert jobs[0].code == 0, jobs[0].text()
    first, *later = calls(slurm.work / "here")
    limit = int(first.split()[2].removesuffix("s"))
    assert 3600 - 60 - 10 < limit <= 3600 - 60
    assert first.endswith("s --set time.end=1 us -o here -- b/two.v2.toml")
    assert [x.split()[0] for x in later] == ["resume"] * 3
    assert later[0].endswith("s -- here")


def test_pbs_submits_an_element_again_as_it_was(tmp_path, home):
    pbs = Pbs(tmp_path / "pbs", MPISPH_LAUNCH="env")
    variables = {
        "CASE": "a/one.toml b/two.toml",
        "ARGS": "--set measured.exposures=[1,2] --output=here",
        "MPISPH_HOME": str(home),
        "MPISPH_QSUB": "-A account",
    }
    size = "select=2:ncpus=3:mpiprocs=3:mem=10gb:chip=with-a-long-name"
    wanted = (
        "-J",
        "0-1",
        "-q",
        "long",
        "-N",
        "many",
        "-l",
        size,
        "-l",
        "walltime=10:10:10",
    )
    names = "CASE,ARGS,MPISPH_HOME,MPISPH_QSUB"
    pbs.submit(*wanted, "-v", names, home / "scripts/pbs.sh", **variables)
    jobs = pbs.run()
    assert len(jobs) == 2 * 4
    for name, case in (("one", "a/one.toml"), ("two", "b/two.toml")):
        first, *later = calls(pbs.work / "here" / name)
        limit = int(first.split()[2].removesuffix("s"))
        assert 36610 - 60 - 10 < limit <= 36610 - 60
        options = f"--set measured.exposures=[1,2] -o here/{name} -- {case}"
        assert first.endswith(f"s {options}")
        assert [x.split()[0] for x in later] == ["resume"] * 3
    for job in jobs[2:]:
        assert job.options["-l"] == {"select": size[7:], "walltime": "10:10:10"}
        assert job.options["-q"] == "long"
        assert job.options["-N"] == "many"
        assert job.options["-A"] == "account"
        assert "-J" not in job.options


def test_a_start_without_a_step_is_the_last(tmp_path, home):
    """The third start makes none."""
    slurm = Slurm(tmp_path / "slurm", MPISPH_LAUNCH="env", STEPS="2")
    [job] = slurm.submit(home / "scripts/slurm.sh", "one.toml")
    slurm.run(job)
    pbs = Pbs(tmp_path / "pbs", MPISPH_LAUNCH="env", MPISPH_HOME=str(home), STEPS="2")
    pbs.submit("-v", "CASE=one.toml", home / "scripts/pbs.sh")
    jobs = pbs.run()
    assert (job.code, job.restarts) == (75, 2)
    assert [j.code for j in jobs] == [75] * 3
    for last in (job, jobs[-1]):
        assert last.text().endswith("this start has not made a single step\n")


@pytest.mark.parametrize(
    ("array", "arguments", "text"),
    [
        (None, "", "no CASE given"),
        (None, "a.toml b.toml", "2 cases need a job array"),
        ("2-2", "a.toml b.toml", "element 2 of the job array has no case"),
        ("0-0", "a.toml b/a.toml", "two of the cases would be run in one folder, a"),
        (None, "a.toml -- -o", "-o needs a folder"),
        (
            None,
            "a.toml -- --force",
            "--force: each start of a job would start over",
        ),
    ],
)
def test_wrong_calls_exit_with_code_2(array, arguments, text, tmp_path, home):
    slurm = Slurm(tmp_path / "slurm", MPISPH_LAUNCH="env")
    options = {"array": array} if array else {}
    [job] = slurm.submit(home / "scripts/slurm.sh", *arguments.split(), **options)
    slurm.run(job)
    pbs = Pbs(tmp_path / "pbs", MPISPH_LAUNCH="env", MPISPH_HOME=str(home))
    cases, _, more = arguments.partition(" -- ")
    options = ("-J", array) if array else ()
    pbs.submit(*options, "-v", f"CASE={cases},ARGS={more}", home / "scripts/pbs.sh")
    [other] = pbs.run()
    for ended in (job, other):
        assert ended.code == 2
        assert text in ended.text()
    assert not list(tmp_path.rglob("calls"))


def test_without_a_checkout_or_a_scheduler_the_scripts_say_so(tmp_path, home):
    pbs = Pbs(tmp_path / "pbs")
    pbs.submit("-v", "CASE=one.toml", PBS)
    [job] = pbs.run()
    assert job.code == 2
    assert "set MPISPH_HOME" in job.text()
    for script, command in (("slurm", "sbatch"), ("pbs", "qsub")):
        done = subprocess.run(
            [home / f"scripts/{script}.sh", "one.toml"],
            env=environment(),
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 2
        assert done.stderr.startswith(f"usage: {command} ")


# scripts/run.


@pytest.fixture
def checkout(tmp_path):
    """A checkout with an environment, in which setup has nothing to do."""
    folder = tmp_path / "checkout"
    copy_scripts(folder)
    (folder / "scripts/setup").write_text("#!/bin/sh\n")
    (folder / ".venv").mkdir()
    (folder / ".venv/bin").symlink_to(Path(sys.executable).parent)
    return folder


def take_terminal():
    """Make the standard input a new session's terminal, with its Ctrl-C."""
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)
    # A shell leaves ignored what it finds so, as below a shell's background job.
    for number in (signal.SIGINT, signal.SIGQUIT):
        signal.signal(number, signal.SIG_DFL)


def name_of(pid):
    """The name of a process; empty for one that has ended."""
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except OSError:
        return ""


class Terminal:
    """A command on a terminal of its own, to which `keys` may be written."""

    def __init__(self, *command):
        self.keys, theirs = pty.openpty()
        self.process = subprocess.Popen(
            command,
            env=environment(TERM="xterm"),
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            start_new_session=True,
            preexec_fn=take_terminal,
        )
        os.close(theirs)

    def launchers(self):
        """The mpirun at work, in a session of its own."""
        pid = self.process.pid
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
        return [int(child) for child in children if name_of(child) == "mpirun"]

    def wait_until(self, condition):
        given_up = time.monotonic() + 40.0
        while not condition():
            assert self.process.poll() is None
            assert time.monotonic() < given_up
            time.sleep(0.02)

    def end(self):
        """Wait for the command's end; return its exit code and what it has written."""
        text, given_up = b"", time.monotonic() + 40.0
        while time.monotonic() < given_up:
            try:
                if select.select([self.keys], [], [], 1.0)[0]:
                    text += os.read(self.keys, 65536)
            except OSError:  # the last writer has ended
                return self.process.wait(timeout=10), text.decode()
        pytest.fail(f"it does not end: {text.decode()}")


@pytest.fixture
def terminal():
    """Start a command on a terminal."""
    made = []

    def start(*command):
        made.append(Terminal(*command))
        return made[-1]

    yield start
    for each in made:
        if each.process.poll() is None:
            for pid in each.launchers():
                kill(processes(pid), signal.SIGKILL)
            kill(processes(each.process.pid), signal.SIGKILL)
            each.process.wait()
        os.close(each.keys)


@pytest.mark.parametrize("how", ["Ctrl-C", "SIGTERM", "at once"])
def test_scripts_run_stops_with_a_checkpoint(
    how, checkout, terminal, tmp_path, uninterrupted
):
    folder = tmp_path / "run"
    case = uninterrupted / "one.toml"
    command = [checkout / "scripts/run", case, "-o", folder]
    if how == "at once":
        command += ["--set", "time.end=20us"]  # by far not done when it comes
    run = terminal(*command)
    if how == "at once":
        # The ranks have no handlers yet.
        run.wait_until(run.launchers)
        assert not folder.exists()
    else:
        run.wait_until(lambda: steps_made(tmp_path) > 0)
    if how == "SIGTERM":
        run.process.send_signal(signal.SIGTERM)
    else:
        os.write(run.keys, b"\x03")
    code, text = run.end()
    assert code == 75, text
    if "stopped before the ranks had begun" in text:
        assert how == "at once"
        return
    assert status(folder)["state"] == "stopped"
    sent = "SIGTERM" if how == "SIGTERM" else "SIGINT"
    assert status(folder)["reason"].startswith(f"signal {sent}")
    assert "`mpisph resume" in text
    if how != "Ctrl-C":
        return
    assert "\x1b[" in text  # the ranks know that there is a terminal
    # A folder instead of a case.
    code, text = terminal(checkout / "scripts/run", folder, "-n", "1").end()
    assert code == 0, text
    assert "continuing from checkpoint_" in text
    assert_same(folder, uninterrupted / "runs/one")


DEAF = """
import os, signal
signal.signal(signal.SIGUSR1, signal.SIG_DFL)
os.kill(os.getpid(), signal.SIGUSR1)
"""


@pytest.mark.parametrize("asked", ["", "0"])
def test_ranks_asked_before_they_could_hear_count_as_stopped(asked):
    script = 'source "$1"; catch_signals; asked=$2; launch "$3" -c "$4"'
    arguments = [TOP / "mpisph/study/job.sh", asked, sys.executable, DEAF]
    done = subprocess.run(
        ["bash", "-c", script, "bash", *arguments], capture_output=True, text=True
    )
    assert done.returncode == (75 if asked else 128 + signal.SIGUSR1)
    assert ("stopped before the ranks had begun" in done.stderr) == bool(asked)


def test_scripts_run_told_twice_ends_the_ranks(
    checkout, terminal, tmp_path, uninterrupted
):
    case = uninterrupted / "one.toml"
    run = terminal(checkout / "scripts/run", case, "-o", tmp_path / "run")
    run.wait_until(lambda: steps_made(tmp_path) > 0)
    [launcher] = run.launchers()
    ranks = set(processes(launcher)) - {launcher}
    assert len(ranks) == 2
    kill(ranks, signal.SIGSTOP)  # they cannot stop as they are asked to
    run.process.send_signal(signal.SIGTERM)
    run.process.send_signal(signal.SIGINT)  # too soon to be a second request
    time.sleep(2.2)
    for pid in ranks:
        assert "State:\tT" in Path(f"/proc/{pid}/status").read_text()
    run.process.send_signal(signal.SIGTERM)
    code, text = run.end()
    assert code == 1, text
    given_up = time.monotonic() + 10.0
    while any(Path(f"/proc/{pid}").exists() for pid in ranks):
        assert time.monotonic() < given_up
        time.sleep(0.02)
