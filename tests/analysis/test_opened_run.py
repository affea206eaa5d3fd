"""What ``mpisph.open`` gives of a run."""

import subprocess
import sys

import numpy as np
import pytest
from small_runs import unended

import mpisph
from mpisph.analysis.hole import measure_hole
from mpisph.core.errors import MpisphError
from mpisph.io.snapshot import read_series, read_snapshot


@pytest.fixture(scope="module")
def opened(finished):
    return mpisph.open(str(finished))


def test_importing_the_package_loads_nothing_heavy():
    code = (
        "import sys, mpisph\n"
        "assert 'open' in dir(mpisph)\n"
        "heavy = {'numpy', 'numba', 'mpi4py', 'h5py', 'pydantic', 'matplotlib'}\n"
        "sys.exit(', '.join(heavy & set(sys.modules)) or None)"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_the_public_names_are_there():
    for name in mpisph.__all__:
        assert getattr(mpisph, name) is not None
    with pytest.raises(AttributeError, match="nosuch"):
        _ = mpisph.nosuch


def test_a_run_has_its_case_result_and_history(opened):
    assert opened.state == opened.result.status == "completed"
    assert opened.case.resolution.npr == 4
    assert opened.history["time"][-1] == opened.result.time
    assert opened.clouds == opened.result.clouds
    assert opened.comparisons == opened.result.comparisons
    assert "completed" in repr(opened)


def test_snapshots_are_found_by_their_time(opened, finished):
    assert len(opened.snapshots) == len(read_series(finished))
    for time in ("1 us", 1e-6):
        assert opened.at(time).time == pytest.approx(1e-6)
    assert opened.at(0).time == 0.0
    with pytest.raises(MpisphError, match=r"no snapshot at 1\.1 us; there are 0 us, "):
        opened.at("1.1 us")
    with pytest.raises(MpisphError, match="expected a time"):
        opened.at("1 km")


def test_a_snapshot_is_arrays_by_name(opened):
    snapshot = opened.at("1 us")
    want = read_snapshot(snapshot.path).arrays
    assert set(snapshot) == set(want)
    np.testing.assert_array_equal(snapshot["rho"], want["rho"])
    plate = snapshot.body("plate")
    assert 0 < plate.sum() < plate.size
    with pytest.raises(MpisphError, match="no body 'wall'; there are"):
        snapshot.body("wall")


def test_what_is_measured_is_what_the_run_has_measured(opened):
    snapshot = opened.at("1 us")
    (record,) = (c for c in opened.clouds if c.time == snapshot.time)
    assert snapshot.cloud() == record.measure
    assert snapshot.hole() == measure_hole(snapshot.arrays, opened.case)
    assert snapshot.fragments().mass.sum() == pytest.approx(record.mass)
    assert snapshot.spray(bins=4).mass.shape == (2, 4)


def test_a_mesh_has_a_cell_for_each_particle(opened):
    pytest.importorskip("pyvista")
    snapshot = opened.at("1 us")
    mesh = snapshot.mesh()
    assert mesh.n_cells == snapshot["id"].size
    np.testing.assert_array_equal(mesh.points[:, :2].T, [snapshot["z"], snapshot["r"]])
    assert set(mesh.point_data.keys()) == {*snapshot, "u"}
    kept = mesh.threshold(0.5, scalars="body")
    assert kept.n_cells == snapshot["body"].sum()


def test_a_mesh_asks_for_pyvista(opened, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(MpisphError, match="pip install"):
        opened.at("1 us").mesh()


def test_notebooks_show_tables(opened):
    page = opened._repr_html_()
    assert "<th>R_b [mm]</th>" in page
    assert opened.case.title in page
    assert "<td>rho</td>" in opened.at("1 us")._repr_html_()


def test_titles_are_no_html(finished, tmp_path):
    folder = unended(tmp_path / "run", finished)
    text = (folder / "case.toml").read_text()
    title = mpisph.open(finished).case.title
    (folder / "case.toml").write_text(text.replace(title, "<script>"))
    assert "<script>" not in mpisph.open(folder)._repr_html_()


def test_a_run_without_a_result_is_opened_too(finished, tmp_path):
    run = mpisph.open(unended(tmp_path / "run", finished, state="stopped"))
    assert (run.state, run.result) == ("stopped", None)
    assert len(run.clouds) == len(mpisph.open(finished).clouds)


def test_what_is_no_run_is_refused(tmp_path):
    with pytest.raises(MpisphError, match=r"no case\.toml"):
        mpisph.open(tmp_path)


def test_what_is_not_measured_is_a_dash(opened, monkeypatch):
    record = opened.clouds[0]
    gone = record.model_copy(update={"radius": float("nan"), "mass": float("nan")})
    monkeypatch.setattr(type(opened), "clouds", (gone,))
    page = opened._repr_html_()
    assert page.count("<td>\u2013</td>") == 2
    assert "nan" not in page
