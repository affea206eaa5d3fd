"""Snapshots: one VTKHDF file per saved time, the same for any number of ranks.

A snapshot is a VTKHDF PolyData with one vertex cell for each particle, in id order, in
one partition whatever the number of ranks. Its points are ``(z, r, 0)``, so
that ParaView's default view shows the axis of symmetry horizontally; their
single precision is for display, and the exact ``z`` and ``r`` are point data.
The group ``/mpisph``, which VTK ignores, holds the step, the time and the
resolved case.
"""

import json
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.core.errors import MpisphError
from mpisph.core.particles import FIELDS, Particles
from mpisph.io.files import check_regular, naming, read_text, write_text
from mpisph.io.particle_file import (
    Column,
    FileLayout,
    Writer,
    field_column,
    store_text,
    stored_text,
    write_particle_file,
)
from mpisph.parallel.collectives import on_root

SNAPSHOTS_FOLDER = "snapshots"
SERIES_FILE = "snapshots.vtkhdf.series"

SAVED = frozenset(field.name for field in FIELDS if field.saved)
"""All fields that a snapshot can carry, besides the position."""


class Snapshot(NamedTuple):
    """What a snapshot holds.

    Attributes
    ----------
    time : float
        [s].
    step : int
    case : str
        The resolved case as TOML, empty where none was given.
    arrays : dict of str to ndarray
        The saved fields by their names on `Particles`, each of shape ``(n,)``,
        in id order; ``r`` and ``z`` exact. Those of models are there where a body uses
        one, see `Case.saved_fields`.
    metadata : dict of str to str
        All that was given as such: the case, versions, revision.
    """

    time: float
    step: int
    case: str
    arrays: dict[str, npt.NDArray[Any]]
    metadata: dict[str, str]


class _Header(NamedTuple):
    """What a snapshot holds besides particles."""

    time: float
    step: int
    metadata: Mapping[str, str]
    point_data: Sequence[Column]


def write_snapshot(
    comm: MPI.Intracomm,
    folder: Path,
    index: int,
    particles: Particles,
    *,
    time: float,
    step: int,
    metadata: Mapping[str, str],
    n_total: int,
    fields: Collection[str] = SAVED,
    writer: Writer = "auto",
) -> Path:
    """Write the particles of all ranks to ``snapshots/snapshot_<index>.vtkhdf``.

    The file gets its name only when it is complete and on the disk. Then the
    list of snapshots, `SERIES_FILE` in `folder`, is brought up to date:
    snapshots with a larger index, left by a run that was resumed from an
    earlier step, leave the list until they are written again.

    Parameters
    ----------
    comm : MPI.Intracomm
    folder : Path
        Folder of the run; it must exist.
    index : int
        Number of the snapshot.
    particles : Particles
        Owned particles in any order; any rank may own none.
    time : float
        [s].
    step : int
    metadata : mapping of str to str
        Texts in ``/mpisph``, such as ``case`` (TOML) and ``revision``. Those of rank 0
        are written.
    n_total : int
        Ids run from 0 to ``n_total - 1``.
    fields : collection of str, optional
        Which of `SAVED` to write besides position and velocity; all snapshots of a run
        have the same.
    writer : {"auto", "parallel", "gather"}, optional
        See `write_particle_file`.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        On all ranks, if any rank cannot write. No partial file is left.
    ValueError
        On all ranks, if an id lies outside its range, or if `writer` is
        ``parallel`` and h5py was built without MPI.
    """
    path = snapshot_path(folder, index)
    point_data = _point_data(fields)
    header = _Header(time, step, metadata, point_data)
    columns = (_POINTS, *point_data, *_VERTICES)
    layout = FileLayout("snapshot", "VTKHDF", columns, partial(_write_rest, header))
    write_particle_file(comm, path, particles, n_total, layout, writer=writer)
    on_root(comm, lambda: _update_series(folder, path, time))
    return path


def snapshot_path(folder: Path, index: int) -> Path:
    """Return the file of a run's snapshot."""
    return folder / SNAPSHOTS_FOLDER / f"snapshot_{index:05d}.vtkhdf"


def read_snapshot(path: Path) -> Snapshot:
    """Read a snapshot that `write_snapshot` wrote.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Snapshot

    Raises
    ------
    MpisphError
        If the file is damaged, or is not a snapshot of this program.
    OSError
        If the file is missing or cannot be read.
    """
    try:
        with naming(path):
            check_regular(path)
            return _read(path)
    except OSError as error:
        if error.errno is not None:
            raise
        reason = "it is not whole, or no HDF5"
    except ValueError as error:
        reason = str(error)
    except (AttributeError, IndexError, KeyError, RuntimeError, TypeError):
        reason = "parts of it are missing"
    raise MpisphError(f"{path}: damaged, or not a snapshot of mpisph: {reason}")


def _read(path: Path) -> Snapshot:
    """Read a snapshot; h5py has many kinds of errors for one that is damaged."""
    with h5py.File(path, "r") as file:
        if "mpisph" not in file or "VTKHDF/PointData" not in file:
            raise ValueError("it has no particles")
        own = file["mpisph"]
        time, step = float(own.attrs["time"]), int(own.attrs["step"])
        metadata = {name: stored_text(own, name) for name in own}
        arrays = {name: data[...] for name, data in file["VTKHDF/PointData"].items()}
    velocity = arrays.pop("u")
    arrays["u_z"] = np.ascontiguousarray(velocity[:, 0])
    arrays["u_r"] = np.ascontiguousarray(velocity[:, 1])
    return Snapshot(time, step, metadata.get("case", ""), arrays, metadata)


def snapshot_time(path: Path) -> float:
    """Return the time of a snapshot whose columns are all there [s].

    Raises
    ------
    OSError
        If the file is missing or is not HDF5.
    ValueError
        If the file is not a snapshot of this program.
    """
    check_regular(path)
    with h5py.File(path, "r") as file:
        try:
            group = file["VTKHDF"]
            rows = {group[c.name].shape[0] - c.closed for c in (_POINTS, *_VERTICES)}
            names = group["Steps/PointDataOffsets"]
            rows |= {group["PointData"][name].shape[0] for name in names}
            time = float(file["mpisph"].attrs["time"])
        except (
            KeyError, TypeError, AttributeError, IndexError, RuntimeError
        ) as error:  # fmt: skip
            raise ValueError(f"{path}: not a snapshot of mpisph") from error
    if len(rows) != 1:
        raise ValueError(f"{path}: not a snapshot of mpisph")
    return time


def read_series(folder: Path) -> list[tuple[Path, float]]:
    """Return the snapshots listed in a run's folder, with their times [s].

    Parameters
    ----------
    folder : Path
        Folder of the run.

    Returns
    -------
    list of (Path, float)
        In order of time; empty where nothing has been written. Where the list is
        missing or damaged, the snapshots in the folder that can be read.
    """
    try:
        files = json.loads(read_text(folder / SERIES_FILE))["files"]
        # The base name alone: no list leads out of the run's folder.
        names = [Path(file["name"]).name for file in files]
        times = [float(file["time"]) for file in files]
    except (OSError, ValueError, TypeError, KeyError):
        return _found(folder)
    paths = [folder / SNAPSHOTS_FOLDER / name for name in names]
    return list(zip(paths, times, strict=True))


def _found(folder: Path) -> list[tuple[Path, float]]:
    """Return the snapshots in a folder that can be read, with their times."""
    found = []
    for path in sorted((folder / SNAPSHOTS_FOLDER).glob("snapshot_*.vtkhdf")):
        with suppress(OSError, ValueError):
            found.append((path, snapshot_time(path)))
    return found


def write_series(folder: Path, snapshots: Sequence[tuple[Path, float]]) -> None:
    """Write the list of a run's snapshots, with their times [s].

    Raises
    ------
    OSError
        If it cannot be written.
    """
    files = [
        {"name": f"{SNAPSHOTS_FOLDER}/{path.name}", "time": time}
        for path, time in snapshots
    ]
    series = {"file-series-version": "1.0", "files": files}
    write_text(folder / SERIES_FILE, json.dumps(series, indent=1) + "\n")


def _update_series(folder: Path, path: Path, time: float) -> None:
    """Rewrite the list of snapshots so that it ends with `path`."""
    earlier = [entry for entry in read_series(folder) if entry[0].name < path.name]
    write_series(folder, [*earlier, (path, time)])


def _write_rest(header: _Header, file: h5py.File, n: int) -> None:
    """Write everything that is no column."""
    vtk = file.create_group("VTKHDF")
    vtk.attrs["Version"] = np.array([2, 2], np.int64)
    vtk.attrs.create("Type", b"PolyData", dtype="S8")
    vtk["NumberOfPoints"] = np.array([n], np.int64)
    _create_cells(vtk, n)
    _create_steps(vtk, header)
    own = file.create_group("mpisph")
    own.attrs["time"] = header.time
    own.attrs["step"] = header.step
    for name, text in sorted(header.metadata.items()):
        store_text(own, name, text)


def _create_cells(vtk: h5py.Group, n: int) -> None:
    """Describe the cells: one vertex for each point, so that they can be selected.

    VTK's reader wants the three other kinds of cells too, even if empty. Offsets and
    connectivity of the vertices have a row per particle: they are columns.
    """
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        cells = n if kind == "Vertices" else 0
        group = vtk.create_group(kind)
        group["NumberOfCells"] = np.array([cells], np.int64)
        group["NumberOfConnectivityIds"] = np.array([cells], np.int64)
        if kind != "Vertices":
            group["Offsets"] = np.zeros(1, np.int64)
            group.create_dataset("Connectivity", (0,), np.int64)


def _create_steps(vtk: h5py.Group, header: _Header) -> None:
    """Describe the one time step of the file, and which point data it has."""
    steps = vtk.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(1)
    steps["Values"] = np.array([header.time])
    steps["NumberOfParts"] = np.array([1], np.int64)
    steps["PartOffsets"] = np.zeros(1, np.int64)
    steps["PointOffsets"] = np.zeros(1, np.int64)
    steps["CellOffsets"] = np.zeros((1, 4), np.int64)
    steps["ConnectivityIdOffsets"] = np.zeros((1, 4), np.int64)
    for column in header.point_data:
        steps[f"PointDataOffsets/{_base_name(column)}"] = np.zeros(1, np.int64)


def _base_name(column: Column) -> str:
    return column.name.removeprefix("PointData/")


def _as_points(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return vectors in the frame of the points, ``(z, r, 0)``."""
    return np.column_stack([first, second, np.zeros_like(first)])


def _point_data(fields: Collection[str]) -> tuple[Column, ...]:
    """Return the columns of the position, of fields, and of the velocity."""
    alone = {"r", "z", *fields} - {"u_r", "u_z"}
    scalars = (field_column(field) for field in FIELDS if field.name in alone)
    named = (column._replace(name=f"PointData/{column.name}") for column in scalars)
    return (*named, _VELOCITY)


_VELOCITY = Column(
    "PointData/u",
    "f8",
    3,
    "u",
    "m/s",
    "velocity (u_z, u_r, 0)",
    lambda block: _as_points(block.particles.u_z, block.particles.u_r),
)

_POINTS = Column(
    "Points",
    "f4",
    3,
    "(z, r, 0)",
    "m",
    "position, rounded for display",
    lambda block: _as_points(block.particles.z, block.particles.r),
)

_VERTICES = (
    Column(
        "Vertices/Connectivity",
        "i8",
        1,
        "i",
        "1",
        "point of each vertex",
        lambda block: np.arange(block.offset, block.offset + block.particles.n),
    ),
    Column(
        "Vertices/Offsets",
        "i8",
        1,
        "i",
        "1",
        "first row of each vertex in Connectivity, and their end",
        lambda block: np.arange(
            block.offset, block.offset + block.particles.n + block.last
        ),
        closed=True,
    ),
)
