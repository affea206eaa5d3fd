"""What a run has written, and whether it is still there as it was written."""

import hashlib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Literal, NamedTuple

from pydantic import BaseModel, ConfigDict

from mpisph.core.errors import os_error_text
from mpisph.io.files import check_regular
from mpisph.io.history import Beginning, begins_with
from mpisph.io.snapshot import SNAPSHOTS_FOLDER, snapshot_time

HEAD = 2**20
"""Bytes of a snapshot that its digest covers: all of a small one. Of a large one it is
the size that counts, and whether it can be opened."""


class SnapshotRecord(BaseModel):
    """A snapshot as it was written."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    name: str
    """Of the file."""
    time: float
    """[s]."""
    size: int
    """[bytes]."""
    sha256: str
    """Digest of the first `HEAD` bytes."""

    @classmethod
    def of(cls, path: Path, time: float) -> "SnapshotRecord":
        """Return the record of a file that was just written.

        Raises
        ------
        OSError
            If it cannot be read.
        """
        size, digest = _head(path)
        return cls(name=path.name, time=time, size=size, sha256=digest)


class Fault(NamedTuple):
    """A file that is not what was written.

    Attributes
    ----------
    name : str
        The file, as seen from the folder of the run.
    kind : str
        Whether it is missing, is no snapshot, cannot be read at present, or is another
        than the one that was written.
    text : str
        What it is.
    """

    name: str
    kind: Literal["missing", "broken", "unreadable", "altered"]
    text: str

    def __str__(self) -> str:
        """Return the fault in words."""
        return f"{self.name}: {self.text}"


def find_faults(
    folder: Path,
    snapshots: Sequence[SnapshotRecord],
    tables: Mapping[str, Beginning],
) -> list[Fault]:
    """Compare what lies in the folder of a run with what was written there.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    snapshots : sequence of SnapshotRecord
    tables : mapping of str to Beginning
        The history and what else has a line for some steps, by their names.

    Returns
    -------
    list of Fault
        Empty where all is as it was written.
    """
    found = [_snapshot_fault(folder, record) for record in snapshots]
    faults = [fault for fault in found if fault is not None]
    for name, beginning in tables.items():
        if not begins_with(folder / name, beginning):
            is_there = (folder / name).exists()
            text = "is not what was written" if is_there else "is missing"
            faults.append(Fault(name, "altered", text))
    return faults


def _snapshot_fault(folder: Path, record: SnapshotRecord) -> Fault | None:
    """Return what is wrong with a snapshot."""
    name = f"{SNAPSHOTS_FOLDER}/{record.name}"
    path = folder / name
    if not path.is_symlink() and not path.exists():
        return Fault(name, "missing", "is missing")
    if not path.is_file():
        return Fault(name, "broken", "is no file")
    try:
        seen = _head(path)
    except OSError as error:
        return Fault(name, "unreadable", f"cannot be read ({error.strerror})")
    try:
        time = snapshot_time(path)
    except OSError as error:
        return Fault(name, "broken", f"is damaged ({os_error_text(error)})")
    except ValueError:
        return Fault(name, "broken", "is damaged: no snapshot of mpisph")
    if (*seen, time) != (record.size, record.sha256, record.time):
        return Fault(name, "altered", "is not what was written")
    return None


def _head(path: Path) -> tuple[int, str]:
    """Return the size of a file, and the digest of its first bytes."""
    check_regular(path)
    with path.open("rb") as file:
        head = file.read(HEAD)
    return path.stat().st_size, hashlib.sha256(head).hexdigest()
