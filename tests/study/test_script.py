"""Batch scripts of a study, under stand-ins for the schedulers."""

import contextlib
import re
import subprocess
import sys
from pathlib import Path

import pytest
from launch import call
from mpi4py import MPI
from rich.console import Console
from run_folders import slow_steps
from scheduler import Pbs, Slurm
from studies import ALPHA, small_study

from mpisph.io.status import read_status
from mpisph.study.model import load_study
from mpisph.study.runner import run_study
from mpisph.study.table import collect

TEXT = small_study("0.4 us") + ALPHA

# In each start, time is up when two runs have ended.
SHORT = """
import os
if "OMPI_COMM_WORLD_RANK" in os.environ:
    import mpisph.study.runner as runner
    from mpisph.run.signals import SignalHandler
    ended = []
    run = runner._run_one
    runner._run_one = lambda *args: ended.append(run(*args)) or ended[-1]
    SignalHandler.time_left = lambda signals: 1e6 if len(ended) < LIMIT else 0.0
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    path = tmp_path_factory.mktemp("study") / "small.toml"
    path.write_text(TEXT)
    return load_study(path)


@pytest.fixture(scope="module")
def reference(study, tmp_path_factory):
    """The table of the study, run without a scheduler."""
    root = tmp_path_factory.mktemp("reference")
    run_study(study, MPI.COMM_SELF, root, Console(quiet=True))
    return table(study, root)


def table(study, root):
    rows = collect(study, root)
    return [{k: v for k, v in row.items() if k != "wall_s"} for row in rows]


def written(arguments, work, system):
    """The script that the command writes in a folder."""
    command = ("study", "script", f"--{system}", "--jobs", "2", "--ranks", "2")
    with contextlib.chdir(work):
        done = call(*command, *arguments)
    assert done.returncode == 0, done.stderr
    path = work / f"{system}.sh"
    path.write_text(done.stdout)
    return path


ODD = "it's, $(touch owned); `touch owned` \"& touch owned #\\"
"""What would run commands where a name is not quoted."""


@pytest.mark.parametrize("system", ["slurm", "pbs"])
def test_the_script_runs_no_part_of_a_name(study, tmp_path, system):
    """The stop file in the study's folder is seen, and nothing else happens."""
    scheduler = {"slurm": Slurm, "pbs": Pbs}[system](tmp_path / ODD)
    odd = scheduler.work / f"{ODD}.toml"
    odd.write_text(study.path.read_text())
    root = scheduler.work / f"runs {ODD}"
    folder = root / "studies" / ODD
    folder.mkdir(parents=True)
    (folder / "stop").touch()
    options = ("--jobs", "1", "--ranks-per-case", "2")
    names = ("-o", root.name, *options, "--", odd.name)
    script = written(names, scheduler.work, system)
    shellcheck = Path(sys.executable).with_name("shellcheck")  # it may not be on PATH
    sound = [shellcheck, "--external-sources", "--exclude=SC2016,SC1003", script]
    subprocess.run(sound, check=True)
    assert re.search(r"--array=0-0$|qsub -J 0-0 ", script.read_text(), re.M)
    if system == "slurm":
        jobs = scheduler.submit(script)
        scheduler.run(*jobs)
    else:
        scheduler.submit("-J", "0-0", script)
        jobs = scheduler.run()
    assert len(jobs) == 1
    for job in jobs:
        assert job.code == 75, job.text()
        assert "not started again because of the file 'stop'" in job.text()
    assert (folder / "study.toml").exists()
    assert not list(tmp_path.rglob("owned"))


def short_starts(folder, runs):
    """A PYTHONPATH on which a rank has time for some runs in each start."""
    (folder / "sitecustomize.py").write_text(SHORT.replace("LIMIT", str(runs)))
    return str(folder)


def test_slurms_warning_stops_a_start_in_time(study, reference, tmp_path):
    slurm = Slurm(tmp_path / "slurm", PYTHONPATH=str(slow_steps(tmp_path)))
    script = written([study.path], slurm.work, "slurm")
    # Time is counted in runs that have ended: the warning comes after the first.
    slurm.clock = lambda: ended(slurm.work / "runs")
    jobs = slurm.submit(script, limit="181", signal="B:USR1@180")
    assert [job.name for job in jobs] == ["7_0", "7_1"]
    for job in jobs:
        slurm.run(job)
        job.options["limit"] = "inf"
    assert jobs[0].restarts >= 1, jobs[0].text()
    assert jobs[0].text().count("study: not done yet") == jobs[0].restarts
    assert [job.code for job in jobs] == [0, 0]
    assert table(study, slurm.work / "runs") == reference


def ended(root):
    statuses = [read_status(path) for path in Path(root).glob("cases/*")]
    return sum(s is not None and s.state == "completed" for s in statuses)


def test_a_cancelled_job_does_not_come_back(study, tmp_path):
    slurm = Slurm(tmp_path / "slurm", PYTHONPATH=str(slow_steps(tmp_path)))
    script = written([study.path], slurm.work, "slurm")
    slurm.clock = lambda: ended(slurm.work / "runs")
    job, _ = slurm.submit(script, limit="1", signal="none@0")
    slurm.run(job)
    assert job.timed_out
    assert job.restarts == 0
    assert "study: told to end; submit it again to continue" in job.text()
    assert 1 <= ended(slurm.work / "runs") < 4


def test_the_stop_file_ends_the_chain(study, tmp_path):
    slurm = Slurm(tmp_path / "slurm")
    script = written([study.path], slurm.work, "slurm")
    folder = slurm.work / "runs/studies/small"
    folder.mkdir(parents=True)
    (folder / "stop").touch()
    job, _ = slurm.submit(script)
    slurm.run(job)
    assert (job.code, job.restarts) == (75, 0)
    assert "not started again because of the file 'stop'" in job.text()


def test_a_start_that_makes_no_step_is_not_repeated(study, tmp_path):
    slurm = Slurm(tmp_path / "slurm", PYTHONPATH=short_starts(tmp_path, 0))
    script = written([study.path], slurm.work, "slurm")
    job, _ = slurm.submit(script)
    slurm.run(job)
    assert (job.code, job.restarts) == (75, 0)
    assert "this start has not made a single step" in job.text()


def test_a_pbs_array_runs_the_study_in_several_starts(study, reference, tmp_path):
    pbs = Pbs(tmp_path / "pbs", PYTHONPATH=short_starts(tmp_path, 2))
    script = written([study.path], pbs.work, "pbs")
    pbs.submit("-J", "0-1", script)
    jobs = pbs.run()
    assert len(jobs) >= 3
    assert "study: not done yet" in jobs[0].text()
    assert {job.code for job in jobs} == {0, 75}
    assert jobs[-1].code == 0
    assert table(study, pbs.work / "runs") == reference
