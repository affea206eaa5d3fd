"""What all commands share: the entry point, and what happens to errors."""

import sys

import pytest
from launch import CASES, call, launch

SHOT = CASES / "piekutowski-4-1353.toml"


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("run", "no-such-case.toml"), "no-such-case.toml: no such file"),
        (("run",), "Missing argument 'CASE...'"),
        (("run", SHOT, "--rank", "3"), "No such option '--rank'"),
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
