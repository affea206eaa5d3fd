"""Running a study: what is run, by whom, and what happens when it goes wrong."""

import json
import signal
import subprocess
import time

import pytest
from launch import MPISPH, environment, launch
from mpi4py import MPI
from oracles import agree
from rich.console import Console
from run_folders import slow_steps
from scheduler import kill, processes
from studies import ALPHA, UNSTABLE, small_study

from mpisph.core.errors import MpisphError
from mpisph.io.lock import FolderLock, in_use
from mpisph.io.status import StatusFile, read_status
from mpisph.parallel.collectives import from_root, on_root
from mpisph.study.model import load_study
from mpisph.study.runner import Outcome, Part, _to_do, run_study
from mpisph.study.store import case_folder, counts, look_up_all
from mpisph.study.table import collect

TEXT = small_study("0.3 us", nph=(1.5, 2.0, 2.5)) + ALPHA
VARIED = (
    small_study(
        "0.3 us", nph=(1.5, 2.0, 2.5), variants=(("one", ""), ("two", UNSTABLE))
    )
    + ALPHA
)


def write_study(folder, text=TEXT):
    path = folder / "small.toml"
    path.write_text(text)
    return path


def study_in(comm, folder, text=TEXT):
    return from_root(comm, lambda: load_study(write_study(folder, text)))


def quiet():
    return Console(quiet=True)


def done_by(study, root):
    """How often each run of a study has been started, and on how many ranks."""
    found = [read_status(case_folder(root, c)) for c in study.cases]
    return [(s.state, s.starts, s.ranks) for s in found]


def outcomes(study, root):
    """What the runs of a study have come to, but for the time on the wall clock."""
    rows = collect(study, root)
    return [{k: v for k, v in row.items() if k != "wall_s"} for row in rows]


@pytest.mark.mpi
def test_each_case_is_run_once_by_groups_of_any_size(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    study = study_in(comm, mpi_tmp_path)
    problems = []
    tables = []
    for ranks in sorted({1, comm.size, comm.size // 2 or 1}):
        root = mpi_tmp_path / f"by{ranks}"
        outcome = run_study(study, comm, root, quiet(), ranks_per_case=ranks)
        if outcome != Outcome(6, 0, 0, 0, 0, False):
            problems.append(f"{ranks} ranks a case: {outcome}")
        for state, starts, size in done_by(study, root):
            # The last group has what is left over.
            if (state, starts) != ("completed", 1) or not ranks <= size < 2 * ranks:
                problems.append(f"{ranks} ranks a case: {state}, {starts}, {size}")
        tables.append(outcomes(study, root))
    if any(table != tables[0] for table in tables):
        problems.append("the tables differ")
    agree(comm, problems)


@pytest.mark.mpi
def test_a_second_start_runs_nothing(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    study = study_in(comm, mpi_tmp_path)
    root = mpi_tmp_path / "runs"
    run_study(study, comm, root, quiet())
    before = outcomes(study, root)
    comm.Barrier()
    again = run_study(study, comm, root, quiet())
    after = outcomes(study, root)
    same = before == after and {d[:2] for d in done_by(study, root)} == {
        ("completed", 1)
    }
    agree(comm, [] if same and again.completed == 6 else ["run twice"])


@pytest.mark.mpi
def test_neither_instability_nor_failure_stops_the_others(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    study = study_in(comm, mpi_tmp_path, VARIED)
    root = mpi_tmp_path / "runs"
    spoilt = case_folder(root, study.cases[2])

    def spoil():
        spoilt.mkdir(parents=True)
        (spoilt / "result.json").write_text("{}")  # of a run, but no status

    on_root(comm, spoil)
    outcome = run_study(study, comm, root, quiet())
    problems = []
    if outcome != Outcome(5, 6, 1, 0, 0, False):
        problems.append(f"{outcome}")
    rows = collect(study, root)
    if [row["status"] for row in rows[6:]] != ["unstable"] * 6:
        problems.append("not all unstable runs are rows")
    if rows[2]["status"] != "failed" or "no status.json" not in rows[2]["reason"]:
        problems.append(f"the failure is no row: {rows[2]}")
    agree(comm, problems)


@pytest.mark.mpi
def test_a_case_that_is_at_work_elsewhere_is_left_to_it(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    study = study_in(comm, mpi_tmp_path)
    root = mpi_tmp_path / "runs"
    busy = case_folder(root, study.cases[3])
    on_root(comm, lambda: busy.mkdir(parents=True))
    with FolderLock(comm, busy):
        outcome = run_study(study, comm, root, quiet())
        places = [place.standing for place in look_up_all(root, study.cases)]
        comm.Barrier()
    problems = [] if outcome == Outcome(5, 0, 0, 1, 0, False) else [f"{outcome}"]
    if places != ["completed"] * 3 + ["running"] + ["completed"] * 2:
        problems.append(f"{places}")
    agree(comm, problems)


@pytest.mark.parametrize("late", [False, True], ids=["seen", "after the look"])
@pytest.mark.parametrize("locks", [True, False], ids=["locks", "no locks"])
def test_a_live_run_is_neither_started_again_nor_written_to(
    tmp_path, monkeypatch, locks, late
):
    """Also where it began after this study has looked whether anybody is there."""
    study = load_study(write_study(tmp_path))
    folder = case_folder(tmp_path, study.cases[3])
    folder.mkdir(parents=True)

    def none(*_):
        raise OSError(95, "Operation not supported")

    if not locks:
        monkeypatch.setattr("mpisph.io.lock.fcntl.fcntl", none)
    for name, seconds in (("BEAT", 0.1), ("SETTLE", 0.1), ("PATIENCE", 0.1)):
        monkeypatch.setattr(f"mpisph.io.lock.{name}", seconds)
    with FolderLock(MPI.COMM_SELF, folder):
        status = StatusFile(MPI.COMM_SELF, folder, 1.0, starts=1)
        status.write("running", 7, 0.5)
        before = {path: path.read_bytes() for path in folder.iterdir()}
        if late:
            monkeypatch.setattr("mpisph.study.runner.in_use", lambda _: False)
        outcome = run_study(study, MPI.COMM_SELF, tmp_path, quiet())
        assert {path: path.read_bytes() for path in folder.iterdir()} == before
    assert outcome == Outcome(5, 0, 0, 1, 0, False)


def test_too_few_ranks_are_refused(tmp_path):
    study = load_study(write_study(tmp_path))
    with pytest.raises(
        MpisphError, match="2 ranks for each case, but mpirun started 1"
    ):
        run_study(study, MPI.COMM_SELF, tmp_path, quiet(), ranks_per_case=2)


def test_parts_begin_with_their_own_and_help_the_others(tmp_path):
    study = load_study(write_study(tmp_path))
    orders = [
        [todo.folder.name for todo in _to_do(study.cases, tmp_path, Part(k, 2))]
        for k in range(2)
    ]
    assert sorted(orders[0]) == sorted(orders[1]) == sorted(c.key for c in study.cases)
    assert set(orders[0][:3]) == set(orders[1][3:])
    whole = _to_do(study.cases, tmp_path, Part())
    work = [todo.work for todo in whole]
    assert work == sorted(work, reverse=True)


def test_what_has_failed_before_comes_last(tmp_path):
    study = load_study(write_study(tmp_path))
    first = _to_do(study.cases, tmp_path, Part())[0].folder
    first.mkdir(parents=True)
    status = {"state": "failed", "step": 0, "time": 0.0, "end_time": 1.0, "starts": 1}
    status |= {"ranks": 1, "host": "h", "pid": 1, "started": "", "updated": ""}
    (first / "status.json").write_text(json.dumps(status))
    assert _to_do(study.cases, tmp_path, Part())[-1].folder == first


def test_the_stop_file_of_a_study_keeps_it_from_beginning(tmp_path):
    study = load_study(write_study(tmp_path))
    folder = tmp_path / "studies" / "small"
    folder.mkdir(parents=True)
    (folder / "stop").touch()
    outcome = run_study(study, MPI.COMM_SELF, tmp_path, quiet())
    assert outcome == Outcome(0, 0, 0, 0, 6, True)


def start(folder, *arguments):
    return subprocess.Popen(
        ["mpirun", "--quiet", "-n", "2", MPISPH, "study", "run", *arguments],
        env=environment(PYTHONPATH=str(slow_steps(folder))),
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_while(condition):
    given_up = time.monotonic() + 60
    while condition():
        assert time.monotonic() < given_up
        time.sleep(0.02)


def completed(study, root):
    return counts(look_up_all(root, study.cases))["completed"]


def at_work(study, root):
    """Whether a rank holds a folder, though it be one that was killed."""
    return any(in_use(case_folder(root, case)) for case in study.cases)


@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGUSR1])
def test_a_study_that_is_ended_in_the_middle_goes_on(tmp_path, how):
    path = write_study(tmp_path)
    study = load_study(path)
    reference = tmp_path / "reference"
    run_study(study, MPI.COMM_SELF, reference, quiet())
    root = tmp_path / "runs"
    process = start(tmp_path, path)
    wait_while(lambda: completed(study, root) < 2)
    if how == signal.SIGKILL:
        kill(processes(process.pid), how)  # its ranks have groups of their own
    else:
        process.send_signal(how)
    text, _ = process.communicate(timeout=60)
    assert process.returncode == (75 if how == signal.SIGUSR1 else -how)
    if how == signal.SIGUSR1:
        assert "left" in text
    wait_while(lambda: at_work(study, root))
    before = {c.key: read_status(case_folder(root, c)) for c in study.cases}
    ended = [key for key, s in before.items() if s and s.state == "completed"]
    assert 2 <= len(ended) < 6
    again = launch(2, MPISPH, "study", "run", path, "-o", root)
    assert again.returncode == 0, again.stderr
    assert "6 completed, 0 unstable, 0 failed, 0 left" in again.stdout
    for key in ended:
        assert read_status(root / "cases" / key) == before[key]
    assert outcomes(study, root) == outcomes(study, reference)


def test_the_other_cases_go_on_where_one_meets_a_fault_of_the_program(tmp_path):
    study = load_study(write_study(tmp_path))
    bad = case_folder(tmp_path / "runs", study.cases[1])
    (tmp_path / "sitecustomize.py").write_text(
        "import os, sys\n"
        "if 'OMPI_COMM_WORLD_RANK' in os.environ:\n"
        "    from mpisph.run.output import RunOutput\n"
        "    add = RunOutput.add_step\n"
        "    def fail(self, sim, found):\n"
        f"        if self.folder.name == {bad.name!r} and sim.step == 3:\n"
        "            raise ZeroDivisionError('on purpose')\n"
        "        add(self, sim, found)\n"
        "    RunOutput.add_step = fail\n"
    )
    done = launch(
        2,
        MPISPH,
        "study",
        "run",
        study.path,
        "-o",
        tmp_path / "runs",
        PYTHONPATH=str(tmp_path),
    )
    assert done.returncode == 1, done.stderr
    assert "5 completed, 0 unstable, 1 failed, 0 left" in done.stdout
    assert "ZeroDivisionError: on purpose" in read_status(bad).reason
    (trace,) = bad.glob("mpisph-traceback-*.txt")
    assert "in fail" in trace.read_text()
