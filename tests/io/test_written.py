"""What is noticed of files that are not as they were written."""

import os

import h5py
import pytest
from mpi4py import MPI
from oracles import numbered

from mpisph.io.history import HISTORY_FILE, Beginning, History
from mpisph.io.snapshot import write_snapshot
from mpisph.io.written import SnapshotRecord, find_faults

SELF = MPI.COMM_SELF
N = 40
NAME = "snapshots/snapshot_00001.vtkhdf"


@pytest.fixture
def folder(tmp_path):
    return tmp_path


@pytest.fixture
def records(folder):
    """Three snapshots, as they were written."""
    return [
        SnapshotRecord.of(
            write_snapshot(
                SELF,
                folder,
                index,
                numbered(range(N)),
                time=index * 1e-6,
                step=index,
                metadata={},
                n_total=N,
            ),
            index * 1e-6,
        )
        for index in range(3)
    ]


@pytest.fixture
def beginning(folder):
    with History(folder, SELF) as history:
        return history.saved()


def test_what_is_as_it_was_written_has_no_faults(folder, records, beginning):
    assert find_faults(folder, records, {HISTORY_FILE: beginning}) == []


def break_it(path, way):
    content = path.read_bytes()
    path.unlink()
    if way == "folder":
        path.mkdir()
    elif way == "pipe":
        os.mkfifo(path)
    elif way == "link":
        path.symlink_to("nowhere")
    elif way != "missing":
        path.write_bytes(
            {
                "empty": b"",
                "short": content[: len(content) // 2],
                "text": b"not HDF5" * 500,
                "last byte": content[:-1] + bytes([content[-1] ^ 1]),
                "longer": content + b"more",
            }[way]
        )


KINDS = {
    "missing": "missing",
    **dict.fromkeys(["folder", "pipe", "link", "empty", "short", "text"], "broken"),
    **dict.fromkeys(["last byte", "longer"], "altered"),
}


@pytest.mark.parametrize(("way", "kind"), KINDS.items())
def test_a_damaged_snapshot_is_noticed(way, kind, folder, records, beginning):
    break_it(folder / NAME, way)
    (fault,) = find_faults(folder, records, {HISTORY_FILE: beginning})
    assert (fault.name, fault.kind) == (NAME, kind)
    assert str(fault).startswith(f"{NAME}: is ")


def test_another_snapshot_in_its_place_is_noticed(folder, records, beginning):
    other = folder / "snapshots/snapshot_00002.vtkhdf"
    (folder / NAME).write_bytes(other.read_bytes())
    (fault,) = find_faults(folder, records, {HISTORY_FILE: beginning})
    assert (fault.name, fault.kind) == (NAME, "altered")


@pytest.mark.parametrize("what", ["VTKHDF/PointData/rho", "mpisph", "VTKHDF"])
def test_a_snapshot_without_a_part_is_broken(what, folder, records, beginning):
    with h5py.File(folder / NAME, "r+") as file:
        del file[what]
    (fault,) = find_faults(folder, records, {HISTORY_FILE: beginning})
    assert (fault.name, fault.kind) == (NAME, "broken")


@pytest.mark.parametrize("way", KINDS)
def test_a_damaged_history_is_noticed(way, folder, records, beginning):
    break_it(folder / HISTORY_FILE, way)
    faults = find_faults(folder, records, {HISTORY_FILE: beginning})
    # What was added behind the part that counts is of steps to be made again.
    assert [fault.name for fault in faults] == [HISTORY_FILE] * (way != "longer")


def test_a_history_that_goes_on_begins_as_it_did(folder, records):
    with History(folder, SELF) as history:
        before = history.saved()
        history.write("1,2,3\n")
        assert history.saved() == Beginning(
            size=before.size + 6, sha256=history.saved().sha256
        )
    assert find_faults(folder, records, {HISTORY_FILE: before}) == []
