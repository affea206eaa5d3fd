"""Files appear whole or not at all."""

from pathlib import Path

import pytest
from matplotlib.figure import Figure

from mpisph.figures.style import save
from mpisph.io.files import LineFile, naming, replace_file, write_text


def test_text_replaces_the_file_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "a.json"
    write_text(path, "one")
    write_text(path, "µ two\n")
    assert path.read_text(encoding="utf-8") == "µ two\n"
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_a_failure_leaves_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "a.json"
    write_text(path, "one")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("mpisph.io.files.os.fsync", full)
    with pytest.raises(OSError, match="No space") as caught:
        write_text(path, "two")
    assert str(path) in caught.value.filename
    assert path.read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


def test_what_the_system_does_not_name_is_named(tmp_path):
    path = tmp_path / "a.json"
    with pytest.raises(OSError, match="No space") as caught, naming(path):
        raise OSError(28, "No space left on device")
    assert caught.value.filename == str(path)
    with pytest.raises(FileNotFoundError) as caught, naming(path):
        open(tmp_path / "other")
    assert caught.value.filename == str(tmp_path / "other")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
def test_a_full_disk_is_named(tmp_path):
    file = LineFile(Path("/dev/full"))
    with pytest.raises(OSError, match="/dev/full"):
        file.write("x\n")
    file.close()
    figure = Figure()
    path = tmp_path / "a.png"
    path.symlink_to("/dev/full")
    with pytest.raises(OSError, match="No space") as caught:
        save(figure, path)
    assert caught.value.filename == str(path)


def test_file_and_folder_are_on_the_disk_before_and_after_renaming(
    tmp_path, monkeypatch
):
    part, path = tmp_path / "a.part", tmp_path / "a"
    part.write_text("x")
    seen = []
    monkeypatch.setattr(
        "mpisph.io.files.os.fsync", lambda _: seen.append(path.exists())
    )
    replace_file(part, path)
    assert seen == [False, True]
