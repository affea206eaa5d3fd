"""The log of a run."""

import os

import pytest
from mpi4py import MPI

from mpisph.io.run_log import LOG_FILE, RunLog


@pytest.mark.parametrize("kind", ["folder", "pipe"])
def test_what_is_no_file_is_set_aside(kind, tmp_path):
    """A pipe without a reader would keep the run for ever."""
    path = tmp_path / LOG_FILE
    if kind == "folder":
        path.mkdir()
    else:
        os.mkfifo(path)
    with RunLog(tmp_path, MPI.COMM_SELF) as log:
        log.say("begun")
    assert path.read_text() == "begun\n"
    assert path.with_name(f"{LOG_FILE}.damaged").exists()
