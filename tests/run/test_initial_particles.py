"""Runs that start from particles of one's own."""

import shutil

import numpy as np
import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree
from run_folders import assert_same, differences
from small_runs import StopAt

import mpisph
from mpisph.case.discretise import discretise
from mpisph.case.initial import complete_particles
from mpisph.core.errors import CaseError
from mpisph.io.initial_file import write_initial
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.run.session import resume, run

SELF = MPI.COMM_SELF
SETTINGS = (
    "resolution.npr=4",
    "time.end=0.4us",
    "output.every=0.2us",
    "output.figures=false",
)


def short_case(*more):
    return mpisph.load_case(CASES / "piekutowski-4-1353.toml", (*SETTINGS, *more))


def warm(case):
    """The particles of a case, with some heat in them, in an order of their own."""
    fields = discretise(case).fields()
    order = np.random.default_rng(1).permutation(fields["id"].size)
    own = {name: values[order] for name, values in fields.items() if name != "h"}
    return own | {"E": np.full(order.size, 1e4), "plastic_strain": own["r"] * 10.0}


def test_particles_of_the_case_itself_change_no_bit(tmp_path):
    case = short_case()
    run(case, SELF, tmp_path / "plain")
    mpisph.run(case, SELF, tmp_path / "given", particles=discretise(case).fields())
    for (plain, _), (given, _) in zip(
        *(read_series(tmp_path / name) for name in ("plain", "given")), strict=True
    ):
        a, b = read_snapshot(plain).arrays, read_snapshot(given).arrays
        for name, values in a.items():
            np.testing.assert_array_equal(values, b[name])


@pytest.mark.mpi(min_size=1)
def test_any_number_of_ranks_gives_the_same_bits(mpi_tmp_path):
    """The arrays of rank 0 count, and no other rank needs any."""
    world, case = MPI.COMM_WORLD, short_case()
    own = warm(case) if world.rank == 0 else None
    result = run(case, world, mpi_tmp_path / "all", particles=own)
    problems = [] if result.status == "completed" else [result.status]
    if world.rank == 0:
        run(case, SELF, mpi_tmp_path / "one", particles=own)
        problems += differences(mpi_tmp_path / "all", mpi_tmp_path / "one")
        path, _ = read_series(mpi_tmp_path / "all")[0]
        arrays = read_snapshot(path).arrays
        problems += [n for n in ("E", "plastic_strain") if not arrays[n].any()]
    agree(world, problems)


@pytest.fixture(scope="module")
def reference(tmp_path_factory):
    folder = tmp_path_factory.mktemp("own") / "reference"
    case = short_case()
    run(case, SELF, folder, particles=warm(case))
    return folder


@pytest.mark.parametrize("checkpoint", [True, False])
def test_a_stopped_run_needs_nothing_but_its_folder(tmp_path, reference, checkpoint):
    case, folder = short_case(), tmp_path / "stopped"
    first = run(case, SELF, folder, particles=warm(case), signals=StopAt(5))
    assert first.status == "stopped"
    if not checkpoint:
        shutil.rmtree(folder / "checkpoints")
    resume(SELF, folder)
    assert_same(folder, reference)


def test_a_file_does_the_same_wherever_it_lies(tmp_path, reference):
    case = short_case()
    write_initial(tmp_path, complete_particles(case, warm(case), "particles"))
    text = case.to_toml() + '[initial]\nfile = "initial.h5"\n'
    (tmp_path / "case.toml").write_text(text)
    loaded = mpisph.load_case(tmp_path / "case.toml")
    run(loaded, SELF, tmp_path / "run")
    assert_same(tmp_path / "run", reference)
    again = mpisph.load_case(tmp_path / "run" / "case.toml")
    run(again, SELF, tmp_path / "run", force=True)
    assert_same(tmp_path / "run", reference)


def test_the_same_particles_are_not_run_again_and_others_refused(tmp_path, capsys):
    case, own = short_case(), warm(short_case())
    run(case, SELF, tmp_path, particles=own)
    run(case, SELF, tmp_path, particles=own)
    assert "nothing to do" in capsys.readouterr().err
    with pytest.raises(CaseError, match=r"initial\.digest"):
        run(case, SELF, tmp_path, particles={**own, "E": own["E"] * 2.0})
    with pytest.raises(CaseError, match="holds a run of another case"):
        run(case, SELF, tmp_path)
    run(case, SELF, tmp_path, force=True)
    assert not (tmp_path / "initial.h5").exists()


def test_a_snapshot_of_another_run_is_a_start(tmp_path, reference):
    case = short_case("time.end=0.2us")
    last = mpisph.open(reference).snapshots[-1]
    from_arrays = run(case, SELF, tmp_path / "arrays", particles=last)
    text = case.to_toml() + f'[initial]\nfile = "{last.path}"\n'
    (tmp_path / "case.toml").write_text(text)
    loaded = mpisph.load_case(tmp_path / "case.toml")
    assert run(loaded, SELF, tmp_path / "file").particles == from_arrays.particles
    begun = read_snapshot(read_series(tmp_path / "file")[0][0]).arrays
    for name in ("r", "E", "rho", "u_r"):
        np.testing.assert_array_equal(begun[name], last[name])
    for name in ("plastic_strain", "S_rz"):  # a yielding stress is set to the yield
        np.testing.assert_allclose(begun[name], last[name], rtol=1e-12)


def test_arrays_that_are_not_sound_are_refused_before_anything_is_written(tmp_path):
    case = short_case()
    own = warm(case)
    with pytest.raises(CaseError, match="particles: r: expected more than 0"):
        mpisph.run(case, SELF, tmp_path / "x", particles={**own, "r": -own["r"]})
    assert not (tmp_path / "x").exists()
