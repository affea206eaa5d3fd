"""Two programs in turns: what is started, and what becomes of the figures."""

import itertools
import json
import subprocess
from pathlib import Path

import pytest
from bench_records import record
from launch import MPISPH, call, launch

from mpisph.bench import against
from mpisph.bench.against import SOURCES, Side, compare, other_side
from mpisph.bench.record import Spread
from mpisph.bench.tables import tables
from mpisph.core.errors import InputError, MpisphError

PACKAGE = "mpisph/__init__.py"


class Programs:
    """What stands for both programs: their times, start by start."""

    def __init__(self, monkeypatch, known, times):
        self.started, self._times = [], {name: iter(t) for name, t in times.items()}
        self._known = known
        monkeypatch.setattr(against, "_start", self.start)

    def start(self, side, arguments, ranks):
        done = subprocess.CompletedProcess(arguments, 0, "", "")
        if arguments == ["--help"]:
            done.stdout = f"  --only [{'|'.join(self._known[side.name])}]\n"
            return done
        self.started.append((side.name, tuple(arguments), ranks))
        path = Path(arguments[arguments.index("-o") + 1])
        pairs = itertools.pairwise(arguments)
        wanted = [scene for option, scene in pairs if option == "--only"]
        times = next(self._times[side.name])
        path.write_text(record(**{s: times[s] for s in wanted}).model_dump_json())
        return done


def sides(*overrides):
    return Side("this", SOURCES), Side("that", SOURCES / "older", overrides)


BOTH = ["block", "impact", "late", "small", "start-up"]


def test_ratios_are_taken_within_pairs_that_begin_in_turns(monkeypatch):
    """A machine that gets three times slower does not matter."""
    drift = (1.0, 1.0, 2.0, 3.0)
    times = {
        "this": [{"small": 2.0 * x} for x in drift],
        "that": [{"small": 4.0 * x} for x in drift],
    }
    programs = Programs(monkeypatch, {"this": BOTH, "that": BOTH}, times)
    [found] = compare(sides("a.b=1"), ["shot.toml"], 2, 3, ["small"])
    assert found.ratio == Spread(median=0.5, smallest=0.5, largest=0.5)
    assert (found.step_ms.median, found.other_step_ms.largest) == (4.0, 12.0)
    names = [name for name, _, _ in programs.started]
    assert names[:2] == ["this", "that"], "both once, before it counts"
    assert names[2:] == ["this", "that", "that", "this", "this", "that"]
    for name, arguments, ranks in programs.started:
        assert ranks == 2
        assert arguments[0] == "shot.toml"
        assert (arguments[-2:] == ("--set", "a.b=1")) == (name == "that")


def test_a_scene_that_one_does_not_know_is_left_out(monkeypatch):
    old = [part for part in BOTH if part != "small"]
    times = {name: [{"small": 1.0, "late": 1.0}] * 2 for name in ("this", "that")}
    Programs(monkeypatch, {"this": BOTH, "that": old}, times)
    found = compare(sides(), [], 1, 1, ["late", "small"])
    assert [each.scene for each in found] == ["late"]
    with pytest.raises(MpisphError, match="that: knows no scene of small"):
        compare(sides(), [], 1, 1, ["small"])


def test_a_program_that_fails_is_told_with_what_it_said(monkeypatch):
    def fail(side, arguments, ranks):
        code = 0 if arguments == ["--help"] else 1
        return subprocess.CompletedProcess([], code, "--only [late]", "no such key\n")

    monkeypatch.setattr(against, "_start", fail)
    with pytest.raises(MpisphError, match="this: its bench failed:\nno such key"):
        compare(sides(), [], 1, 1, ["late"])


def git(folder, *arguments):
    who = ("-c", "user.name=a", "-c", "user.email=a@b")
    command = ["git", "-C", str(folder), *who, *arguments]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout


@pytest.fixture
def sources(tmp_path, monkeypatch):
    """A repository whose package has changed since its first commit."""
    folder = tmp_path / "sources"
    (folder / "mpisph").mkdir(parents=True)
    git(tmp_path, "init", "-q", str(folder))
    for text in ("old", "new"):
        (folder / PACKAGE).write_text(text)
        git(folder, "add", ".")
        git(folder, "commit", "-qm", text)
    monkeypatch.setattr(against, "SOURCES", folder)
    return folder


def test_a_revision_is_unpacked_once_beside_its_compiled_code(sources, tmp_path):
    side = other_side("HEAD~1", tmp_path / "store")
    assert (side.sources / PACKAGE).read_text() == "old"
    assert side.cache == side.sources / "cache"
    before = (side.sources / PACKAGE).stat()
    assert other_side("HEAD~1", tmp_path / "store") == side
    assert (side.sources / PACKAGE).stat().st_mtime_ns == before.st_mtime_ns
    assert git(sources, "status", "--porcelain") == ""
    assert git(sources, "worktree", "list").count("\n") == 1
    assert other_side("HEAD", tmp_path / "store").sources != side.sources


def test_a_folder_or_a_setting_will_do(sources, tmp_path):
    assert other_side(str(sources), tmp_path / "store").sources == sources
    setting = other_side("resolution.nph=1.6", tmp_path / "store")
    assert (setting.sources, setting.overrides) == (sources, ("resolution.nph=1.6",))
    assert setting.cache is None


def test_what_is_none_of_these_is_refused(sources, tmp_path):
    with pytest.raises(InputError, match="--against v0: neither a setting"):
        other_side("v0", tmp_path)
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="empty: no package mpisph in"):
        other_side(str(tmp_path / "empty"), tmp_path)


def test_the_table_says_which_is_which(monkeypatch):
    times = {"this": [{"late": 1.0}] * 2, "that": [{"late": 4.0}] * 2}
    Programs(monkeypatch, {"this": BOTH, "that": BOTH}, times)
    found = tuple(compare(sides(), [], 1, 1, ["late"]))
    full = record().model_copy(update={"against": "v1", "comparisons": found})
    [table] = tables(full)
    assert table.title == "This program against v1, in turns"
    cells = [next(iter(column.cells)) for column in table.columns]
    assert cells[0] == "late"
    assert cells[-1].replace("\\", "") == "0.250 [0.250, 0.250]"


@pytest.mark.slow
def test_two_settings_are_compared(tmp_path):
    path = tmp_path / "bench.json"
    options = ("--only", "small", "--pairs", "1", "--repeats", "1", "--steps", "1")
    done = launch(
        1, MPISPH, "bench", *options, "--against", "resolution.nph=1.6", "-o", path
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(path.read_text())
    [small] = found["comparisons"]
    assert small["scene"] == "small"
    assert 900 < small["particles"] < 1200
    assert small["ratio"]["median"] > 0.0
    assert "against resolution.nph=1.6, in turns" in done.stdout
    only = ("--only", "block", "--against", "resolution.nph=1.6")
    refused = call("bench", *only, "-o", tmp_path / "x.json")
    assert refused.returncode == 2
    assert "there is no scene to time with it" in refused.stderr
