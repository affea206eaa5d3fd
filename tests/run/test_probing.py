"""Bodies and gauges of a run: their tables, and what a stop leaves of them."""

import numpy as np
import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree
from run_folders import differences
from small_runs import StopAt

from mpisph.case import load_case
from mpisph.io.history import read_history
from mpisph.io.probe_files import probe_headers, read_probes_file
from mpisph.run.session import resume, run

GAUGES = """
[[gauges]]
name = "rear"
z = "4 mm"

[[gauges]]
name = "tracer"
kind = "moving"
z = "2 mm"
r = "1 mm"

[[gauges]]
name = "behind"
z = "8 mm"
r = "1 mm"
"""


def case_with_gauges(folder, *more):
    path = folder / "case-with-gauges.toml"
    shot = (CASES / "piekutowski-4-1353.toml").read_text()
    path.write_text(shot + GAUGES)
    settings = ("resolution.npr=4", "time.end=1.6us", "output.every=0.8us",
                "measured=", "output.figures=false")  # fmt: skip
    return load_case(path, (*settings, *more))


def tables(folder, case):
    return [
        read_probes_file(folder / name, header)
        for name, header in probe_headers(case).items()
    ]


def test_bodies_add_up_to_the_history_and_gauges_follow_the_shock(tmp_path):
    case = case_with_gauges(tmp_path)
    run(case, MPI.COMM_SELF, tmp_path)
    bodies, gauges = tables(tmp_path, case)
    history = read_history(tmp_path / "history.csv")
    for name in ("step", "time"):
        suffix = "_s" if name == "time" else ""
        np.testing.assert_array_equal(bodies[name + suffix], history[name])
        np.testing.assert_array_equal(gauges[name + suffix], history[name])
    for name, unit in (("mass", "kg"), ("momentum_z", "kg_m_per_s"),
                       ("kinetic_energy", "J"), ("internal_energy", "J")):  # fmt: skip
        parts = [bodies[f"{name}_{body}_{unit}"] for body in ("sphere", "plate")]
        scale = np.abs(history[name]).max()
        np.testing.assert_allclose(sum(parts), history[name], atol=1e-14 * scale)
    for body in ("sphere", "plate"):
        peak = bodies[f"peak_pressure_{body}_Pa"]
        assert np.all(np.diff(peak) >= 0.0)
        assert 3e10 < peak[-1] < 3e11  # some 100 GPa
    # The plate gives way: the tracer moves on, and matter comes to where was none.
    assert np.all(np.diff(gauges["z_tracer_m"]) >= 0.0)
    assert gauges["z_tracer_m"][-1] > 4e-3
    assert gauges["P_tracer_Pa"].max() > 1e10
    assert np.isnan(gauges["P_behind_Pa"][0])
    assert np.isfinite(gauges["P_behind_Pa"][-1])
    assert set(gauges["z_rear_m"]) == {4e-3}


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("every", [1, 3])
def test_a_stopped_run_has_the_same_tables(mpi_tmp_path, every):
    world = MPI.COMM_WORLD
    if world.rank == 0:
        case_with_gauges(mpi_tmp_path)
    world.Barrier()
    settings = ("resolution.npr=4", "time.end=1us", "output.every=0.5us", "measured=",
                "output.figures=false", f"output.history_every={every}")  # fmt: skip
    case = load_case(mpi_tmp_path / "case-with-gauges.toml", settings)
    once, stopped = (mpi_tmp_path / name for name in ("once", "stopped"))
    whole = run(case, world, once)
    run(case, world, stopped, signals=StopAt(2 + whole.step // 3))
    resume(world, stopped)
    alone = mpi_tmp_path / "alone"
    if world.rank == 0:
        run(case, MPI.COMM_SELF, alone)
        problems = differences(stopped, once) + differences(alone, once)
    agree(world, world.bcast(problems if world.rank == 0 else None))


def test_a_damaged_table_is_told_and_its_rows_are_kept(tmp_path):
    case = case_with_gauges(tmp_path)
    folder = tmp_path / "run"
    run(case, MPI.COMM_SELF, folder, signals=StopAt(12))
    path = folder / "gauges.csv"
    lines = path.read_text().splitlines()
    lines[4] = lines[4].replace(",", ";")
    path.write_text("\n".join(lines) + "\n")
    (folder / "bodies.csv").unlink()
    result = resume(MPI.COMM_SELF, folder)
    assert result.status == "completed"
    said = (folder / "log.txt").read_text()
    assert "warning: gauges.csv is not what was written; 10 of 11 rows kept" in said
    assert "warning: bodies.csv is missing; 0 of 11 rows kept" in said
    bodies, gauges = tables(folder, case)
    assert len(gauges) == result.step
    assert len(bodies) == result.step + 1 - 11
