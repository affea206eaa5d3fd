"""What snapshots and checkpoints share; see also test_snapshot.py."""

import subprocess
import sys
import time

import h5py
import pytest
from launch import launch

from mpisph.io.particle_file import store_text, stored_text

# Ranks that write a file, while something happens to the disk. HDF5 hangs or crashes
# where it finds no room.
WRITING = """
import os, shutil, sys, time
from pathlib import Path
import h5py, numpy as np
from mpi4py import MPI
import mpisph.io.particle_file as module
from mpisph.io.checkpoint import read_checkpoint, write_checkpoint
from mpisph.core.particles import Particles

comm, folder, n = MPI.COMM_WORLD, Path(sys.argv[1]), 4000
mine = Particles.zeros(len(range(comm.rank, n, comm.size)))
mine.id[:] = range(comm.rank, n, comm.size)
{prelude}
path = write_checkpoint(comm, folder, 1, mine, n, "state")
assert read_checkpoint(comm, path).n_total == n
"""

FULL = """
prepare = module._prepare
def prepare_and_fill(*arguments):
    prepare(*arguments)
    with (folder / "filler").open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, shutil.disk_usage(folder).free)
module._prepare = prepare_and_fill
"""

HANGING = """
def fail(*_):
    raise OSError(5, "broken")
if comm.rank == 1:
    module._write_column = fail
    h5py.File.close = lambda file: time.sleep(1000)
"""


@pytest.mark.parametrize("text", ["", "a", "µ Größe\n", "x" * 100_000, "é" * 40_000])
def test_texts_of_any_length_come_back(tmp_path, text):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        store_text(file, "text", text)
    with h5py.File(tmp_path / "a.h5") as file:
        assert stored_text(file, "text") == text


TAKEN = """
import ctypes
name = b"OMPIO_checkpoint_000000001.part"
ctypes.CDLL(None).sem_open(name, os.O_CREAT, 0o644, 0)
import atexit
atexit.register(ctypes.CDLL(None).sem_unlink, name)
"""


def test_a_semaphore_that_a_killed_run_has_left_keeps_nobody(tmp_path):
    """Open MPI's are of the whole machine, and bear the name of the file."""
    program = WRITING.format(prelude=TAKEN)
    done = launch(1, sys.executable, "-c", program, tmp_path, timeout=30)
    assert done.returncode == 0, done.stderr


LONG = """
for _ in range(5):
    folder = folder / ("x" * 250)
if comm.rank == 0:
    folder.mkdir(parents=True)
"""

NO_PROC = (
    LONG
    + """
module._short_name = lambda *_: Path("/nowhere/x")
"""
)


@pytest.mark.parametrize("ranks", [1, 2])
def test_a_path_may_be_long(tmp_path, ranks):
    """Open MPI aborts in the C library, with exit code 134, from 250 bytes on."""
    done = launch(ranks, sys.executable, "-c", WRITING.format(prelude=LONG), tmp_path)
    assert done.returncode == 0, done.stderr


def test_a_path_too_long_for_mpi_is_refused_where_it_cannot_be_shortened(tmp_path):
    done = launch(2, sys.executable, "-c", WRITING.format(prelude=NO_PROC), tmp_path)
    assert done.returncode == 1
    assert "longer than the 240 bytes that MPI takes here: " in done.stderr
    assert "Abort" not in done.stderr


def test_a_disk_that_becomes_full_while_a_file_is_written(tmp_path):
    """The file has its room already."""
    mount = ("mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", tmp_path)
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("mounting a file system takes root")
    try:
        program = WRITING.format(prelude=FULL)
        done = launch(2, sys.executable, "-c", program, tmp_path, timeout=30)
    finally:
        subprocess.run(("umount", "--lazy", tmp_path), check=True)
    assert done.returncode == 0, done.stderr


def test_a_file_that_cannot_be_closed_ends_all_ranks(tmp_path):
    begin = time.monotonic()
    program = WRITING.format(prelude=HANGING)
    done = launch(2, sys.executable, "-c", program, tmp_path, timeout=60)
    assert time.monotonic() - begin < 15.0
    assert done.returncode != 0
    (part,) = (tmp_path / "checkpoints").iterdir()
    assert part.match("checkpoint_000000001.*.part")
