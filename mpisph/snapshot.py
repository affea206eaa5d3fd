"""Snapshots: one VTKHDF file per saved time, the same for any number of ranks.

A snapshot is a VTKHDF PolyData with one vertex per particle, in id order, in
one partition whatever the number of ranks. Its points are ``(z, r, 0)``, so
that ParaView's default view shows the axis of symmetry horizontally; their
single precision is for display, and the exact ``z`` and ``r`` are point data.
The group ``/mpisph``, which VTK ignores, holds the step, the time and the
resolved case.
"""

import json
import os
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import h5py
import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.collectives import (
    by_id_blocks,
    caught,
    gather_all,
    on_root,
    raise_together,
)
from mpisph.files import replace_file, write_text
from mpisph.particles import FIELDS, Field, Particles

Writer = Literal["auto", "parallel", "gather"]

SNAPSHOTS_FOLDER = "snapshots"
SERIES_FILE = "snapshots.vtkhdf.series"

_RESERVE = 2**20
# Room for what a file holds besides columns [bytes].


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
        in id order; ``r`` and ``z`` exact.
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


class _Block(NamedTuple):
    """The particles that one process writes, from row `offset` of `n_total`."""

    particles: Particles
    offset: int
    n_total: int


class _Column(NamedTuple):
    """One dataset with a row per particle."""

    name: str
    dtype: str
    width: int
    symbol: str
    unit: str
    meaning: str
    rows: Callable[[_Block], npt.NDArray[Any]]


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
        Folder of the run.
    index : int
        Number of the snapshot.
    particles : Particles
        Owned particles in any order; any rank may own none.
    time : float
        [s].
    step : int
    metadata : mapping of str to str
        Attributes of ``/mpisph``, such as ``case`` (TOML) and ``revision``.
        Those of rank 0 are written.
    n_total : int
        Ids run from 0 to ``n_total - 1``.
    writer : {"auto", "parallel", "gather"}, optional
        ``parallel`` writes from all ranks at once and needs an h5py built for
        MPI; ``gather`` sends everything to rank 0 first; ``auto`` picks.

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
    path = folder / SNAPSHOTS_FOLDER / f"snapshot_{index:05d}.vtkhdf"
    part = path.with_suffix(".part")
    header = _Header(time, step, comm.bcast(dict(metadata), root=0))
    write = _write_parallel if _is_parallel(writer) else _write_gathered
    mine = by_id_blocks(comm, particles, n_total)
    on_root(comm, lambda: _prepare(part, n_total))
    try:
        write(comm, part, mine, header)
        on_root(comm, lambda: replace_file(part, path))
        on_root(comm, lambda: _update_series(folder, path, time))
    except OSError:
        if comm.rank == 0:
            part.unlink(missing_ok=True)
        raise
    return path


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
    OSError
        If the file is missing or is not HDF5.
    ValueError
        If the file is not a snapshot of this program.
    """
    with h5py.File(path, "r") as file:
        if "mpisph" not in file or "VTKHDF/PointData" not in file:
            msg = f"{path}: not a snapshot of mpisph"
            raise ValueError(msg)
        attributes = dict(file["mpisph"].attrs)
        arrays = {name: data[...] for name, data in file["VTKHDF/PointData"].items()}
    time = float(attributes.pop("time"))
    step = int(attributes.pop("step"))
    velocity = arrays.pop("u")
    arrays["u_z"] = np.ascontiguousarray(velocity[:, 0])
    arrays["u_r"] = np.ascontiguousarray(velocity[:, 1])
    metadata = {name: str(text) for name, text in attributes.items()}
    return Snapshot(time, step, metadata.get("case", ""), arrays, metadata)


def read_series(folder: Path) -> list[tuple[Path, float]]:
    """Return the snapshots listed in a run's folder, with their times [s].

    Parameters
    ----------
    folder : Path
        Folder of the run.

    Returns
    -------
    list of (Path, float)
        In order of time; empty where nothing has been written.
    """
    try:
        text = (folder / SERIES_FILE).read_text(encoding="utf-8")
    except FileNotFoundError:
        return []
    return [(folder / file["name"], file["time"]) for file in json.loads(text)["files"]]


def _update_series(folder: Path, path: Path, time: float) -> None:
    """Rewrite the list of snapshots so that it ends with `path`."""
    earlier = [entry for entry in read_series(folder) if entry[0].name < path.name]
    files = [
        {"name": f"{SNAPSHOTS_FOLDER}/{file.name}", "time": file_time}
        for file, file_time in [*earlier, (path, time)]
    ]
    series = {"file-series-version": "1.0", "files": files}
    write_text(folder / SERIES_FILE, json.dumps(series, indent=1) + "\n")


def _prepare(part: Path, n_total: int) -> None:
    """Make the folder, and fail early where the snapshot cannot be written.

    HDF5 crashes on closing a file whose disk is full, so all of the room is
    asked for beforehand. It is free again when HDF5 opens the file.
    """
    row = sum(np.dtype(column.dtype).itemsize * column.width for column in _COLUMNS)
    needed = row * n_total + _RESERVE
    part.parent.mkdir(parents=True, exist_ok=True)
    with part.open("wb") as file:
        try:
            os.posix_fallocate(file.fileno(), 0, needed)
        except OSError as error:
            part.unlink()
            msg = f"{error.strerror} for a snapshot of {needed} bytes"
            raise OSError(error.errno, msg, str(part.parent)) from error


def _is_parallel(writer: Writer) -> bool:
    built_for_mpi = bool(h5py.get_config().mpi)
    if writer == "parallel" and not built_for_mpi:
        msg = "writer = 'parallel': this h5py was built without MPI; use 'gather'"
        raise ValueError(msg)
    return built_for_mpi and writer != "gather"


def _write_parallel(
    comm: MPI.Intracomm, part: Path, mine: Particles, header: _Header
) -> None:
    """Write blocks of ids from all ranks at once."""
    block = _Block(mine, comm.scan(mine.n) - mine.n, comm.allreduce(mine.n))
    transfer = h5py.h5p.create(h5py.h5p.DATASET_XFER)
    transfer.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)

    def write() -> None:
        with h5py.File(part, "w", driver="mpio", comm=comm) as file:
            _write_file(file, block, transfer, header)

    raise_together(comm, caught(write))


def _write_gathered(
    comm: MPI.Intracomm, part: Path, mine: Particles, header: _Header
) -> None:
    """Send everything to rank 0 and write there."""
    everything = gather_all(comm, mine)
    transfer = h5py.h5p.create(h5py.h5p.DATASET_XFER)

    def write() -> None:
        assert everything is not None, "on_root calls this on rank 0 only"
        block = _Block(everything, 0, everything.n)
        with h5py.File(part, "w") as file:
            _write_file(file, block, transfer, header)

    on_root(comm, write)


def _write_file(
    file: h5py.File, block: _Block, transfer: h5py.h5p.PropDXID, header: _Header
) -> None:
    """Write everything, and go on after an error so that no rank waits.

    A rank that left at its first error would leave the others in the next
    collective write.

    Raises
    ------
    OSError
        The first error this rank met.
    """
    vtk = file.create_group("VTKHDF")
    vtk.attrs["Version"] = np.array([2, 2], np.int64)
    vtk.attrs.create("Type", b"PolyData", dtype="S8")
    vtk["NumberOfPoints"] = np.array([block.n_total], np.int64)
    _create_cells(vtk, block.n_total)
    _create_steps(vtk, header.time)
    own = file.create_group("mpisph")
    own.attrs["time"] = header.time
    own.attrs["step"] = header.step
    for name, text in sorted(header.metadata.items()):
        own.attrs[name] = text
    errors = [
        caught(partial(_write_column, vtk, column, block, transfer))
        for column in _COLUMNS
    ]
    for error in filter(None, errors):
        raise error


def _create_cells(vtk: h5py.Group, n: int) -> None:
    """Describe one cell, a poly-vertex of all points.

    VTK's reader wants the three other kinds of cells too, even if empty. The
    connectivity of the vertices has a row per particle: it is a column.
    """
    for kind in ("Vertices", "Lines", "Polygons", "Strips"):
        cells = int(kind == "Vertices")
        group = vtk.create_group(kind)
        group["NumberOfCells"] = np.array([cells], np.int64)
        group["NumberOfConnectivityIds"] = np.array([cells * n], np.int64)
        group["Offsets"] = np.array([0, n][: cells + 1], np.int64)
        if not cells:
            group.create_dataset("Connectivity", (0,), np.int64)


def _create_steps(vtk: h5py.Group, time: float) -> None:
    """Describe the one time step of the file."""
    steps = vtk.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(1)
    steps["Values"] = np.array([time])
    steps["NumberOfParts"] = np.array([1], np.int64)
    steps["PartOffsets"] = np.zeros(1, np.int64)
    steps["PointOffsets"] = np.zeros(1, np.int64)
    steps["CellOffsets"] = np.zeros((1, 4), np.int64)
    steps["ConnectivityIdOffsets"] = np.zeros((1, 4), np.int64)
    for column in _POINT_DATA:
        steps[f"PointDataOffsets/{_base_name(column)}"] = np.zeros(1, np.int64)


def _write_column(
    vtk: h5py.Group, column: _Column, block: _Block, transfer: h5py.h5p.PropDXID
) -> None:
    """Create a dataset and write this process's rows of it."""
    tail = () if column.width == 1 else (column.width,)
    dataset = vtk.create_dataset(
        column.name, (block.n_total, *tail), column.dtype, fill_time="never"
    )
    dataset.attrs["symbol"] = column.symbol
    dataset.attrs["unit"] = column.unit
    dataset.attrs["meaning"] = column.meaning
    if block.n_total == 0:
        return
    n = block.particles.n
    in_file = dataset.id.get_space()
    in_memory = h5py.h5s.create_simple((n, *tail))
    if n:
        in_file.select_hyperslab((block.offset, *(0 for _ in tail)), (n, *tail))
    else:
        # h5py's own slicing deadlocks on an empty collective selection.
        in_file.select_none()
        in_memory.select_none()
    rows = np.ascontiguousarray(column.rows(block), column.dtype)
    dataset.id.write(in_memory, in_file, rows, dxpl=transfer)


def _base_name(column: _Column) -> str:
    return column.name.removeprefix("PointData/")


def _as_points(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return vectors in the frame of the points, ``(z, r, 0)``."""
    return np.column_stack([first, second, np.zeros_like(first)])


def _field_column(field: Field) -> _Column:
    """Return the column of a scalar field."""
    return _Column(
        f"PointData/{field.name}",
        "i8" if field.role == "label" else "f8",
        1,
        field.symbol,
        field.unit,
        field.meaning,
        lambda block: getattr(block.particles, field.name),
    )


_POINT_DATA = (
    *(
        _field_column(field)
        for field in FIELDS
        if field.name in {"r", "z"}
        or (field.saved and field.name not in {"u_r", "u_z"})
    ),
    _Column(
        "PointData/u",
        "f8",
        3,
        "u",
        "m/s",
        "velocity (u_z, u_r, 0)",
        lambda block: _as_points(block.particles.u_z, block.particles.u_r),
    ),
)

_COLUMNS = (
    _Column(
        "Points",
        "f4",
        3,
        "(z, r, 0)",
        "m",
        "position, rounded for display",
        lambda block: _as_points(block.particles.z, block.particles.r),
    ),
    *_POINT_DATA,
    _Column(
        "Vertices/Connectivity",
        "i8",
        1,
        "i",
        "1",
        "points of the one poly-vertex",
        lambda block: np.arange(block.offset, block.offset + block.particles.n),
    ),
)
