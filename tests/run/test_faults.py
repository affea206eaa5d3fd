"""Runs that are killed, stopped or short of room: nothing is lost."""

import os
import random
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

import pytest
from launch import CASES, MPISPH, PATIENCE, call, environment, launch
from run_folders import assert_same, outcome, slow_steps, status

from mpisph.io.checkpoint import find_checkpoints
from mpisph.io.snapshot import read_series, read_snapshot

SHOT = CASES / "piekutowski-4-1353.toml"

# Much output for few steps, so that a kill at random often meets a file being written.
SETTINGS = (
    "resolution.npr=5",
    "time.end=3us",
    "output.every=0.1us",
    "output.figures=false",
    "checkpoints.interval=0.03us",
)
OPTIONS = [word for text in SETTINGS for word in ("--set", text)]
RUN = ("run", SHOT, *OPTIONS, "-o")


@pytest.fixture(scope="session")
def uninterrupted(tmp_path_factory):
    """The folder of the run that nothing has interrupted."""
    folder = tmp_path_factory.mktemp("runs") / "uninterrupted"
    done = call(*RUN, folder)
    assert done.returncode == 0, done.stderr
    return folder


LAUNCHERS = []


@pytest.fixture(autouse=True)
def nothing_left_running():
    """End what a test that has failed leaves behind."""
    yield
    while LAUNCHERS:
        launcher = LAUNCHERS.pop()
        if launcher.poll() is None:
            for pid in [*ranks_of(launcher).values(), launcher.pid]:
                os.kill(pid, signal.SIGKILL)
            launcher.communicate()


def begin(ranks, *arguments, **more):
    """Start mpisph under mpirun and return the process of mpirun."""
    launcher = subprocess.Popen(
        ["mpirun", "--quiet", "-n", str(ranks), MPISPH, *map(str, arguments)],
        env=environment(**more),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    LAUNCHERS.append(launcher)
    return launcher


def ranks_of(launcher):
    """The processes of the ranks below a launcher, by their rank."""
    found = {}
    try:
        tasks = Path(f"/proc/{launcher.pid}/task/{launcher.pid}")
        children = (tasks / "children").read_text()
    except OSError:  # it has ended
        return found
    for pid in map(int, children.split()):
        try:
            variables = Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
        except OSError:
            continue
        for variable in variables:
            if variable.startswith(b"OMPI_COMM_WORLD_RANK="):
                found[int(variable.partition(b"=")[2])] = pid
    return found


def wait_until(condition, timeout=60.0):
    """Wait for a condition; the time limit is for what never comes."""
    start = time.monotonic()
    while not condition():
        assert time.monotonic() - start < timeout, "waited in vain"
        time.sleep(0.01)


def gone(pids):
    return not any(Path(f"/proc/{pid}").exists() for pid in pids)


def begin_and_wait(folder, ranks, *arguments, checkpoints=1, **more):
    """Start a run, and return once it has written some checkpoints.

    Its steps take longer, so that it has not ended by then.
    """
    more["PYTHONPATH"] = str(slow_steps(folder.parent, seconds=0.01))
    launcher = begin(ranks, *arguments, **more)
    wait_until(
        lambda: (
            len(find_checkpoints(folder)) >= checkpoints or launcher.poll() is not None
        )
    )
    assert launcher.poll() is None, launcher.communicate()[1]
    return launcher


def begun(folder):
    """How many starts have come to work in a folder."""
    path = folder / "status.json"
    return status(folder)["starts"] if path.exists() else 0


def test_killed_at_random_and_resumed_until_done(killed_run, tmp_path, uninterrupted):
    folder = tmp_path / "run"
    rng = random.Random(killed_run)
    launcher = begin(2, *RUN, folder)
    kills, writing = 0, 0
    for start in range(1, 5):
        wait_until(
            lambda n=start, now=launcher: begun(folder) >= n or now.poll() is not None
        )
        time.sleep(rng.uniform(0.0, 0.8))
        pids = ranks_of(launcher)
        if launcher.poll() is not None or not pids:
            break  # it was faster
        whole = (killed_run + start) % 2 == 0
        doomed = launcher.pid if whole else rng.choice(list(pids.values()))
        os.kill(doomed, signal.SIGKILL)
        wait_until(lambda pids=pids: gone(pids.values()))
        launcher.communicate()
        kills, writing = kills + 1, writing + len(list(folder.rglob("*.part")))
        for path, _ in read_series(folder):
            read_snapshot(path)
        launcher = begin(rng.choice([1, 2, 3]), *RUN, folder)
    out, err = launcher.communicate(timeout=60)
    print(f"killed {kills} times, {writing} times while a file was written")
    assert launcher.returncode == 0, err
    assert "completed: " in out
    assert_same(folder, uninterrupted)


# How a run is stopped, and on how many ranks it has come so far.
STOPS = (("SIGTERM", 2), ("SIGUSR1", 1), ("SIGINT", 3), ("file", 4))


def test_stopped_and_resumed_on_other_numbers_of_ranks(tmp_path, uninterrupted):
    """One run, stopped in each way in turn."""
    folder = tmp_path / "run"
    slow = {"PYTHONPATH": str(slow_steps(tmp_path, seconds=0.02))}
    command, last = (*RUN, folder), None
    for starts, (stop, ranks) in enumerate(STOPS, 1):
        launcher = begin(ranks, *command, **slow)
        wait_until(
            lambda last=last, now=launcher: (
                find_checkpoints(folder)[:1] not in ([], [last])
                or now.poll() is not None
            )
        )
        assert launcher.poll() is None, launcher.communicate()[1]
        if stop == "file":
            (folder / "stop").touch()
        else:
            # To a rank alone: all must agree. (Of mpirun itself, SIGTERM would end it.)
            os.kill(ranks_of(launcher)[ranks - 1], getattr(signal, stop))
        _, err = launcher.communicate(timeout=60)
        assert launcher.returncode == 75, err
        assert f"`mpisph resume {folder}` continues it" in err
        assert err.count("file stop") == err.count("is gone") == (stop == "file")
        assert ("continuing from checkpoint_" in err) == (starts > 1)
        now = status(folder)
        assert (now["state"], now["starts"]) == ("stopped", starts)
        assert now["reason"] == ("file stop" if stop == "file" else f"signal {stop}")
        last = find_checkpoints(folder)[0]
        assert last.stem == f"checkpoint_{now['step']:09d}"
        # The same command continues it, and one that needs the folder alone.
        command = (*RUN, folder) if starts % 2 else ("resume", folder)
    # The file keeps the run from continuing.
    assert call("resume", folder).returncode == 75
    assert status(folder)["step"] == now["step"]
    (folder / "stop").unlink()
    done = call("resume", folder)
    assert done.returncode == 0, done.stderr
    assert_same(folder, uninterrupted)


def test_stopped_by_the_wall_time_limit_and_resumed(tmp_path, uninterrupted):
    folder = tmp_path / "run"
    slow = {"PYTHONPATH": str(slow_steps(tmp_path, seconds=0.1))}
    for limit in (4, 8, 16):
        done = launch(2, MPISPH, *RUN, folder, "--walltime", f"{limit}s", **slow)
        if "before any step" not in done.stderr:
            break  # else a busy machine starts more slowly
    assert done.returncode == 75, done.stderr
    assert status(folder)["reason"] == "wall-time limit"
    done = call(*RUN, folder)
    assert done.returncode == 0, done.stderr
    assert_same(folder, uninterrupted)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGUSR1])
def test_a_signal_to_the_launcher_stops_the_run(number, tmp_path):
    folder = tmp_path / "run"
    launcher = begin_and_wait(folder, 2, *RUN, folder, **{PATIENCE: "2"})
    launcher.send_signal(number)
    launcher.communicate(timeout=30)
    # Open MPI's launcher, told to end, returns 1 whatever its ranks return.
    assert launcher.returncode == (75 if number == signal.SIGUSR1 else 1)
    assert status(folder)["state"] == "stopped"


def test_a_killed_rank_ends_all_with_one_message(tmp_path):
    folder = tmp_path / "run"
    launcher = begin_and_wait(folder, 3, *RUN, folder, **{PATIENCE: "1"})
    pids = ranks_of(launcher)
    os.kill(pids[1], signal.SIGKILL)
    wait_until(lambda: gone(pids.values()))
    _, err = launcher.communicate(timeout=30)
    assert launcher.returncode not in (0, 2, 3, 75)
    assert err.count("mpisph: ") == 1
    assert f"mpisph: rank 1 of 3 has died (process {pids[1]} on" in err
    assert "Traceback" not in err
    now = status(folder)
    assert now["state"] == "failed"
    assert now["reason"].startswith("rank 1 of 3 has died")


def test_a_finished_run_is_not_repeated(tmp_path, uninterrupted):
    before = {p: p.stat().st_mtime_ns for p in uninterrupted.rglob("*")}
    again = launch(2, MPISPH, *RUN, uninterrupted)
    for done in (again, call("resume", uninterrupted)):
        assert done.returncode == 0
        assert done.stderr.count("holds a run that is completed") == 1
        assert "completed: " in done.stdout
    lock = uninterrupted / ".lock"
    after = {p: p.stat().st_mtime_ns for p in uninterrupted.rglob("*")}
    assert {**after, lock: 0} == {**before, lock: 0}


def test_force_starts_over(tmp_path):
    short = ("run", SHOT, *OPTIONS, "--set", "time.end=0.3us", "-o", tmp_path / "run")
    assert call(*short).returncode == 0
    (tmp_path / "run/snapshots/snapshot_00077.vtkhdf").touch()
    coarser = (*short, "--set", "resolution.npr=4")
    done = call(*coarser)
    assert done.returncode == 2
    assert "run of another case (resolution.npr: 5, now 4)" in done.stderr
    done = call(*coarser, "--force")
    assert done.returncode == 0, done.stderr
    assert status(tmp_path / "run")["starts"] == 1
    assert len(list((tmp_path / "run/snapshots").iterdir())) == 4


def test_the_second_run_in_a_folder_is_refused(tmp_path):
    folder = tmp_path / "run"
    first = begin_and_wait(folder, 2, *RUN, folder)
    ranks = ranks_of(first).values()
    for pid in ranks:  # it must not end meanwhile
        os.kill(pid, signal.SIGSTOP)
    try:
        for command in (("resume", folder), (*RUN, folder, "--force")):
            second = call(*command)
            assert second.returncode == 1
            assert second.stderr.count("another run is at work here, process ") == 1
    finally:
        for pid in ranks:
            os.kill(pid, signal.SIGCONT)
    (folder / "stop").touch()
    _, err = first.communicate(timeout=60)
    assert first.returncode == 75, err


def test_a_folder_that_vanishes_is_an_error(tmp_path):
    folder = tmp_path / "run"
    launcher = begin_and_wait(folder, 2, *RUN, folder)
    folder.rename(tmp_path / "elsewhere")
    _, err = launcher.communicate(timeout=30)
    assert launcher.returncode == 1
    assert err.count("mpisph: ") == 1
    assert "No such file or directory" in err
    assert str(folder) in err
    assert not folder.exists()
    for path, _ in read_series(tmp_path / "elsewhere"):
        read_snapshot(path)


def test_too_short_a_wall_time_is_said(tmp_path):
    folder = tmp_path / "run"
    done = call(*RUN, folder, "--walltime", "1s")
    assert done.returncode == 75
    assert "stopped (wall-time limit, before any step) at step 0" in done.stderr
    assert status(folder)["state"] == "stopped"
    assert not (folder / "checkpoints").exists()


# mpisph with a rank that kills itself at a chosen moment: where a function is called
# for the n-th time, before it does anything or after.
KILLER = """
import importlib, os, signal, sys
from mpi4py import MPI

module, name, calls, rank, when = sys.argv.pop(1).split(":")
place = importlib.import_module(module)
*within, name = name.split(".")
for part in within:
    place = getattr(place, part)
called = 0
original = getattr(place, name)

def deadly(*arguments, **options):
    global called
    called += 1
    due = called == int(calls) and MPI.COMM_WORLD.rank == int(rank)
    if due and when == "before":
        os.kill(os.getpid(), signal.SIGKILL)
    result = original(*arguments, **options)
    if due:
        os.kill(os.getpid(), signal.SIGKILL)
    return result

setattr(place, name, deadly)
from mpisph.cli.main import main
main()
"""


# The moments are counted, not timed: a run of any length will do.
BRIEF = (*RUN[:-1], "--set", "time.end=1us", "-o")


@pytest.fixture(scope="session")
def brief(tmp_path_factory):
    """The folder of a shorter run that nothing has interrupted."""
    folder = tmp_path_factory.mktemp("runs") / "brief"
    done = call(*BRIEF, folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(
    "moment",
    [
        # The 40th column of a file: in the middle of one that all ranks write.
        "mpisph.io.particle_file:_write_column:40:1:after",
        "mpisph.io.particle_file:_write_column:400:0:before",
        # Complete, but without its name; with its name, but not yet in the list.
        "mpisph.io.particle_file:replace_file:9:0:before",
        "mpisph.io.snapshot:_update_series:7:0:before",
        # A checkpoint with a digest that is not in it yet; one too many of them.
        "mpisph.io.checkpoint:_header:6:0:before",
        "mpisph.io.checkpoint:_prune:5:0:before",
        # In the middle of a step, and in the global reduction.
        "mpisph.solver.step:kick:80:1:after",
        "mpisph.solver.step:global_reduction:40:1:before",
        # At the very beginning and the very end.
        "mpisph.run.session:write_text:1:0:before",
        "mpisph.run.session:write_result:1:0:before",
        "mpisph.run.session:keep_last_checkpoint:1:0:before",
    ],
)
def test_killed_at_a_chosen_moment(moment, tmp_path, brief):
    folder = tmp_path / "run"
    done = launch(2, sys.executable, "-c", KILLER, moment, *BRIEF, folder)
    assert done.returncode not in (0, 1, 2, 3, 75), done.stderr
    for path, _ in read_series(folder):
        read_snapshot(path)
    done = call(*BRIEF, folder)
    assert done.returncode == 0, done.stderr
    assert_same(folder, brief)


@pytest.mark.parametrize(
    "moment",
    [
        "mpisph.figures.cloud:draw_cloud:2:0:before",
        "mpisph.run.session:_Session._draw:1:1:before",
    ],
)
def test_a_kill_while_figures_are_drawn_leaves_the_run_completed(
    moment, tmp_path, brief
):
    folder = tmp_path / "run"
    drawing = (*BRIEF, folder, "--set", "output.figures=true")
    done = launch(2, sys.executable, "-c", KILLER, moment, *drawing)
    assert done.returncode not in (0, 2, 3, 75), done.stderr
    assert status(folder)["state"] == "completed"
    assert outcome(folder)["clouds"] == outcome(brief)["clouds"]
    assert len(find_checkpoints(folder)) == 1
    again = call("resume", folder)
    assert again.returncode == 0
    assert "holds a run that is completed: nothing to do" in again.stderr
    assert call("figures", folder).returncode == 0
    assert len(list((folder / "figures").glob("cloud_*.png"))) == 11


@pytest.mark.parametrize(
    "moment",
    [
        # Before and after it is no longer the run that has ended.
        "mpisph.run.session:load_last_state:1:1:after",
        "mpisph.run.loop:make_step:5:1:after",
    ],
)
def test_killed_while_it_is_made_longer(moment, tmp_path, brief, longer):
    folder = shutil.copytree(brief, tmp_path / "run")
    ended = (folder / "result.json").read_bytes()
    command = ("resume", folder, "--set", "time.end=1.2us")
    done = launch(2, sys.executable, "-c", KILLER, moment, *command)
    assert done.returncode not in (0, 2, 3, 75), done.stderr
    assert (folder / "result.json").read_bytes() == ended
    state = "completed" if "load_last_state" in moment else "failed"
    assert status(folder)["state"] in {state, "running"}
    done = call(*command)
    assert done.returncode == 0, done.stderr
    got, want = outcome(folder), outcome(longer)
    for found in (got, want):  # the earlier ones hold the case of their time
        found["snapshots"] = list(found["snapshots"].values())[10:]
    assert [name for name in want if got[name] != want[name]] == []


@pytest.fixture(scope="session")
def longer(tmp_path_factory):
    """The folder of a run made in one go."""
    folder = tmp_path_factory.mktemp("runs") / "longer"
    done = call(*BRIEF, folder, "--set", "time.end=1.2us")
    assert done.returncode == 0, done.stderr
    return folder


@pytest.fixture
def small_disk(tmp_path):
    """A file system of 4 MB."""
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ("mount", "-t", "tmpfs", "-o", "size=4m", "tmpfs", disk)
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("mounting a file system takes root")
    yield disk
    subprocess.run(("umount", "--lazy", disk), check=True)


def fill(disk, left):
    """Fill a disk but for some bytes, and return the file that does."""
    filler = disk / "filler"
    size = shutil.disk_usage(disk).free - left
    with filler.open("wb") as file:
        os.posix_fallocate(file.fileno(), 0, size)
    return filler


@contextmanager
def between_files(launcher, folder):
    """Hold a run at a moment when it is writing no file."""
    writer = ranks_of(launcher)[0]
    while True:
        os.kill(writer, signal.SIGSTOP)
        time.sleep(0.05)
        if not list(folder.rglob("*.part")):
            break
        os.kill(writer, signal.SIGCONT)
        time.sleep(0.005)
    try:
        yield
    finally:
        os.kill(writer, signal.SIGCONT)


@pytest.mark.parametrize("left", [0, 600_000])
def test_a_full_disk_during_a_snapshot(left, small_disk, uninterrupted):
    folder = small_disk / "run"
    launcher = begin_and_wait(folder, 2, *RUN, folder)
    with between_files(launcher, folder):
        filler = fill(small_disk, left)
    _, err = launcher.communicate(timeout=30)
    assert launcher.returncode == 1
    assert err.count("mpisph: ") == 1
    assert "No space left on device" in err
    assert str(folder) in err
    if left:  # else the history or the log may be the first to find no room
        assert "for a snapshot of" in err
        assert status(folder)["state"] == "failed"
        assert "No space left on device" in status(folder)["reason"]
        assert f"`mpisph resume {folder}` continues from a checkpoint" in err
    for path, _ in read_series(folder):
        read_snapshot(path)
    filler.unlink()
    done = call("resume", folder)
    assert done.returncode == 0, done.stderr
    assert_same(folder, uninterrupted)


def test_a_full_disk_during_checkpoints_lets_the_run_continue(small_disk):
    folder = small_disk / "run"
    late = (*OPTIONS, "--set", "output.every=3us", "-o", folder)
    launcher = begin_and_wait(folder, 2, "run", SHOT, *late, checkpoints=2)
    with between_files(launcher, folder):
        filler = fill(small_disk, 600_000)
    log = folder / "log.txt"
    wait_until(lambda: "warning: no checkpoint at step" in log.read_text())
    filler.unlink()
    _, err = launcher.communicate(timeout=30)
    assert launcher.returncode == 0, err
    assert "No space left on device for a checkpoint of" in err


def test_a_full_disk_at_the_stop_keeps_the_last_checkpoint(small_disk, uninterrupted):
    folder = small_disk / "run"
    late = (*OPTIONS, "--set", "checkpoints.interval=0.5us", "-o", folder)
    launcher = begin_and_wait(folder, 2, "run", SHOT, *late)
    with between_files(launcher, folder):
        filler = fill(small_disk, 600_000)
        os.kill(ranks_of(launcher)[1], signal.SIGUSR1)
    _, err = launcher.communicate(timeout=30)
    assert launcher.returncode == 1
    assert "No space left on device for a" in err
    assert status(folder)["state"] == "failed"
    filler.unlink()
    done = call("resume", folder)
    assert done.returncode == 0, done.stderr
    assert "continuing from checkpoint_" in done.stderr
    assert outcome(folder)["clouds"] == outcome(uninterrupted)["clouds"]


def test_a_read_only_folder_is_an_error(small_disk, uninterrupted):
    folder = small_disk / "run"
    shutil.copytree(uninterrupted, folder)
    again = ("mount", "-o", "remount,ro", small_disk)
    subprocess.run(again, check=True)
    done = launch(2, MPISPH, *RUN, folder, "--force")
    assert done.returncode == 1
    assert done.stderr.count("mpisph: ") == 1
    assert "Read-only file system" in done.stderr
    assert str(folder) in done.stderr
    assert_same(folder, uninterrupted)
