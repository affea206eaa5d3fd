"""The commands of a study, as a person calls them."""

import csv

import pytest
from launch import MPISPH, call, launch
from studies import UNSTABLE, small_study

TEXT = small_study("0.4 us", variants=(("sound", ""), ("unstable", UNSTABLE)))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a study in it, before it is run."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "small.toml").write_text(TEXT)
    return folder


def study(folder, *arguments, ranks=1):
    command, *rest = arguments
    words = ("study", command, folder / "small.toml", "-o", folder / "runs", *rest)
    return call(*words) if ranks == 1 else launch(ranks, MPISPH, *words)


def test_from_to_do_to_a_table(folder):
    before = study(folder, "status")
    assert before.stdout == "small: 4 cases: 4 to do\n"
    run = study(folder, "run", ranks=2)
    assert run.returncode == 0, run.stderr
    assert "small: 2 completed, 2 unstable, 0 failed, 0 left\n" in run.stdout
    assert "4 of 4 runs: 2 completed, 2 unstable, 0 failed" in run.stderr
    after = study(folder, "status").stdout.splitlines()
    assert after[0] == "small: 4 cases: 2 completed, 2 unstable"
    assert [line.split("  unstable (energy_drift): ")[1] for line in after[1:]] == [
        "unstable, nph = 2.0",
        "unstable, nph = 2.5",
    ]
    everything = study(folder, "status", "--all").stdout.splitlines()
    assert len(everything) == 5
    path = folder / "runs" / "studies" / "small" / "table.csv"
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["completed"] * 2 + ["unstable"] * 2
    assert (path.parent / "study.toml").read_text() == TEXT
    path.unlink()
    collected = study(folder, "collect", "--parquet")
    assert collected.returncode == 0, collected.stderr
    assert str(path) in collected.stdout
    assert path.with_suffix(".parquet").exists()
    again = study(folder, "run")
    assert "small: 2 completed, 2 unstable, 0 failed, 0 left\n" in again.stdout
    assert "of 4 runs" not in again.stderr


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("run", "--part", "4/4"), "expected K/N with K from 0 to N-1"),
        (("run", "--part", "half"), "expected K/N with K from 0 to N-1"),
        (("run", "--ranks-per-case", "2"), "but mpirun started 1"),
        (("script",), "expected --slurm or --pbs"),
        (("script", "--pbs", "--ranks-per-case", "17"), "but --ranks 16"),
    ],
)
def test_a_wrong_call_is_explained(folder, arguments, text):
    done = study(folder, *arguments)
    assert done.returncode in {1, 2}
    assert text in done.stderr
    assert "Traceback" not in done.stderr


def test_a_mistake_in_the_file_is_named_with_its_line(folder, tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TEXT.replace("values =", "value ="))
    done = study(tmp_path, "run")
    assert done.returncode == 2
    assert f"{path}:" in done.stderr
    assert "parameters.0.value: unknown key" in done.stderr
    assert not (tmp_path / "runs").exists()


def test_claims_that_wait_for_runs_say_so(tmp_path):
    done = call("study", "claims", "-o", tmp_path, "--markdown")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "| claim | verdict | figure |"
    rows = [line for line in lines[2:] if line.startswith("|")]
    assert all("**not run**" in row for row in rows)
    assert "| 11. The hole" in rows[-2]
    assert lines[-1].startswith("- ")
