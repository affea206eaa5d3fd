"""What snapshots and checkpoints share; see also test_snapshot.py."""

import h5py
import pytest

from mpisph.particle_file import store_text, stored_text


@pytest.mark.parametrize("text", ["", "a", "µ Größe\n", "x" * 100_000, "é" * 40_000])
def test_texts_of_any_length_come_back(tmp_path, text):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        store_text(file, "text", text)
    with h5py.File(tmp_path / "a.h5") as file:
        assert stored_text(file, "text") == text
