"""The history of a run: one line of ``history.csv`` for every few steps."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.io.files import LineFile, write_text

HISTORY_FILE = "history.csv"


class HistoryRow(NamedTuple):
    """One line of the history, over all ranks.

    Attributes
    ----------
    step : int
    time : float
        [s].
    dt : float
        Length of the step [s].
    mass : float
        [kg].
    momentum_z : float
        Axial momentum [kg m/s].
    kinetic_energy, internal_energy : float
        [J].
    energy_error : float
        Change of the total energy, relative to the initial one.
    cloud_radius, cloud_length : float
        R_b and L_b by the outermost particles [m].
    cloud_mass : float
        Mass of the cloud [kg].
    imbalance : float
        Excess of the largest load over the mean.
    wall : float
        Time since the start of the run [s].
    """

    step: int
    time: float
    dt: float
    mass: float
    momentum_z: float
    kinetic_energy: float
    internal_energy: float
    energy_error: float
    cloud_radius: float
    cloud_length: float
    cloud_mass: float
    imbalance: float
    wall: float


UNITS = {
    "time": "s",
    "dt": "s",
    "mass": "kg",
    "momentum_z": "kg_m_per_s",
    "kinetic_energy": "J",
    "internal_energy": "J",
    "cloud_radius": "m",
    "cloud_length": "m",
    "cloud_mass": "kg",
    "wall": "s",
}
"""Units of the columns that have one."""

HEADER = tuple(
    f"{name}_{UNITS[name]}" if name in UNITS else name for name in HistoryRow._fields
)
"""Names of the columns in the file."""

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

    def add(self, row: HistoryRow) -> None:
        """Write one line; numbers keep all of their digits."""
        self.write(_line(tuple(map(_text, HistoryRow._fields, row))))


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
        Its fields are those of `HistoryRow`, in SI units. A last line that was
        cut short by the end of the run is left out.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not a history.
    """
    kinds = [(n, "i8" if n in _INTEGERS else "f8") for n in HistoryRow._fields]
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
