"""Files appear whole or not at all."""

import pytest

from mpisph.io.files import replace_file, write_text


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
    with pytest.raises(OSError, match="No space"):
        write_text(path, "two")
    assert path.read_text() == "one"
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


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
