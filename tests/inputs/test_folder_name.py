"""The folder that is named after a file."""

import subprocess
from pathlib import Path

import pytest
from launch import CASES, TOP, call
from studies import small_study

from mpisph.core.errors import CaseError
from mpisph.inputs.folder_name import folder_name
from mpisph.inputs.printing import printable

REFUSED = ("-n.toml", "...toml", "..toml", "a\nb.toml", "a\x1b[31m.toml")
OTHERS = (".toml", "a\u202eb.toml", "a\u200bb.toml", "\udcff.toml")
SOUND = (
    "a.toml",
    "my study.toml",
    "a$(touch X).toml",
    "it's`a\"b.toml",
    "é 日本.toml",
    "1",
)


@pytest.mark.parametrize("name", SOUND)
def test_names_that_can_be_quoted_are_sound(name):
    assert folder_name(Path("there") / name) == Path(name).stem


@pytest.mark.parametrize("name", [*REFUSED, *OTHERS])
def test_a_name_that_no_folder_may_have_is_refused(name):
    with pytest.raises(CaseError, match="cannot be the name of a folder") as caught:
        folder_name(Path("there") / name)
    assert str(caught.value).isprintable()


@pytest.mark.parametrize("name", REFUSED)
@pytest.mark.parametrize(
    "command",
    [
        ("run",),
        ("report",),
        ("study", "run"),
        ("study", "status"),
        ("study", "collect"),
        ("study", "draw"),
        ("study", "script", "--slurm"),
    ],
    ids=" ".join,
)
def test_commands_refuse_such_names(tmp_path, monkeypatch, command, name):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / name
    shot = (CASES / "piekutowski-4-1353.toml").read_text()
    path.write_text(shot if command == ("run",) else small_study("1 us"))
    before = set(tmp_path.rglob("*"))
    done = call(*command, "--", name)
    assert done.returncode == 2
    assert f"'{printable(path.stem, 80)}' cannot be the name of a folder" in done.stderr
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("name", REFUSED)
def test_batch_scripts_refuse_such_names(name):
    program = (
        f"home={TOP}; source scripts/batch.sh; choose_case '' \"$1\"; echo $folder"
    )
    command = ["bash", "-c", program, "bash", name]
    done = subprocess.run(command, cwd=TOP, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "no folder can be named after this file" in done.stderr
