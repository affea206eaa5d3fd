"""The command line, on one and on several ranks."""

import json
import sys

import pytest
from launch import CASES, MPISPH, call, launch

from mpisph.case import load_case
from mpisph.io.snapshot import read_series, read_snapshot

SHOT = CASES / "piekutowski-4-1353.toml"
SHORT = ("--set", "resolution.npr=4", "--set", "time.end=1.2us")


def test_run_writes_every_file_of_a_run(tmp_path):
    folder = tmp_path / "run"
    done = launch(2, MPISPH, "run", SHOT, *SHORT, "-o", folder)
    assert done.returncode == 0, done.stderr
    written = {p.relative_to(folder).as_posix() for p in folder.rglob("*")}
    snapshots = {f"snapshots/snapshot_0000{i}.vtkhdf" for i in range(3)}
    pictures = {f"figures/cloud_0{t}us.png" for t in ("0.00", "1.00", "1.20")}
    assert written == snapshots | pictures | {
        "snapshots",
        "figures",
        "case.toml",
        "history.csv",
        "log.txt",
        "result.json",
        "snapshots.vtkhdf.series",
        "status.json",
        ".lock",
    }
    result = json.loads((folder / "result.json").read_text())
    assert result["status"] == "completed"
    assert result["time"] == 1.2e-6
    assert result["timing"]["ranks"] == 2
    assert [t for _, t in read_series(folder)] == [0.0, 1e-6, 1.2e-6]
    assert load_case(folder / "case.toml").resolution.npr == 4
    last = read_snapshot(folder / "snapshots/snapshot_00002.vtkhdf")
    assert last.case == (folder / "case.toml").read_text()
    # Said once, not once a rank.
    assert done.stdout.count("completed: ") == 1
    assert "not reached" in done.stdout


def test_one_and_three_ranks_write_the_same_files(tmp_path):
    for ranks in (1, 3):
        options = ("--set", "output.figures=false", "-o", tmp_path / f"{ranks}")
        done = launch(ranks, MPISPH, "run", SHOT, *SHORT, *options)
        assert done.returncode == 0, done.stderr
    names = [p.name for p, _ in read_series(tmp_path / "1")]
    assert len(names) == 3
    for name in names:
        one, three = (tmp_path / n / "snapshots" / name for n in "13")
        assert one.read_bytes() == three.read_bytes()
    # All but the imbalance and the wall time, which are of the machine.
    one, three = (
        [
            line.split(",")[:11]
            for line in (tmp_path / n / "history.csv").read_text().split()
        ]
        for n in "13"
    )
    assert one == three


def test_bad_input_is_told_once_with_its_place_and_exit_code_2(tmp_path):
    case = tmp_path / "bad.toml"
    case.write_text(SHOT.read_text().replace("nph = 2.0", "nhp = 2.0"))
    done = launch(2, MPISPH, "run", case, "-o", tmp_path / "run")
    assert done.returncode == 2
    line = 1 + case.read_text().splitlines().index("nhp = 2.0")
    assert done.stderr.count(f"{case}:{line}: resolution.nhp") == 1
    assert "did you mean nph?" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "run").exists()


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


def test_unstable_run_exits_with_code_3_and_keeps_what_it_wrote(tmp_path):
    unstable = ("--set", "time.step=fixed", "--set", "time.dt=200 ns")
    done = launch(2, MPISPH, "run", SHOT, *SHORT, *unstable, "-o", tmp_path)
    assert done.returncode == 3
    assert "unstable (" in done.stderr
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["status"] == "unstable"
    assert result["reason"] in {"energy_drift", "density", "step_collapse"}
    assert result["detail"] in done.stderr
    assert 0 < result["step"] < 7
    kept = [p for p, _ in read_series(tmp_path)]
    assert read_snapshot(kept[0]).time == 0.0
    assert "unstable" in (tmp_path / "log.txt").read_text()


def test_several_cases_run_one_after_the_other(tmp_path):
    """Each into a folder of its own; one that is unstable does not stop the next."""
    plates = CASES / "plate-impact.toml"
    # Too long a step for either.
    short = ("time.end=0.3us", "time.step=fixed", "time.dt=100 ns")
    overrides = [x for text in short for x in ("--set", text)]
    done = launch(2, MPISPH, "run", SHOT, plates, *overrides, "-o", tmp_path)
    results = {
        path.name: json.loads((path / "result.json").read_text())
        for path in tmp_path.iterdir()
    }
    assert set(results) == {SHOT.stem, plates.stem}
    assert [r["status"] for r in results.values()] == ["unstable", "unstable"]
    assert done.returncode == 3
    assert done.stdout.count("files in ") == 2


def test_mistakes_of_several_cases_are_reported_together(tmp_path):
    bad = [tmp_path / f"{k}.toml" for k in "ab"]
    for path in bad:
        path.write_text(f'title = "{path.stem}"\n')
    done = launch(2, MPISPH, "run", *bad, "-o", tmp_path / "runs")
    assert done.returncode == 2
    assert all(str(path) in done.stderr for path in bad)
    assert not (tmp_path / "runs").exists()


def test_scaling_prints_a_table():
    small = ("--set", "resolution.npr=8", "--parts", "4", "--parts", "9")
    done = call("scaling", SHOT, *small)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("| parts | cut |")
    assert [line.split("|")[1].strip() for line in lines[2:]] == ["4", "4", "9", "9"]


def test_unwritable_folder_is_an_error_on_all_ranks(tmp_path):
    (tmp_path / "file").write_text("in the way")
    done = launch(2, MPISPH, "run", SHOT, *SHORT, "-o", tmp_path / "file")
    assert done.returncode == 2
    done = launch(2, MPISPH, "run", SHOT, *SHORT, "-o", tmp_path / "file" / "run")
    assert done.returncode == 1
    assert done.stderr.count("mpisph: ") == 1
    assert "Traceback" not in done.stderr


def test_a_full_disk_on_one_rank_ends_all(tmp_path):
    (tmp_path / "log.txt").symlink_to("/dev/full")
    done = launch(2, MPISPH, "run", SHOT, *SHORT, "-o", tmp_path, timeout=60)
    assert done.returncode not in (0, 2, 3)
    assert "No space left on device" in done.stderr
    assert "Traceback" not in done.stderr


def test_dry_run_prints_the_size_and_writes_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = launch(2, MPISPH, "run", SHOT, "--dry-run")
    assert done.returncode == 0, done.stderr
    for word in ("particles", "memory", "steps", "2 ranks"):
        assert done.stdout.count(word) == 1
    assert list(tmp_path.iterdir()) == []


def test_schema_is_the_case_files_json_schema():
    done = launch(2, MPISPH, "schema")
    schema = json.loads(done.stdout)
    assert {"bodies", "resolution", "scheme", "time"} <= set(schema["properties"])


def test_the_cache_is_shown_and_cleared(tmp_path):
    old = tmp_path / ("0" * 16)
    old.mkdir()
    (old / "code.nbc").write_text("old")
    cache = {"MPISPH_CACHE_DIR": str(tmp_path)}
    done = launch(2, MPISPH, "cache", "show", **cache)
    assert done.stdout.count(f"{tmp_path}/") == 1
    assert "not compiled yet" in done.stdout
    done = launch(2, MPISPH, "cache", "clear", **cache)
    assert done.returncode == 0, done.stderr
    assert list(tmp_path.iterdir()) == []


def test_figures_are_drawn_again(tmp_path):
    options = (*SHORT, "--set", "output.figures=false", "-o", tmp_path)
    assert call("run", SHOT, *options).returncode == 0
    assert not (tmp_path / "figures").exists()
    done = call("figures", tmp_path)
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.split()) == len(list(tmp_path.glob("figures/*.png"))) == 3


@pytest.mark.parametrize(
    ("command", "text"),
    [("figures", "no snapshots to draw"), ("clock", "no case.toml")],
)
def test_a_folder_of_no_run_is_an_error(tmp_path, command, text):
    done = launch(2, MPISPH, command, tmp_path)
    assert done.returncode == 1
    assert done.stderr.count(text) == 1


@pytest.mark.parametrize("options", [("--dry-run",), ()])
def test_absurd_sizes_are_refused_before_anything_is_made(tmp_path, options):
    huge = ("--set", "resolution.npr=100000", "-o", tmp_path / "run")
    done = call("run", SHOT, *huge, *options)
    assert done.returncode == 2
    assert "expected at most 1e+09" in done.stderr
    assert not (tmp_path / "run").exists()


def test_an_exception_on_one_rank_ends_all():
    broken = """
import mpisph.cli.main
from mpi4py import MPI

def load_case(*_):
    MPI.COMM_WORLD.Dup().Barrier()

mpisph.cli.main.load_case = load_case
if MPI.COMM_WORLD.rank == 1:
    mpisph.cli.main.from_root = None
mpisph.cli.main.main()
"""
    done = launch(2, sys.executable, "-c", broken, "run", "x.toml", timeout=30)
    assert done.returncode not in (0, 2, 3)
    assert "rank 1" in done.stderr
    assert "TypeError" in done.stderr


def test_plain_python_is_a_run_of_one_rank(tmp_path):
    done = launch(1, sys.executable, "-m", "mpisph", "--version")
    assert done.stdout.startswith("mpisph, version")


@pytest.fixture(scope="module")
def clocked(tmp_path_factory):
    """Runs at NPR 4 and 5 that pass an early stand-in for the exposures."""
    top = tmp_path_factory.mktemp("clocked")
    text = SHOT.read_text()
    for old, new in (
        ('time = "6 us"', 'time = "1 us"'),
        ('time = "19 us"', 'time = "2 us"'),
        ('radius = "15.3 mm"', 'radius = "9.5 mm"'),
        ('length = "31.7 mm"', 'length = "4 mm"'),
        ('radius = "37.5 mm"', 'radius = "10 mm"'),
        ('length = "98.0 mm"', 'length = "9 mm"'),
        ('"1.05 us"', '"0.1 us"'),
        ('end = "22 us"', 'end = "4 us"'),
    ):
        assert old in text
        text = text.replace(old, new)
    cases = [top / "npr4.toml", top / "npr5.toml"]
    for path in cases:
        path.write_text(text.replace("npr = 10\n", f"npr = {path.stem[3:]}\n"))
    options = ("--set", "output.figures=false", "-o", top)
    done = call("run", *cases, *options)
    assert done.returncode == 0, done.stderr
    return top


def test_clock_fits_one_run_and_draws_into_its_folder(clocked):
    folder = clocked / "npr4"
    done = launch(2, MPISPH, "clock", folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("clock offset ") == 1
    assert "unknown from one run" in done.stdout
    assert "predictions" in done.stdout
    assert f"figure in {folder / 'clock.png'}" in done.stdout
    assert (folder / "clock.png").stat().st_size > 10_000


def test_clock_of_two_runs_has_a_numerical_uncertainty(clocked, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    folders = clocked / "npr5", clocked / "npr4"
    done = call("clock", *folders)
    assert done.returncode == 0, done.stderr
    assert "of NPR 5 (the finest)" in done.stdout
    assert "half of the spread of two runs" in done.stdout
    assert (tmp_path / "clock.png").exists()
    done = call("clock", *folders, "--npr", "4", "-o", "here/c.png")
    assert "of NPR 4 (as asked)" in done.stdout
    assert (tmp_path / "here" / "c.png").exists()


def test_clock_says_what_it_cannot_use(clocked, tmp_path):
    done = launch(2, MPISPH, "clock", clocked / "npr4", clocked / "npr4")
    assert done.returncode == 1
    assert done.stderr.count("name one run for each resolution") == 1
    assert "Traceback" not in done.stderr
    (tmp_path / "case.toml").write_text((clocked / "npr4" / "case.toml").read_text())
    done = call("clock", clocked / "npr4", tmp_path)
    assert done.returncode == 1
    assert f"{tmp_path}: not a completed run" in done.stderr
