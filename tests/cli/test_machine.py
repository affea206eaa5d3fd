"""The commands that need no run."""

import json

from launch import CASES, MPISPH, call, launch

SHOT = CASES / "piekutowski-4-1353.toml"


def test_scaling_prints_a_table():
    small = ("--set", "resolution.npr=8", "--parts", "4", "--parts", "9")
    done = call("scaling", SHOT, *small)
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    assert lines[0].startswith("| parts | cut |")
    assert [line.split("|")[1].strip() for line in lines[2:]] == ["4", "4", "9", "9"]


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
