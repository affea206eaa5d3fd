"""The history of a run: one line of ``history.csv`` for every few steps."""

import csv
import hashlib
import os
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from mpi4py import MPI
from pydantic import BaseModel, ConfigDict

from mpisph.diagnostics.series import SERIES, Quantity, column_name
from mpisph.io.files import LineFile, check_regular, read_text, set_aside, write_text

HISTORY_FILE = "history.csv"


Row = Mapping[str, float]
"""One line by the names of `COLUMNS`; all of `SERIES` over all ranks, in SI units."""


COLUMNS = (
    Quantity("step", "", "steps made"),
    Quantity("time", "s", "time"),
    Quantity("dt", "s", "length of the step"),
    *(Quantity(series.name, series.unit, series.label) for series in SERIES),
    Quantity("energy_error", "", "change of the total energy over the initial one"),
    Quantity("imbalance", "", "largest load of a rank over the mean, less 1"),
    Quantity("wall", "s", "wall time since the start of the run"),
)

HEADER = tuple(column_name(column) for column in COLUMNS)
"""Names of the columns in the file."""

_NAMES = tuple(column.name for column in COLUMNS)
_INTEGERS = frozenset({"step"})
_CHUNK = 2**20
# Bytes that are hashed at a time.


class Beginning(BaseModel):
    """What a history begins with."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    size: int
    """[bytes]."""
    sha256: str
    """Digest of so many bytes."""


class Table(LineFile):
    """Writes a CSV file with a line for some steps, on rank 0 alone.

    Other ranks do nothing. Nothing here is collective, and an error is raised on rank 0
    only.

    Parameters
    ----------
    path : Path
    header : sequence of str
        Names of the columns.
    comm : MPI.Intracomm
    kept : int, optional
        Size of what is kept of an earlier table [bytes]; lines behind it, of steps
        that are to be made again, are cut off. By default nothing is kept.

    Raises
    ------
    OSError
        On rank 0, if the file cannot be written.
    """

    def __init__(
        self, path: Path, header: Sequence[str], comm: MPI.Intracomm, kept: int = 0
    ) -> None:
        self._digest = hashlib.sha256()
        if comm.rank == 0:
            if kept > 0:
                os.truncate(path, kept)
            else:
                write_text(path, _line(header))
            self._digest = _digest(path)
        super().__init__(path if comm.rank == 0 else None)

    def add_cells(self, cells: Sequence[str]) -> None:
        """Write one line."""
        line = _line(cells)
        self.write(line)
        self._digest.update(line.encode())

    def saved(self) -> Beginning:
        """Bring all lines to the disk and return what has been written.

        Raises
        ------
        OSError
            If they cannot be brought there.
        """
        return Beginning(size=self.save(), sha256=self._digest.hexdigest())


class History(Table):
    """Writes ``history.csv``; see `Table`.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    comm : MPI.Intracomm
    kept : int, optional
    """

    def __init__(self, folder: Path, comm: MPI.Intracomm, kept: int = 0) -> None:
        super().__init__(folder / HISTORY_FILE, HEADER, comm, kept)

    def add(self, row: Row) -> None:
        """Write one line; numbers keep all of their digits."""
        self.add_cells([_text(name, row[name]) for name in _NAMES])


def begins_with(path: Path, beginning: Beginning) -> bool:
    """Say whether a run's history, or another table, begins with what was written."""
    try:
        check_regular(path)
        return _digest(path, beginning.size).hexdigest() == beginning.sha256
    except OSError:
        return False


def _digest(path: Path, size: int | None = None) -> "hashlib._Hash":
    """Return the digest of a file, or of its first bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        left = path.stat().st_size if size is None else size
        while chunk := file.read(min(left, _CHUNK)):
            digest.update(chunk)
            left -= len(chunk)
    return digest


def keep_rows(
    path: Path, step: int, every: int, header: Sequence[str] = HEADER
) -> tuple[int, int]:
    """Rewrite a damaged history, or another table, with the rows that can be read.

    Parameters
    ----------
    path : Path
    step : int
        Rows of this step and of later ones are left out.
    every : int
        Steps between two rows.
    header : sequence of str, optional
        Names of its columns, of which the first is the step.

    Returns
    -------
    rows : int
        How many are kept. Whether one of them was altered cannot be told.
    wanted : int
        How many there should be.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    text = ""
    with suppress(OSError):
        check_regular(path)
        text = path.read_bytes().decode(errors="replace")
    wanted = range(0, step, every)
    rows = {}
    for line in text.splitlines():
        number = _step_of(line, len(header))
        if number in wanted:
            rows[number] = line  # of two lines, one has an altered step
    if path.is_dir():
        set_aside(path)
    lines = [",".join(header), *(rows[number] for number in sorted(rows))]
    write_text(path, "\n".join(lines) + "\n")
    return len(rows), len(wanted)


def _step_of(line: str, columns: int) -> int:
    """Return the step of a row; -1 where it is none."""
    cells = line.split(",")
    try:
        numbers = [float(cell) for cell in cells]
        return int(cells[0]) if len(numbers) == columns else -1
    except ValueError:
        return -1


def read_history(path: Path) -> npt.NDArray[Any]:
    """Read a history.

    Parameters
    ----------
    path : Path
        The file ``history.csv``.

    Returns
    -------
    structured ndarray, shape (lines,)
        Its fields are those of `COLUMNS`, in SI units. A last line that was
        cut short by the end of the run is left out.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not a history.
    """
    kinds = [(n, "i8" if n in _INTEGERS else "f8") for n in _NAMES]
    return np.array([tuple(row) for row in _read_rows(path)], dtype=kinds)


def complete_lines(path: Path) -> list[list[str]]:
    """Return the lines of a table, split into cells, but for one that was cut short."""
    complete, _, _ = read_text(path).rpartition("\n")
    return list(csv.reader(complete.splitlines()))


def _read_rows(path: Path) -> list[list[str]]:
    """Return the complete lines below the header, split into cells."""
    rows = complete_lines(path)
    if not rows or tuple(rows[0]) != HEADER:
        msg = f"{path}: not a history; its header should be {','.join(HEADER)}"
        raise ValueError(msg)
    return rows[1:]


def _text(name: str, value: float) -> str:
    """Return a number with all of its digits; numpy's own repr names its type."""
    return repr(int(value) if name in _INTEGERS else float(value))


def _line(cells: Sequence[str]) -> str:
    return ",".join(cells) + "\n"
