"""What all commands share: the entry point, and what happens to errors."""

import os
import subprocess
import sys
from pathlib import Path

import click
import pytest
from launch import CASES, MPISPH, call, environment, launch

from mpisph.cli.main import cli

SHOT = CASES / "piekutowski-4-1353.toml"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("run", "no-such-case.toml"), "no-such-case.toml: no such file"),
        (("run",), "Missing argument 'CASE...'"),
        (("run", SHOT, "--rank", "3"), "No such option '--rank'"),
        (("run", SHOT, "-o", ""), "expected a name without control characters"),
        (("run", SHOT, "-o", "a\nb"), "expected a name without control characters"),
        (("report", "no-such-run"), "no-such-run: no such folder"),
        (("run", SHOT, "--set", "time.cfl=-1"), "--set time.cfl=-1"),
        (("run", SHOT, "--set", "time.cfl"), "--set time.cfl"),
        (
            ("run", SHOT, SHOT),
            "would be run in runs/piekutowski-4-1353",
        ),
        (("run", SHOT, "no-such-case.toml"), "no-such-case.toml: no such file"),
        (("scaling", "no-such-case.toml"), "no-such-case.toml: no such file"),
        (("scaling", SHOT, "--parts", "1"), "1 is not in the range"),
        (("bench", "--late", "4 kg"), "is of another dimension"),
        (("bench", "--late", "0 us"), "expected more than 0 s"),
        (("bench", "--only", "everything"), "'everything' is not one of"),
        (("bench", "no-such-case.toml"), "no-such-case.toml: no such file"),
    ],
)
def test_mistakes_exit_with_code_2(arguments, text):
    done = call(*arguments)
    assert done.returncode == 2
    assert text in done.stderr
    assert "Traceback" not in done.stderr


def commands_with_paths(group=cli, words=()):
    """The words of each command that reads the path that is its argument."""
    for name, command in group.commands.items():
        if isinstance(command, click.Group):
            yield from commands_with_paths(command, (*words, name))
        elif name != "init" and any(  # which writes there
            isinstance(p, click.Argument) and isinstance(p.type, click.Path)
            for p in command.params
        ):
            more = ("--slurm",) if name == "script" else ()
            yield (*words, name, *more)


WRONG = {
    "nothing": lambda path: None,
    "nothing, a study": lambda path: None,
    "a file": lambda path: path.write_text("x = ["),
    "a folder": Path.mkdir,
    "a pipe": os.mkfifo,
}


@pytest.mark.parametrize("wrong", WRONG)
@pytest.mark.parametrize("command", [*commands_with_paths()], ids=" ".join)
def test_a_wrong_path_exits_with_code_2_at_once(tmp_path, command, wrong):
    path = tmp_path / ("wrong.toml" if "study" in wrong else "wrong")
    WRONG[wrong](path)
    before = set(tmp_path.iterdir())
    done = call(*command, path)
    assert done.returncode == 2, done.stderr
    assert str(path) in done.stderr + done.stdout
    assert "Errno" not in done.stderr
    assert set(tmp_path.iterdir()) == before


@pytest.mark.parametrize("quiet", [False, True])
def test_who_is_not_quiet_is_told_how_to_be(tmp_path, quiet):
    """Open MPI's mpirun buries what a command says under a banner."""
    variables = {"OMPI_MCA_orte_execute_quiet": str(int(quiet))}
    command = ["mpirun", "-n", "2", MPISPH, "run", "nothing.toml"]
    done = subprocess.run(
        command,
        env=environment(**variables),
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
    )
    assert done.returncode == 2
    lines = done.stderr.strip().split("\n")
    assert lines[0] == "mpisph: nothing.toml: no such file"
    assert lines[1:2] == (
        [] if quiet else ["(mpirun adds a banner; `mpirun --quiet` leaves it out)"]
    )


def test_an_exception_on_one_rank_ends_all():
    broken = """
import mpisph.cli.main
import mpisph.cli.run
from mpi4py import MPI

def load_case(*_):
    MPI.COMM_WORLD.Dup().Barrier()

mpisph.cli.run.load_case = load_case
if MPI.COMM_WORLD.rank == 1:
    mpisph.cli.run.from_root = None
mpisph.cli.main.main()
"""
    done = launch(2, sys.executable, "-c", broken, "run", "x.toml", timeout=30)
    assert done.returncode not in (0, 2, 3)
    assert "rank 1" in done.stderr
    assert "TypeError" in done.stderr


def test_plain_python_is_a_run_of_one_rank(tmp_path):
    done = launch(1, sys.executable, "-m", "mpisph", "--version")
    assert done.stdout.startswith("mpisph, version")
