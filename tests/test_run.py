"""A run called from Python: what it does with its folder and its communicator."""

import pytest
from launch import CASES
from mpi4py import MPI

from mpisph.case import load_case
from mpisph.history import read_history
from mpisph.run import run
from mpisph.snapshot import read_series, read_snapshot

SETTINGS = (
    "resolution.npr=4",
    "time.end=0.4us",
    "output.every=0.2us",
    "output.figures=false",
)


def short_case(*more, name="piekutowski-4-1353"):
    return load_case(CASES / f"{name}.toml", (*SETTINGS, *more))


@pytest.mark.mpi(min_size=2)
def test_runs_on_parts_of_a_communicator_side_by_side(mpi_tmp_path):
    world = MPI.COMM_WORLD
    half = world.Split(world.rank % 2, world.rank)
    result = run(short_case(), half, mpi_tmp_path / str(world.rank % 2))
    assert result.status == "completed"
    assert result.timing.ranks == half.size
    world.Barrier()
    same = None
    if world.rank == 0:
        even, odd = ([p for p, _ in read_series(mpi_tmp_path / n)] for n in "01")
        same = len(even) == 3 and all(
            a.read_bytes() == b.read_bytes() for a, b in zip(even, odd, strict=True)
        )
    half.Free()
    assert world.bcast(same)


def test_output_times_are_met_exactly(tmp_path):
    result = run(short_case("output.times=[0.123e-6]"), MPI.COMM_SELF, tmp_path)
    times = [time for _, time in read_series(tmp_path)]
    assert times == [0.0, 0.123e-6, 0.2e-6, 0.4e-6]
    assert [read_snapshot(p).time for p, _ in read_series(tmp_path)] == times
    assert result.time == 0.4e-6


def test_fixed_steps_are_as_long_as_asked(tmp_path):
    run(
        short_case("time.step=fixed", "time.dt=3 ns", "output.every=0.3 us"),
        MPI.COMM_SELF,
        tmp_path,
    )
    history = read_history(tmp_path / "history.csv")
    # 100 steps to 0.3 us; 33 to 0.399 us, whose last two are shortened to fit.
    assert history["dt"][1:] == pytest.approx([3e-9] * 132 + [2e-9] * 2)
    assert history["step"][-1] == 134


def test_a_second_run_replaces_the_files_of_the_first(tmp_path):
    run(short_case("output.every=0.1us"), MPI.COMM_SELF, tmp_path)
    assert len(read_series(tmp_path)) == 5
    run(short_case(), MPI.COMM_SELF, tmp_path)
    assert len(read_series(tmp_path)) == 3
    assert len(list((tmp_path / "snapshots").iterdir())) == 3
    assert read_history(tmp_path / "history.csv")["step"][0] == 0


def test_limits_end_a_run_as_unstable(tmp_path):
    cases = {
        "energy_drift": "limits.energy_drift=1e-9",
        "density": "limits.density_ratio_max=1.2",
        "internal_energy": "limits.energy_ratio_max=0.01",
        "step_collapse": "limits.step_ratio_min=0.99",
    }
    for reason, override in cases.items():
        result = run(short_case(override), MPI.COMM_SELF, tmp_path / reason)
        assert (result.status, result.reason) == ("unstable", reason)
        assert 0 < result.step < 100
        assert result.detail
        if reason != "energy_drift":
            assert f"particle {result.particle} of " in result.detail
        # The state that broke down is there to look at.
        last = read_snapshot(read_series(tmp_path / reason)[-1][0])
        assert last.step == result.step
        history = read_history(tmp_path / reason / "history.csv")
        assert history["step"][-1] == result.step


def test_the_first_step_may_be_the_last(tmp_path):
    case = short_case()
    limits = case.limits.model_copy(update={"density_ratio_max": 0.5})
    broken = case.model_copy(update={"limits": limits})
    result = run(broken, MPI.COMM_SELF, tmp_path)
    assert (result.status, result.step) == ("unstable", 0)


def test_history_has_every_nth_step_and_the_last(tmp_path):
    result = run(short_case("output.history_every=7"), MPI.COMM_SELF, tmp_path)
    steps = read_history(tmp_path / "history.csv")["step"].tolist()
    assert steps == sorted({*range(0, result.step, 7), result.step})


def test_cloud_mass_is_that_of_the_last_cloud(tmp_path):
    result = run(short_case("time.end=1.5us"), MPI.COMM_SELF, tmp_path)
    last = read_history(tmp_path / "history.csv")[-1]
    assert last["cloud_mass"] == pytest.approx(result.clouds[-1].mass, rel=1e-14) != 0
    assert last["cloud_length"] == result.clouds[-1].length


@pytest.mark.parametrize("name", sorted(path.stem for path in CASES.glob("*.toml")))
def test_every_shipped_case_runs(name, tmp_path):
    coarse = "npr=4" if name != "plate-impact" else "spacing=0.4 mm"
    overrides = (
        f"resolution.{coarse}",
        "time.end=0.2us",
        "output.every=0.1us",
        "output.figures=false",
    )
    case = load_case(CASES / f"{name}.toml", overrides)
    result = run(case, MPI.COMM_SELF, tmp_path)
    assert result.status == "completed"
    assert result.conservation.energy_error_max < 1e-3
    assert abs(result.conservation.momentum_z_error) < 1e-12
