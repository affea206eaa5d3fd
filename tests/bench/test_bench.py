"""The bench: its figures fit together, on one rank and on two."""

import mmap
import os

import numpy as np
import pytest
from launch import CASES, MPISPH, launch
from mpi4py import MPI

from mpisph.bench import measure as measuring
from mpisph.bench import scenes
from mpisph.bench.bench import rank_counts
from mpisph.bench.measure import (
    make_steps,
    on_ranks,
    peak_memory,
    reset_peak,
    time_block,
)
from mpisph.bench.record import BenchRecord, Spread, StartUp, read_bench
from mpisph.bench.startup import launch_environment, on_all_cores
from mpisph.bench.tables import tables
from mpisph.case import load_case
from mpisph.core.errors import MpisphError
from mpisph.io.snapshot import read_snapshot
from mpisph.parallel.redistribution import gather_all
from mpisph.solver.start import start

SHOT = CASES / "piekutowski-4-1353.toml"
TINY = ("--npr", "4", "--late", "0.3us", "--repeats", "1", "--steps", "2")
LATE = 3e-7


def shot():
    return load_case(SHOT, ("resolution.npr=4",))


@pytest.fixture(scope="module")
def record(tmp_path_factory):
    """What two ranks find, all but the start-up."""
    folder = tmp_path_factory.mktemp("bench")
    parts = [word for part in ("block", "impact", "late") for word in ("--only", part)]
    files = ("--store", folder / "store", "-o", folder / "bench.json")
    done = launch(2, MPISPH, "bench", *TINY, *parts, *files)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("Whole steps") == 1
    assert len(list((folder / "store").glob("*/snapshots/*.vtkhdf"))) == 2
    return read_bench(folder / "bench.json")


def test_every_scene_is_measured_with_strong_and_weak_scaling(record):
    found = [(m.scene, m.scaling, m.ranks, m.npr) for m in record.measurements]
    assert sorted(found) == sorted(
        (scene, scaling, ranks, npr)
        for scene in ("block", "impact", "late")
        for scaling, ranks, npr in (("strong", 1, 4), ("strong", 2, 4), ("weak", 2, 6))
    )
    assert record.start_up is None
    assert record.machine.cpu
    assert record.machine.cores >= 1
    assert record.versions["numba"]


def test_phases_are_parts_of_the_step(record):
    timers = {"reduction", "materials", "halo", "neighbours", "pair loop", "stepping"}
    for m in record.measurements:
        assert timers <= set(m.timers)
        assert 0.0 < sum(s.median for s in m.timers.values())
        assert sum(s.median for s in m.timers.values()) <= m.interaction_ns.median
        whole = 1e-6 * m.interaction_ns.median * m.interactions / m.ranks
        assert m.step_ms.median == pytest.approx(whole)
        assert m.snapshot_ms > 0.0


def test_two_ranks_evaluate_what_one_does(record):
    by = {(m.scene, m.scaling, m.ranks): m for m in record.measurements}
    for scene in ("block", "impact", "late"):
        one, two = by[scene, "strong", 1], by[scene, "strong", 2]
        assert one.interactions == two.interactions > 0.0
        assert one.particles == two.particles
        assert one.neighbours == two.neighbours
        assert one.time == two.time
        assert one.imbalance == 0.0
        assert by[scene, "weak", 2].particles > 1.7 * one.particles
    assert by["late", "strong", 1].time > LATE > by["impact", "strong", 1].time
    block = by["block", "strong", 1]
    pairs = block.neighbours * block.particles
    assert block.interactions == pytest.approx(pairs, rel=1e-3)


def test_the_tables_have_a_row_for_each_measurement(record):
    start_up = StartUp(ranks=2, cold=10.0, warm=Spread.of([1.0, 2.0]))
    full = record.model_copy(update={"start_up": start_up})
    counts = [table.row_count for table in tables(full)]
    assert counts == [9, 9, 9, 9, 1]
    assert tables(record.model_copy(update={"measurements": ()})) == []


def test_the_record_is_the_same_once_written_and_read(record):
    text = record.model_dump_json()
    assert BenchRecord.model_validate_json(text) == record
    with pytest.raises(ValueError, match="extra"):
        BenchRecord.model_validate(record.model_dump() | {"unknown": 1})


def test_start_up_is_that_of_a_program_under_the_same_number_of_ranks(tmp_path):
    path = tmp_path / "bench.json"
    only = ("--only", "start-up", "--repeats", "1")
    # Not compiled: a cold start would take 20 s.
    slow = {"NUMBA_DISABLE_JIT": "1"}
    done = launch(2, MPISPH, "bench", SHOT, *only, "-o", path, **slow)
    assert done.returncode == 0, done.stderr
    found = read_bench(path)
    assert found.measurements == ()
    assert found.start_up.ranks == 2
    assert 0.0 < found.start_up.warm.median < 120.0
    assert 0.0 < found.start_up.cold < 120.0


def test_a_run_that_cannot_start_is_an_error_on_all_ranks(tmp_path):
    case = tmp_path / "plates.toml"
    text = (CASES / "plate-impact.toml").read_text()
    case.write_text(text)
    done = launch(2, MPISPH, "bench", case, *TINY, "-o", tmp_path / "x.json")
    assert done.returncode == 2
    assert "resolution" in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "x.json").exists()


@pytest.mark.mpi(min_size=1)
def test_a_stored_start_goes_on_with_the_same_bits_on_any_ranks(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    path = scenes.keep_late_start(shot(), comm, LATE, mpi_tmp_path)
    assert path.exists()
    together = scenes.start_late(shot(), path, comm)
    alone = scenes.start_late(shot(), path, MPI.COMM_SELF)
    assert together.time == alone.time == LATE
    for sim in (together, alone):
        make_steps(sim, 25)
    everything = gather_all(comm, together.particles)
    same = True
    if comm.rank == 0:
        single = gather_all(MPI.COMM_SELF, alone.particles)
        same = everything.pack().tobytes() == single.pack().tobytes()
    assert comm.bcast(same)
    assert together.time == alone.time > LATE


def test_a_stored_start_is_the_state_of_the_run_that_it_is_from(tmp_path):
    path = scenes.keep_late_start(shot(), MPI.COMM_SELF, LATE, tmp_path)
    arrays = read_snapshot(path).arrays
    sim = scenes.start_late(shot(), path, MPI.COMM_SELF)
    mine = gather_all(MPI.COMM_SELF, sim.particles)
    for name in (
        "id",
        "body",
        "material",
        "m",
        "r",
        "z",
        "u_r",
        "u_z",
        "rho",
        "E",
        "h",
    ):
        assert np.array_equal(getattr(mine, name), arrays[name]), name
    for name in ("S_rr", "S_zz", "S_rz"):  # once more brought to the yield surface
        assert getattr(mine, name) == pytest.approx(arrays[name], rel=1e-12), name
        assert np.abs(arrays[name]).max() > 1e6
    assert sim.n_total == arrays["id"].size
    assert sim.particles.neighbours.min() >= 1.0


def test_a_start_is_stored_once_for_each_case_and_time(tmp_path, monkeypatch):
    comm = MPI.COMM_SELF
    path = scenes.keep_late_start(shot(), comm, LATE, tmp_path)
    other = scenes.keep_late_start(shot(), comm, 0.5 * LATE, tmp_path)
    assert path != other
    finer = load_case(SHOT, ("resolution.npr=5",))
    assert scenes.keep_late_start(finer, comm, LATE, tmp_path) not in (path, other)
    monkeypatch.setattr(scenes, "start", None)  # it would be called to run the case
    assert scenes.keep_late_start(shot(), comm, LATE, tmp_path) == path


def test_no_particle_of_the_block_is_at_rest_or_near_the_axis():
    sim = scenes.start_block(4, MPI.COMM_SELF)
    p = sim.particles
    assert p.n == (3 * 4) ** 2
    assert np.abs(p.u_r).min() > 0.0
    assert np.abs(p.u_z).min() > 0.0
    assert np.abs(p.drho).min() > 0.0
    assert p.r.min() > 400.0 * p.h.max()
    assert np.ptp(p.P) > 0.0


def test_traffic_of_the_timed_steps_is_counted(monkeypatch):
    sim = start(shot(), MPI.COMM_SELF)

    def send(sim, count):
        sim.halo.traffic.messages += 2 * count
        sim.halo.traffic.bytes += 64 * count

    monkeypatch.setattr(measuring, "make_steps", send)
    blocks = [time_block(sim, 3) for _ in range(2)]
    traffic = measuring._traffic(blocks, 6)
    assert (traffic.messages, traffic.bytes, traffic.ghosts) == (2.0, 64.0, 0.0)


def test_the_peak_of_memory_starts_anew():
    # Not from the allocator, which may have as much left over from other tests.
    with mmap.mmap(-1, 80_000_000) as large:
        large.write(b"x" * 80_000_000)
        high = peak_memory()
    if not reset_peak():
        pytest.skip("this system cannot")
    assert peak_memory() < high - 60e6


@pytest.mark.mpi(min_size=2)
def test_some_ranks_work_and_all_learn_what_they_found():
    comm = MPI.COMM_WORLD
    assert on_ranks(comm, 1, lambda part: part.size) == 1
    sizes = on_ranks(comm, comm.size, lambda part: part.allgather(comm.rank))
    assert sizes == list(range(comm.size))


@pytest.mark.mpi(min_size=2)
def test_an_error_of_the_ranks_at_work_is_raised_on_all():
    def fail(part):
        raise MpisphError("no such thing")

    with pytest.raises(MpisphError, match="no such thing"):
        on_ranks(MPI.COMM_WORLD, 1, fail)


@pytest.mark.parametrize(
    ("size", "counts"),
    [(1, [1]), (2, [1, 2]), (3, [1, 2, 3]), (4, [1, 2, 4]), (6, [1, 2, 4, 6])],
)
def test_ranks_are_doubled_up_to_all(size, counts):
    assert rank_counts(size) == counts


def test_a_launched_program_does_not_take_itself_for_a_rank(monkeypatch):
    monkeypatch.setenv("PMIX_RANK", "0")
    monkeypatch.setenv("OMPI_COMM_WORLD_SIZE", "2")
    monkeypatch.setenv("OMPI_ALLOW_RUN_AS_ROOT", "1")
    kept = launch_environment()
    assert not {"PMIX_RANK", "OMPI_COMM_WORLD_SIZE"} & kept.keys()
    assert kept["OMPI_ALLOW_RUN_AS_ROOT"] == "1"
    assert kept["PATH"] == os.environ["PATH"]


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="binds no processes")
def test_a_launched_program_is_not_bound_to_the_core_of_one_rank():
    before = os.sched_getaffinity(0)
    one = {min(before)}
    os.sched_setaffinity(0, one)
    try:
        with on_all_cores():
            assert os.sched_getaffinity(0) >= before
        assert os.sched_getaffinity(0) == one
    finally:
        os.sched_setaffinity(0, before)
