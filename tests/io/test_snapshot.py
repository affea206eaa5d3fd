"""Snapshots: contents against what was put in, and files against each other."""

import errno
import json
import os
import resource
from contextlib import contextmanager

import h5py
import numpy as np
import pytest
from mpi4py import MPI
from oracles import numbered, share

import mpisph.io.particle_file
from mpisph.core.errors import CollectiveError, MpisphError
from mpisph.core.particles import FIELDS
from mpisph.io.snapshot import (
    read_series,
    read_snapshot,
    snapshot_time,
    write_snapshot,
)

SELF = MPI.COMM_SELF
CASE = 'title = "Größe"\n'
METADATA = {"case": CASE, "revision": "abc-dirty", "versions": '{"numpy": "2"}'}


def write(comm, folder, n=50, index=3, **options):
    values = {"time": 6e-6, "step": 12, "metadata": METADATA, "n_total": n} | options
    if comm.rank == 0 and not folder.is_file():
        folder.mkdir(exist_ok=True)
    mine = numbered(share(comm, n))
    return write_snapshot(comm, folder, index, mine, **values)


def contents(path):
    """Return every dataset and attribute of a file, bits and types included."""
    found = {}

    def visit(name, item):
        for key, value in item.attrs.items():
            found[f"{name}@{key}"] = (str(np.asarray(value).dtype), repr(value))
        if isinstance(item, h5py.Dataset):
            data = item[...]
            found[name] = (str(data.dtype), data.shape, data.tobytes())

    with h5py.File(path) as file:
        file.visititems(visit)
    return found


def test_reading_returns_the_bits_written(tmp_path):
    path = write(SELF, tmp_path)
    assert path == tmp_path / "snapshots" / "snapshot_00003.vtkhdf"
    got = read_snapshot(path)
    want = numbered(np.arange(50))
    assert got[:3] == (6e-6, 12, CASE)
    assert got.metadata == METADATA
    names = {f.name for f in FIELDS if f.saved} | {"r", "z"}
    assert set(got.arrays) == names
    for name in names:
        np.testing.assert_array_equal(got.arrays[name], getattr(want, name))
        assert got.arrays[name].dtype == getattr(want, name).dtype


def test_a_snapshot_carries_the_fields_it_is_given_and_says_so(tmp_path):
    path = write(SELF, tmp_path, fields={"id", "u_r", "rho", "T"})
    assert set(read_snapshot(path).arrays) == {"id", "r", "z", "u_r", "u_z", "rho", "T"}
    with h5py.File(path) as file:
        steps = file["VTKHDF/Steps/PointDataOffsets"]
        assert set(steps) == set(file["VTKHDF/PointData"])
    assert snapshot_time(path) == 6e-6


@pytest.mark.parametrize("missing", ["T", "u"])
def test_a_snapshot_without_a_field_that_it_names_is_none(tmp_path, missing):
    path = write(SELF, tmp_path)
    with h5py.File(path, "r+") as file:
        del file[f"VTKHDF/PointData/{missing}"]
    with pytest.raises(ValueError, match="not a snapshot"):
        snapshot_time(path)


def test_points_are_z_r_0_in_single_precision(tmp_path):
    want = numbered(np.arange(50))
    with h5py.File(write(SELF, tmp_path)) as file:
        points = file["VTKHDF/Points"][...]
        u = file["VTKHDF/PointData/u"][...]
    assert points.dtype == np.float32
    np.testing.assert_array_equal(points[:, 0], want.z.astype(np.float32))
    np.testing.assert_array_equal(points[:, 1], want.r.astype(np.float32))
    np.testing.assert_array_equal(u[:, 0], want.u_z)
    np.testing.assert_array_equal(u[:, 1], want.u_r)
    assert not points[:, 2].any()
    assert not u[:, 2].any()


def test_every_column_names_symbol_unit_and_meaning(tmp_path):
    with h5py.File(write(SELF, tmp_path)) as file:
        data = file["VTKHDF/PointData"]
        assert dict(data["rho"].attrs) == {
            "symbol": "rho",
            "unit": "kg/m3",
            "meaning": "density",
        }
        for name, column in data.items():
            assert set(column.attrs) == {"symbol", "unit", "meaning"}, name


def bodies_apart(folder):
    """A snapshot of two bodies, by turns, and the points of the second."""
    mine = numbered(np.arange(50))
    mine.body[:] = np.arange(50) % 2
    path = write_snapshot(
        SELF, folder, 0, mine, time=0.0, step=0, metadata={}, n_total=50
    )
    points = np.column_stack([mine.z, mine.r, np.zeros(50)])[1::2]
    return path, points.astype(np.float32)


def test_vtk_selects_a_body(tmp_path):
    """As in ParaView: the filter threshold keeps or drops whole cells."""
    pytest.importorskip("vtkmodules")
    from vtkmodules.numpy_interface.dataset_adapter import WrapDataObject
    from vtkmodules.vtkCommonDataModel import vtkDataObject
    from vtkmodules.vtkFiltersCore import vtkThreshold
    from vtkmodules.vtkIOHDF import vtkHDFReader

    path, points = bodies_apart(tmp_path)
    reader = vtkHDFReader(file_name=str(path))
    threshold = vtkThreshold(lower_threshold=0.5, upper_threshold=1.5)
    threshold.SetInputConnection(reader.GetOutputPort())
    of_points = vtkDataObject.FIELD_ASSOCIATION_POINTS
    threshold.SetInputArrayToProcess(0, 0, 0, of_points, "body")
    threshold.Update()
    kept = WrapDataObject(threshold.GetOutput())
    np.testing.assert_array_equal(kept.Points, points)
    assert kept.GetNumberOfCells() == 25


def test_pyvista_selects_a_body(tmp_path):
    pyvista = pytest.importorskip("pyvista")
    path, points = bodies_apart(tmp_path)
    kept = pyvista.read(path).threshold(0.5, scalars="body")
    assert kept.n_cells == 25
    np.testing.assert_array_equal(kept.points, points)


@pytest.mark.parametrize("n", [1, 50])
def test_pyvista_reads_it(tmp_path, n):
    pyvista = pytest.importorskip("pyvista")
    mesh = pyvista.read(write(SELF, tmp_path, n))
    want = numbered(np.arange(n))
    assert (mesh.n_points, mesh.n_cells) == (n, n)
    np.testing.assert_array_equal(mesh.points[:, 0], want.z.astype(np.float32))
    np.testing.assert_array_equal(mesh.verts.reshape(n, 2), [[1, k] for k in range(n)])
    np.testing.assert_array_equal(mesh.point_data["rho"], want.rho)
    np.testing.assert_array_equal(mesh.point_data["id"], want.id)
    np.testing.assert_array_equal(mesh.point_data["u"][:, 0], want.u_z)


def test_the_one_step_has_its_time_and_starts_at_the_beginning(tmp_path):
    with h5py.File(write(SELF, tmp_path)) as file:
        steps = file["VTKHDF/Steps"]
        assert steps.attrs["NSteps"] == 1
        assert steps["Values"][...].tolist() == [6e-6]
        offsets = [steps[name] for name in steps if "Offsets" in name]
        assert set(steps["PointDataOffsets"]) == set(file["VTKHDF/PointData"])
        for item in [*offsets, *steps["PointDataOffsets"].values()]:
            if isinstance(item, h5py.Dataset):
                assert not item[...].any()


@pytest.mark.parametrize("writer", ["parallel", "gather"])
def test_no_particles_at_all(tmp_path, writer):
    path = write(SELF, tmp_path, 0, writer=writer)
    assert all(len(array) == 0 for array in read_snapshot(path).arrays.values())


def test_particles_may_be_missing(tmp_path):
    mine = numbered([7, 2, 5])
    path = write_snapshot(
        SELF, tmp_path, 0, mine, time=0.0, step=0, metadata={}, n_total=10
    )
    got = read_snapshot(path)
    assert got.case == ""
    assert got.arrays["id"].tolist() == [2, 5, 7]


def test_the_series_lists_names_and_times(tmp_path):
    for index in range(3):
        write(SELF, tmp_path, index=index, time=index * 1e-6)
    series = json.loads((tmp_path / "snapshots.vtkhdf.series").read_text())
    assert series["file-series-version"] == "1.0"
    assert series["files"] == [
        {"name": f"snapshots/snapshot_0000{k}.vtkhdf", "time": k * 1e-6}
        for k in range(3)
    ]
    path = tmp_path / "snapshots" / "snapshot_00002.vtkhdf"
    assert read_series(tmp_path)[2] == (path, 2e-6)


def test_a_resumed_run_takes_later_snapshots_off_the_list(tmp_path):
    for index in range(4):
        write(SELF, tmp_path, index=index, time=float(index))
    write(SELF, tmp_path, index=1, time=1.5)
    assert [time for _, time in read_series(tmp_path)] == [0.0, 1.5]


def test_the_series_leads_nowhere_else(tmp_path):
    """Nor does a snapshot that is added to a list from elsewhere."""
    files = [{"name": "../../../elsewhere/snapshot_00000.vtkhdf", "time": 0.0}]
    series = tmp_path / "snapshots.vtkhdf.series"
    series.write_text(json.dumps({"file-series-version": "1.0", "files": files}))
    assert read_series(tmp_path) == [
        (tmp_path / "snapshots" / "snapshot_00000.vtkhdf", 0.0)
    ]
    write(SELF, tmp_path, index=1)
    assert ".." not in series.read_text()


@pytest.mark.parametrize(
    "text", ["", "[]", '{"files": [1]}', '{"files": [{}]}', "\xff", None]
)
def test_a_series_that_is_damaged_or_missing_is_made_from_the_folder(tmp_path, text):
    for index in range(4):
        write(SELF, tmp_path, index=index, time=float(index))
    series = tmp_path / "snapshots.vtkhdf.series"
    if text is None:
        series.unlink()
    else:
        series.write_text(text, encoding="latin-1")
    damaged = tmp_path / "snapshots" / "snapshot_00001.vtkhdf"
    damaged.write_bytes(damaged.read_bytes()[:3000])
    assert [time for _, time in read_series(tmp_path)] == [0.0, 2.0, 3.0]
    write(SELF, tmp_path, index=4, time=4.0)
    files = json.loads(series.read_text())["files"]
    assert [file["time"] for file in files] == [0.0, 2.0, 3.0, 4.0]


def test_a_pipe_for_a_series_keeps_nobody(tmp_path):
    write(SELF, tmp_path, index=0, time=0.5)
    series = tmp_path / "snapshots.vtkhdf.series"
    series.unlink()
    os.mkfifo(series)
    assert [time for _, time in read_series(tmp_path)] == [0.5]


def test_an_empty_folder_has_an_empty_series(tmp_path):
    assert read_series(tmp_path) == []


def test_only_finished_files_remain(tmp_path):
    write(SELF, tmp_path)
    names = sorted(path.name for path in tmp_path.rglob("*") if path.is_file())
    assert names == ["snapshot_00003.vtkhdf", "snapshots.vtkhdf.series"]


def test_a_foreign_file_is_refused(tmp_path):
    path = tmp_path / "other.h5"
    with h5py.File(path, "w") as file:
        file["x"] = 1
    with pytest.raises(MpisphError, match=r"other\.h5: .*not a snapshot"):
        read_snapshot(path)


@pytest.mark.parametrize("left", [0, 100, 3000, 0.5, 0.9])
def test_a_damaged_snapshot_is_named(tmp_path, left):
    path = write(SELF, tmp_path)
    size = path.stat().st_size
    os.truncate(path, int(left * size) if left < 1 else left)
    with pytest.raises(MpisphError, match=rf"{path.name}: damaged"):
        read_snapshot(path)


def test_a_missing_snapshot_is_named(tmp_path):
    with pytest.raises(FileNotFoundError) as caught:
        read_snapshot(tmp_path / "none.vtkhdf")
    assert caught.value.filename == str(tmp_path / "none.vtkhdf")


def test_parallel_writer_without_parallel_h5py_is_refused(tmp_path, monkeypatch):
    class Config:
        mpi = False

    monkeypatch.setattr(mpisph.io.particle_file.h5py, "get_config", Config)
    with pytest.raises(ValueError, match="without MPI"):
        write(SELF, tmp_path, writer="parallel")
    # "auto" then gathers, and the file is the same.
    gathered = write(SELF, tmp_path / "a")
    monkeypatch.undo()
    assert contents(gathered) == contents(write(SELF, tmp_path / "b"))


@contextmanager
def file_size_limit(size):
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def by_writer(test):
    return pytest.mark.parametrize("writer", ["parallel", "gather"])(test)


@pytest.mark.mpi(min_size=1)
@by_writer
@pytest.mark.parametrize("n", [0, 1, 2, 1000])
def test_files_do_not_depend_on_the_number_of_ranks(mpi_tmp_path, writer, n):
    comm = MPI.COMM_WORLD
    reference = None
    if comm.rank == 0:
        reference = contents(write(SELF, mpi_tmp_path / "one", n, writer="gather"))
    reference = comm.bcast(reference)
    for size in range(1, comm.size + 1):
        part = comm.Split(0 if comm.rank < size else 1, comm.rank)
        if comm.rank < size:
            path = write(part, mpi_tmp_path / str(size), n, writer=writer)
            assert contents(path) == reference
        part.Free()
        comm.barrier()


@pytest.mark.mpi(min_size=2)
@by_writer
def test_all_on_one_rank(mpi_tmp_path, writer):
    comm = MPI.COMM_WORLD
    mine = numbered(np.arange(30)[::-1] if comm.rank == comm.size - 1 else [])
    path = write_snapshot(
        comm,
        mpi_tmp_path,
        0,
        mine,
        time=0.0,
        step=0,
        metadata=METADATA if comm.rank == 0 else {"case": "of another rank"},
        n_total=30,
        writer=writer,
    )
    got = read_snapshot(path)
    np.testing.assert_array_equal(got.arrays["rho"], numbered(np.arange(30)).rho)
    assert got.case == CASE


@pytest.mark.mpi(min_size=1)
@by_writer
def test_a_folder_that_cannot_be_made(mpi_tmp_path, writer):
    comm = MPI.COMM_WORLD
    folder = mpi_tmp_path / "file"
    if comm.rank == 0:
        folder.write_text("not a folder")
    comm.barrier()
    with pytest.raises(CollectiveError, match="snapshots") as raised:
        write(comm, folder, writer=writer)
    assert raised.value.errno == errno.ENOTDIR


@pytest.mark.mpi(min_size=1)
@by_writer
@pytest.mark.parametrize("failing", ["first", "all"])
def test_a_disk_that_refuses(mpi_tmp_path, writer, failing):
    """The system lets no file grow to the size needed, on rank 0 or on all ranks."""
    comm = MPI.COMM_WORLD
    limited = failing == "all" or comm.rank == 0
    size = 100_000 if limited else resource.RLIM_INFINITY
    with (
        file_size_limit(size),
        pytest.raises(
            OSError, match=r"for a snapshot of \d+ bytes: .*snapshots"
        ) as got,
    ):
        write(comm, mpi_tmp_path, 20_000, writer=writer)
    assert got.value.errno == errno.EFBIG
    check_recovery(comm, mpi_tmp_path, writer)


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize(
    "error", [OSError(errno.EIO, "broken"), RuntimeError("broken")]
)
@by_writer
def test_one_column_of_one_rank_fails(mpi_tmp_path, monkeypatch, writer, error):
    comm = MPI.COMM_WORLD
    write_column = mpisph.io.particle_file._write_column

    def failing(vtk, column, *rest):
        write_column(vtk, column, *rest)
        if column.name.endswith("rho"):
            raise error

    culprit = comm.size - 1 if writer == "parallel" else 0
    if comm.rank == culprit:
        monkeypatch.setattr(mpisph.io.particle_file, "_write_column", failing)
    with pytest.raises(OSError, match=rf"broken \(rank {culprit} of {comm.size}"):
        write(comm, mpi_tmp_path, writer=writer)
    monkeypatch.undo()
    check_recovery(comm, mpi_tmp_path, writer)


def check_recovery(comm, folder, writer):
    """Check that nothing was left behind and that the next snapshot succeeds."""
    comm.barrier()
    assert not [path for path in folder.rglob("*") if path.is_file()]
    comm.barrier()
    path = write(comm, folder, writer=writer)
    assert read_snapshot(path).step == 12
