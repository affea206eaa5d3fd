"""An mpirun of another MPI is found out."""

import os
import subprocess

import pytest
from launch import MPISPH, environment, launch

from mpisph.core.launcher import Launch, launch_of, mismatch, step_without_mpi


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({}, None),
        ({"PATH": "/bin", "SLURM_NTASKS": "8"}, None),
        ({"OMPI_COMM_WORLD_SIZE": "4", "OMPI_COMM_WORLD_RANK": "2"}, (4, 2)),
        ({"PMI_SIZE": "3", "PMI_RANK": "1"}, (3, 1)),
        ({"SLURM_STEP_NUM_TASKS": "16", "SLURM_PROCID": "15"}, (16, 15)),
        # An Open MPI below srun: one daemon a node, two processes each.
        ({"SLURM_STEP_NUM_TASKS": "2", "OMPI_COMM_WORLD_SIZE": "4"}, (4, 0)),
        ({"PMI_SIZE": "many"}, None),
    ],
)
def test_what_a_launcher_says(variables, expected):
    got = launch_of(variables)
    assert (got and (got.size, got.rank)) == expected


def test_processes_that_find_each_other_are_well():
    assert mismatch(None, 1, "X") is None
    assert mismatch(Launch("mpirun", 4, 0), 4, "X") is None
    assert mismatch(Launch("srun", 1, 0), 1, "X") is None
    # A communicator may be larger than what one of two launchers says.
    assert mismatch(Launch("srun", 2, 0), 8, "X") is None


def test_processes_that_do_not_are_told_why():
    text = mismatch(Launch("the mpirun of MPICH or Intel MPI", 4, 0), 1, "Open MPI v4")
    assert "MPICH or Intel MPI has started 4 processes" in text
    assert "alone" in text
    assert "Open MPI v4" in text


# What srun sets for the tasks of a step; Open MPI takes it for a start by PMI.
STEP = {
    "SLURM_NODELIST": os.uname().nodename,
    "SLURM_JOBID": "1",
    "SLURM_STEP_ID": "0",
    "SLURM_STEP_NUM_TASKS": "2",
    "SLURM_PROCID": "0",
}


def test_tasks_of_srun_without_mpi_are_told_how_to_start():
    said = step_without_mpi({**STEP})
    assert "srun has started 2 tasks without MPI" in said
    assert "srun --mpi=pmix" in said
    assert "`mpirun` within the job" in said
    assert step_without_mpi({**STEP, "SLURM_PROCID": "1"}) == ""


@pytest.mark.parametrize(
    "variables",
    [
        {},
        {"SLURM_NTASKS": "8", "SLURM_JOB_ID": "1", "SLURM_PROCID": "0"},  # a batch job
        {**STEP, "PMIX_RANK": "0"},  # srun --mpi=pmix
        {**STEP, "PMI_RANK": "0"},  # srun --mpi=pmi2
        {**STEP, "OMPI_COMM_WORLD_SIZE": "1", "OMPI_COMM_WORLD_RANK": "0"},  # mpirun
    ],
)
def test_who_can_meet_or_is_in_no_step_is_left_alone(variables):
    before = dict(variables)
    assert step_without_mpi(variables) is None
    assert variables == before


@pytest.mark.parametrize(
    "variables",
    [
        {**STEP, "SLURM_STEP_NUM_TASKS": "1"},  # the shell of salloc
        {**STEP, "SLURM_PTY_PORT": "40001"},  # srun -n 2 --pty bash
    ],
)
def test_a_single_process_needs_no_plugin(variables):
    assert step_without_mpi(variables) is None
    assert not variables.keys() & {"SLURM_STEP_ID", "SLURM_STEP_NUM_TASKS"}


@pytest.mark.slow
@pytest.mark.parametrize(("tasks", "code"), [("1", 0), ("2", 2)])
def test_srun_is_met_before_mpi_starts(tasks, code):
    """Open MPI would end the process with a page on how to build it."""
    done = subprocess.run(
        [MPISPH, "--version"],
        env=environment(**{**STEP, "SLURM_STEP_NUM_TASKS": tasks}),
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )
    assert done.returncode == code
    assert done.stderr.count("\n") == (code != 0)
    assert done.stderr.startswith("mpisph: srun has started"[: 30 * (code != 0)])


@pytest.mark.slow
def test_mpisph_explains_it_once_and_writes_nothing(tmp_path):
    """Two processes as MPICH's mpirun would start them, each alone in its world."""
    outputs = []
    for rank in range(2):
        done = subprocess.run(
            [MPISPH, "run", "case.toml"],
            env=environment(PMI_SIZE="2", PMI_RANK=str(rank)),
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
            timeout=60,
        )
        assert done.returncode == 2
        outputs.append(done.stderr)
    assert outputs[0].count("\n") == 1
    assert "has started 2 processes, but each finds itself alone" in outputs[0]
    assert outputs[1] == ""
    assert list(tmp_path.iterdir()) == []


def test_no_mpi_library_is_explained():
    done = launch(1, "env", "MPI4PY_LIBMPI=/no/libmpi.so", MPISPH, "--version")
    assert done.returncode == 1
    assert done.stderr.startswith("mpisph: no MPI library could be loaded: ")
    assert done.stderr.count("\n") == 1
    assert os.path.basename("/no/libmpi.so") in done.stderr
