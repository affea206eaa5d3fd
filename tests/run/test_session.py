"""A run called from Python: what it does with its folder and its communicator."""

import os

import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree
from run_folders import differences, status
from small_runs import StopAt

from mpisph.case import load_case
from mpisph.core.errors import CaseError, MpisphError
from mpisph.io.history import read_history
from mpisph.io.snapshot import read_series, read_snapshot
from mpisph.run.session import resume, run

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


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize(
    "settings",
    [
        (),
        ("scheme.eos=tillotson", "bodies.0.material=al-6061-t6",
         "bodies.1.material=al-6061-t6", "output.history_every=7"),
        ("scheme.smoothing=classic", "parallel.cut=r", "scheme.self_term=false"),
        ("time.step=fixed", "time.dt=4ns", "scheme.heat.enabled=false"),
        ("scheme.smoothing=fixed", "scheme.strength=none", "parallel.cut=z"),
        ("scheme.p_min={value=-1e9, mode='zero'}", "scheme.viscosity.form=printed"),
    ],
)  # fmt: skip
def test_a_stopped_run_continues_with_the_same_bits(settings, mpi_tmp_path):
    """Whatever the scheme: stopped at some steps, resumed on other ranks."""
    world = MPI.COMM_WORLD
    case = short_case(*settings, "time.end=0.6us")
    once, stopped = (mpi_tmp_path / name for name in ("once", "stopped"))
    whole = run(case, world, once)
    first = run(case, world, stopped, signals=StopAt(1 + whole.step // 3))
    problems = [] if first.status == "stopped" else [first.status]
    sizes = range(1, world.size + 1) if world.size > 1 else (1, 1)
    for k, size in enumerate(sizes, 1):
        part = world.Split(0 if world.rank < size else 1, world.rank)
        if world.rank < size:
            last = k == len(sizes)
            soon = StopAt(1 + whole.step // 6)
            result = resume(part, stopped, signals=None if last else soon)
            if result.status != ("completed" if last else "stopped"):
                problems.append(result.status)
        part.Free()
        world.Barrier()
    if world.rank == 0:
        problems += differences(stopped, once)
    agree(world, problems)


@pytest.mark.mpi(min_size=1)
def test_a_resumed_run_breaks_down_where_it_would_have(mpi_tmp_path):
    """The limit of the step counts from the very first one."""
    world = MPI.COMM_WORLD
    case = short_case("limits.step_ratio_min=0.95")
    once = run(case, world, mpi_tmp_path / "once")
    folder = mpi_tmp_path / "stopped"
    run(case, world, folder, signals=StopAt(once.step // 2))
    again = resume(world, folder)
    agree(
        world,
        [] if (once.status, once.reason) == ("unstable", "step_collapse") else [once],
    )
    assert (again.status, again.reason, again.step, again.particle, again.detail) == (
        once.status, once.reason, once.step, once.particle, once.detail
    )  # fmt: skip
    # It has ended: nothing more is done.
    same, timing = resume(world, folder), {"timing"}
    assert same.model_dump(exclude=timing) == again.model_dump(exclude=timing)


def test_the_case_must_be_the_one_in_the_folder(tmp_path):
    run(short_case(), MPI.COMM_SELF, tmp_path, signals=StopAt(3))
    with pytest.raises(CaseError, match=r"another case \(resolution.npr: 4, now 5\)"):
        run(short_case("resolution.npr=5"), MPI.COMM_SELF, tmp_path)
    many = short_case("resolution.npr=5", "time.cfl=0.2", "resolution.nph=1.5",
                      "bodies.0.velocity=6e3", "bodies.1.radius=0.03",
                      "scheme.heat.g1=1.0")  # fmt: skip
    with pytest.raises(CaseError, match="and 1 more"):
        run(many, MPI.COMM_SELF, tmp_path)


def test_a_case_changed_in_the_folder_is_noticed(tmp_path):
    run(short_case(), MPI.COMM_SELF, tmp_path, signals=StopAt(3))
    text = (tmp_path / "case.toml").read_text()
    (tmp_path / "case.toml").write_text(text.replace("npr = 4", "npr = 5"))
    with pytest.raises(MpisphError, match="belongs to another case than"):
        resume(MPI.COMM_SELF, tmp_path)


def test_files_of_a_run_without_a_status_are_not_overwritten(tmp_path):
    (tmp_path / "result.json").write_text("{}")
    with pytest.raises(MpisphError, match=r"holds result.json of a run, but no status"):
        run(short_case(), MPI.COMM_SELF, tmp_path)
    assert (tmp_path / "result.json").read_text() == "{}"
    (tmp_path / "result.json").unlink()
    (tmp_path / "notes.txt").write_text("mine")
    run(short_case(), MPI.COMM_SELF, tmp_path)
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_other_software_since_the_checkpoint_is_said(tmp_path, monkeypatch):
    run(short_case(), MPI.COMM_SELF, tmp_path, signals=StopAt(9))
    monkeypatch.setattr("mpisph.run.session.git_revision", lambda: "another")
    resume(MPI.COMM_SELF, tmp_path)
    assert "was written by other software" in (tmp_path / "log.txt").read_text()


def test_leftovers_of_a_kill_are_removed(tmp_path):
    run(short_case(), MPI.COMM_SELF, tmp_path, signals=StopAt(9))
    theirs = tmp_path / "film.iso.part"
    names = ("status.json.host-1-2.part", "snapshots/snapshot_00077.part",
             "snapshots/snapshot_00077.part-1775501313-1326.lock",
             "checkpoints/checkpoint_000000007.part",
             "checkpoints/checkpoint_000000007.part-1775501313-1326.lock")  # fmt: skip
    for path in (theirs, *(tmp_path / name for name in names)):
        path.touch()
    resume(MPI.COMM_SELF, tmp_path)
    assert list(tmp_path.rglob("*.part*")) == [theirs]
    assert len(list((tmp_path / "checkpoints").iterdir())) == 1


def test_what_changes_no_bit_may_change_on_the_way(tmp_path):
    run(short_case(), MPI.COMM_SELF, tmp_path, signals=StopAt(9))
    prose = "measured.exposures.0.source=elsewhere"
    changed = short_case("checkpoints.wall_interval=1h", "parallel.cut=z", prose)
    result = run(changed, MPI.COMM_SELF, tmp_path)
    assert result.status == "completed"
    assert result.step > 9
    assert load_case(tmp_path / "case.toml") == changed


def test_figures_that_cannot_be_drawn_do_not_undo_a_run(tmp_path, monkeypatch, capsys):
    def fail(_):
        raise ValueError("no such font")

    monkeypatch.setattr("mpisph.figures.cloud.draw_run", fail)
    result = run(short_case("output.figures=true"), MPI.COMM_SELF, tmp_path)
    assert result.status == status(tmp_path)["state"] == "completed"
    assert "no figures: ValueError: no such font" in capsys.readouterr().err


def test_a_linked_folder_of_checkpoints_is_cleared(tmp_path):
    elsewhere = tmp_path / "scratch"
    elsewhere.mkdir()
    (elsewhere / "mine.txt").touch()
    folder = tmp_path / "run"
    folder.mkdir()
    (folder / "checkpoints").symlink_to(elsewhere)
    run(short_case(), MPI.COMM_SELF, folder, signals=StopAt(9))
    result = run(short_case(), MPI.COMM_SELF, folder)
    left = sorted(path.name for path in elsewhere.iterdir())
    assert left == [f"checkpoint_{result.step:09d}.h5", "mine.txt"]


def test_all_files_follow_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        run(short_case("output.figures=true"), MPI.COMM_SELF, tmp_path / "run")
    finally:
        os.umask(before)
    paths = [tmp_path / "run", *(tmp_path / "run").rglob("*")]
    modes = {p.name: p.stat().st_mode & 0o777 for p in paths}
    assert modes == {p.name: 0o750 if p.is_dir() else 0o640 for p in paths}


def test_checkpoints_of_an_unstable_run_stay(tmp_path):
    case = short_case("limits.energy_drift=1e-18", "checkpoints.interval=1e-12")
    assert run(case, MPI.COMM_SELF, tmp_path).status == "unstable"
    assert len(list((tmp_path / "checkpoints").iterdir())) > 0


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


def test_a_forced_run_replaces_the_files_of_the_one_before(tmp_path):
    run(short_case("output.every=0.1us"), MPI.COMM_SELF, tmp_path)
    assert len(read_series(tmp_path)) == 5
    run(short_case(), MPI.COMM_SELF, tmp_path, force=True)
    assert len(read_series(tmp_path)) == 3
    assert len(list((tmp_path / "snapshots").iterdir())) == 3
    assert read_history(tmp_path / "history.csv")["step"][0] == 0


def test_limits_end_a_run_as_unstable(tmp_path):
    cases = {
        "energy_drift": "limits.energy_drift=1e-18",
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
