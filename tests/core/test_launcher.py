"""An mpirun of another MPI is found out."""

import os
import subprocess

import pytest
from launch import MPISPH, environment, launch

from mpisph.core.launcher import Launch, launch_of, mismatch


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
        assert done.returncode == 1
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
