"""A run as its folder holds it, ended or not."""

import shutil

import pytest
from mpi4py import MPI
from small_runs import unended

from mpisph.core.errors import MpisphError
from mpisph.io.lock import FolderLock
from mpisph.io.result import read_result
from mpisph.io.stored_run import read_run


def test_a_finished_run(finished):
    run = read_run(finished)
    result = read_result(finished / "result.json")
    assert (run.name, run.state) == ("finished", "completed")
    assert run.result == result
    assert run.clouds == result.clouds
    assert run.particles == result.particles == 128
    assert run.provenance["revision"] == result.revision
    assert [time for _, time in run.snapshots] == [0.0, *run.case.output_times]
    assert run.history["time"][-1] == 2e-6
    assert run.case_text == (finished / "case.toml").read_text()


def test_a_run_that_has_not_ended_is_measured_as_a_finished_one(finished, tmp_path):
    folder = unended(tmp_path / "stopped", finished, state="stopped", reason="SIGTERM")
    run, whole = read_run(folder), read_run(finished)
    assert run.result is None
    assert run.state == "stopped"
    assert run.clouds == whole.clouds
    assert run.comparisons == whole.comparisons
    assert run.particles == whole.particles
    assert run.provenance == whole.provenance


def test_a_running_run_at_which_nobody_works_was_killed(finished, tmp_path):
    folder = unended(tmp_path / "run", finished, state="running")
    assert read_run(folder).state == "killed"
    with FolderLock(MPI.COMM_SELF, folder):
        assert read_run(folder).state == "running"


def test_snapshots_that_have_been_removed_are_left_out(finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "run")
    (folder / "snapshots/snapshot_00001.vtkhdf").unlink()
    assert len(read_run(folder).snapshots) == len(read_run(finished).snapshots) - 1
    shutil.rmtree(folder / "snapshots")
    (folder / "history.csv").unlink()
    (folder / "log.txt").unlink()
    run = read_run(folder)
    assert run.snapshots == []
    assert len(run.history) == 0
    (folder / "result.json").unlink()
    run = read_run(folder)
    assert (run.particles, run.provenance, run.clouds) == (None, {}, ())
    assert [c.outcome for c in run.comparisons] == ["not reached"] * 8


def test_warnings_are_taken_from_the_log_once(finished, tmp_path):
    folder = shutil.copytree(finished, tmp_path / "run")
    assert read_run(folder).warnings == []
    with (folder / "log.txt").open("a") as log:
        log.write("warning: no room\nno warning: here\nwarning: no room\n")
    assert read_run(folder).warnings == ["no room"]


def test_a_folder_of_no_run_is_named(tmp_path):
    with pytest.raises(MpisphError, match=r"status\.json; is it a run's folder\?"):
        read_run(tmp_path)
    with pytest.raises(MpisphError, match="nowhere"):
        read_run(tmp_path / "nowhere")


@pytest.mark.parametrize("name", ["result.json", "history.csv"])
def test_a_damaged_file_is_named(finished, tmp_path, name):
    folder = shutil.copytree(finished, tmp_path / "run")
    (folder / name).write_text("{}\n")
    with pytest.raises(MpisphError, match=name):
        read_run(folder)
