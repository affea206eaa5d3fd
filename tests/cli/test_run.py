"""mpisph run, resume and status."""

import json
import re

import pytest
from launch import CASES, MPISPH, call, launch
from run_folders import status

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
        "checkpoints",
        f"checkpoints/checkpoint_{status(folder)['step']:09d}.h5",
        "case.toml",
        "history.csv",
        "bodies.csv",
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


def test_a_dry_run_says_what_is_hardly_meant_and_how_long_it_takes():
    away = ("--set", "bodies.sphere.velocity=-6.68 km/s")
    done = call("run", SHOT, "--dry-run", *away)
    assert done.returncode == 0, done.stderr
    assert "warning: bodies.*.velocity: no two bodies ever meet" in done.stdout
    assert "wall time  about" in done.stdout


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
            line.split(",")[:-2]
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


def test_unstable_run_exits_with_code_3_and_keeps_what_it_wrote(tmp_path):
    unstable = ("--set", "time.step=fixed", "--set", "time.dt=200 ns")
    done = launch(2, MPISPH, "run", SHOT, *SHORT, *unstable, "-o", tmp_path)
    assert done.returncode == 3
    assert "unstable (" in done.stderr
    result = json.loads((tmp_path / "result.json").read_text())
    assert result["status"] == "unstable"
    assert result["reason"] in {"density", "step_collapse", "negative_energy"}
    assert result["detail"] in done.stderr
    assert re.search(r" mm, .* km/s|total energy changed", result["detail"])
    assert " m/s" not in result["detail"]
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


@pytest.mark.parametrize("options", [("--dry-run",), ()])
def test_absurd_sizes_are_refused_before_anything_is_made(tmp_path, options):
    huge = ("--set", "resolution.npr=100000", "-o", tmp_path / "run")
    done = call("run", SHOT, *huge, *options)
    assert done.returncode == 2
    assert "expected at most 1e+09" in done.stderr
    assert not (tmp_path / "run").exists()
