"""Damaged files in a run's folder: every command says which, or does without it."""

import itertools
import os
import random
import shutil
import signal
from contextlib import contextmanager

import click
import pytest
from click.testing import CliRunner
from run_folders import differences
from small_runs import EXPOSED, small_run

from mpisph.cli.main import cli
from mpisph.core.errors import CaseError, CollectiveError, MpisphError
from mpisph.run.checkpointing import CheckpointPolicy
from mpisph.run.signals import SignalHandler, StopRequest

PATIENCE = 30
# Longest time that a command may take [s]: one that waits for a FIFO never ends.


def truncated(path):
    os.truncate(path, path.stat().st_size // 2)


def emptied(path):
    os.truncate(path, 0)


def overwritten(path):
    data = random.Random(str(path.name)).randbytes(path.stat().st_size)
    path.write_bytes(data)


def flipped(path):
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x15
    path.write_bytes(data)


def removed(path):
    path.unlink()


def made_a_folder(path):
    path.unlink()
    path.mkdir()


def made_a_pipe(path):
    path.unlink()
    os.mkfifo(path)


def made_a_dangling_link(path):
    path.unlink()
    path.symlink_to(path.with_name("nowhere"))


DAMAGES = (
    truncated, emptied, overwritten, flipped, removed, made_a_folder, made_a_pipe,
    made_a_dangling_link,
)  # fmt: skip

FILES = (
    "case.toml",
    "status.json",
    "result.json",
    "history.csv",
    "log.txt",
    "snapshots.vtkhdf.series",
    "first snapshot",
    "last snapshot",
    "last checkpoint",
    "first checkpoint",
)

COMMANDS = ("status", "resume", "figures", "report", "animate", "clock")

CHANCES = [
    chance
    for chance in itertools.product(("stopped", "completed"), FILES, DAMAGES, COMMANDS)
    if chance[:2] != ("stopped", "result.json")  # which it has not
]


# Both exposures are reached, as `mpisph clock` asks for.
SETTINGS = (
    *EXPOSED,
    "measured.exposures.1.time=1.5us",
    "measured.exposures.1.radius=9 mm",
    "measured.exposures.1.length=5 mm",
)


@pytest.fixture(scope="module")
def completed(tmp_path_factory):
    """A run that has ended; not to be written into."""
    folder = tmp_path_factory.mktemp("runs") / "completed"
    assert small_run(folder, *SETTINGS).status == "completed"
    return folder


@pytest.fixture(scope="module")
def stopped(tmp_path_factory):
    """A run that was stopped halfway, with two checkpoints; not to be written into."""
    folder = tmp_path_factory.mktemp("runs") / "stopped"
    steps = iter(range(10_000))
    every = {40: StopRequest.CHECKPOINT, 60: StopRequest.STOP_FILE}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(CheckpointPolicy, "request", lambda *_: every.get(next(steps), 0))
        assert small_run(folder, *SETTINGS).status == "stopped"
    return folder


def pytest_generate_tests(metafunc):
    if "chance" in metafunc.fixturenames:
        count = metafunc.config.getoption("--damaged-files")
        chosen = random.Random(1).sample(CHANCES, min(count, len(CHANCES)))
        names = [f"{s}-{f}-{d.__name__}-{c}" for s, f, d, c in chosen]
        metafunc.parametrize("chance", chosen, ids=names)


def path_of(folder, name):
    """The file of a name in `FILES`."""
    kind, _, what = name.partition(" ")
    if what:
        return sorted((folder / f"{what}s").iterdir())[-(kind == "last")]
    return folder / name


@contextmanager
def patience():
    def give_up(*_):
        raise TimeoutError("the command hangs")

    before = signal.signal(signal.SIGALRM, give_up)
    signal.alarm(PATIENCE)
    try:
        yield
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def call_here(*arguments):
    """Run a command in this process: its exit code, and all that it says."""
    with patience():
        done = CliRunner().invoke(
            cli, list(map(str, arguments)), obj=SignalHandler(), standalone_mode=False
        )
    error = done.exception
    if error is None or isinstance(error, SystemExit):
        code = done.return_value if error is None else error.code
        return code or 0, done.output
    foreseen = (CaseError, CollectiveError, MpisphError, click.ClickException)
    if not isinstance(error, foreseen):
        raise error
    text = error.format_message() if isinstance(error, click.ClickException) else error
    return 2, f"{done.output}\n{text}"


def test_what_is_damaged_is_named_or_not_needed(chance, stopped, completed, tmp_path):
    state, name, damage, command = chance
    source = {"stopped": stopped, "completed": completed}[state]
    folder = shutil.copytree(source, tmp_path / "run")
    path = path_of(folder, name)
    damage(path)
    code, text = call_here(command, folder)
    if code:
        told = state == "stopped" and command == "clock" and "not a completed" in text
        assert told or path.name in text, text
    resumed = command == "resume" and state == "stopped"  # what has ended stays so
    if resumed and code == 0 and path.name not in text:
        with patience():
            assert not differences(folder, completed), text
