"""The history of a run: one line of ``history.csv`` for every few steps."""

import csv
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.diagnostics.series import SERIES
from mpisph.io.files import LineFile, write_text

HISTORY_FILE = "history.csv"


Row = Mapping[str, float]
"""One line by the names of `COLUMNS`; all of `SERIES` over all ranks, in SI units."""


class Column(NamedTuple):
    """A column of the history.

    Attributes
    ----------
    name : str
    unit : str
        SI unit; empty for a pure number.
    meaning : str
        What it is, for people.
    """

    name: str
    unit: str
    meaning: str


COLUMNS = (
    Column("step", "", "steps made"),
    Column("time", "s", "time"),
    Column("dt", "s", "length of the step"),
    *(Column(series.name, series.unit, series.label) for series in SERIES),
    Column("energy_error", "", "change of the total energy over the initial one"),
    Column("imbalance", "", "largest load of a rank over the mean, less 1"),
    Column("wall", "s", "wall time since the start of the run"),
)

HEADER = tuple(
    "_".join((c.name, *c.unit.replace("/", " per ").split())) for c in COLUMNS
)
"""Names of the columns in the file."""

_NAMES = tuple(column.name for column in COLUMNS)
_INTEGERS = frozenset({"step"})


class History(LineFile):
    """Writes ``history.csv``, on rank 0 alone; other ranks do nothing.

    Nothing here is collective. An error is raised on rank 0 only.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    comm : MPI.Intracomm
    kept : int, optional
        Size of what is kept of an earlier history [bytes]; lines behind it, of steps
        that are to be made again, are cut off. By default nothing is kept.

    Raises
    ------
    OSError
        On rank 0, if the file cannot be written.
    """

    def __init__(self, folder: Path, comm: MPI.Intracomm, kept: int = 0) -> None:
        path = folder / HISTORY_FILE if comm.rank == 0 else None
        if path is not None and kept > 0:
            os.truncate(path, kept)
        elif path is not None:
            write_text(path, _line(HEADER))
        super().__init__(path)

    def add(self, row: Row) -> None:
        """Write one line; numbers keep all of their digits."""
        self.write(_line([_text(name, row[name]) for name in _NAMES]))


def kept_history(folder: Path, size: int) -> int:
    """Return `size` where a run's history is at least so long, else 0.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    size : int
        Of the lines that were written up to some step [bytes].
    """
    try:
        with (folder / HISTORY_FILE).open("rb") as file:
            file.seek(max(size - 1, 0))
            return size if file.read(1) == b"\n" else 0
    except OSError:
        return 0


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


def _read_rows(path: Path) -> list[list[str]]:
    """Return the complete lines below the header, split into cells."""
    complete, _, _ = path.read_text(encoding="utf-8").rpartition("\n")
    rows = list(csv.reader(complete.splitlines()))
    if not rows or tuple(rows[0]) != HEADER:
        msg = f"{path}: not a history; its header should be {','.join(HEADER)}"
        raise ValueError(msg)
    return rows[1:]


def _text(name: str, value: float) -> str:
    """Return a number with all of its digits; numpy's own repr names its type."""
    return repr(int(value) if name in _INTEGERS else float(value))


def _line(cells: Sequence[str]) -> str:
    return ",".join(cells) + "\n"
