"""The state of a run comes back from a checkpoint."""

import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree

from mpisph.case import load_case
from mpisph.core.console import open_console
from mpisph.core.errors import MpisphError
from mpisph.diagnostics.series import SERIES
from mpisph.io.checkpoint import read_checkpoint
from mpisph.io.history import History
from mpisph.io.run_log import RunLog
from mpisph.parallel.redistribution import gather_all
from mpisph.run.loop import make_step
from mpisph.run.output import RunOutput
from mpisph.run.probing import Probes
from mpisph.run.progress import Progress
from mpisph.run.state import RunState, restored
from mpisph.solver.setup import step_rule
from mpisph.solver.start import start
from mpisph.solver.step import rebalance, reduce_state
from mpisph.sph.timestep import allowed_step

PROVENANCE = {"revision": "abc"}
SETTINGS = ("resolution.npr=4", "output.history_every=3")


def begin(comm, sim, folder, state=None):
    progress = Progress(comm, sim.case.end_time, open_console(stderr=True))
    kept = state.history.size if state else 0
    history, log = History(folder, comm, kept), RunLog(folder, comm)
    sizes = {name: t.size for name, t in state.probes.tables.items()} if state else {}
    probes = Probes(sim, folder, state.probes if state else None, sizes).__enter__()
    return RunOutput(sim, folder, history, probes, progress, log, PROVENANCE, state)


def finish(output):
    output.history.close()
    output.probes.__exit__(None, None, None)
    output.log.close()


def make_steps(sim, output, count):
    rule = step_rule(sim.case)
    for _ in range(count):
        found = reduce_state(sim)
        output.add_step(sim, found)
        allowed = allowed_step(rule, found.limit)
        sim.first_dt = sim.first_dt or allowed
        make_step(sim, found, allowed)
        if sim.step % 10 == 5:
            output.save_snapshot(sim)


def stored_run(comm, folder):
    """A run of 23 steps, its checkpoint as it is read, and the state in that."""
    case = load_case(CASES / "piekutowski-4-1353.toml", SETTINGS)
    sim = start(case, comm)
    output = begin(comm, sim, folder)
    make_steps(sim, output, 23)
    output.save_checkpoint(sim)
    finish(output)
    path = folder / "checkpoints" / "checkpoint_000000023.h5"
    checkpoint = read_checkpoint(comm, path)
    return sim, output, checkpoint, RunState.model_validate_json(checkpoint.state)


def differing_parts(sim, back):
    """The names of what differs between two simulations."""
    names = ("time", "step", "dt", "first_dt", "n_total", "bounds", "scheme")
    found = [n for n in names if getattr(back, n) != getattr(sim, n)]
    if back.scales.energy != sim.scales.energy:
        found.append("energy")
    if back.scales != sim.scales:
        found.append("scales")
    was, now = gather_all(sim.comm, sim.particles), gather_all(sim.comm, back.particles)
    if was is not None and was.pack().tobytes() != now.pack().tobytes():
        found.append("particles")
    return found


@pytest.mark.mpi(min_size=1)
def test_everything_comes_back(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    sim, output, checkpoint, state = stored_run(comm, mpi_tmp_path)
    back = restored(sim.case, comm, checkpoint, state)
    again = begin(comm, back, mpi_tmp_path, state)
    old, new = output._state(sim), again._state(back)
    finish(again)
    problems = differing_parts(sim, back)
    problems += [
        name
        for name in RunState.model_fields
        if name not in {"wall", "rank_seconds", "timers", "history", "probes"}
        and getattr(old, name) != getattr(new, name)
    ]
    # The tables of the old one have been closed.
    problems += ["probes"] * (old.probes.peaks != new.probes.peaks)
    agree(comm, problems)
    assert new.probes == state.probes
    assert (len(old.snapshots), new.step, len(new.initial)) == (2, 23, len(SERIES))
    assert state.wall <= new.wall < state.wall + 60.0
    assert state.rank_seconds == pytest.approx(state.wall * comm.size)
    assert new.rank_seconds == pytest.approx(new.wall * comm.size)
    assert new.timers["pair loop"] >= state.timers["pair loop"] > 0.0


@pytest.mark.mpi(min_size=1)
def test_the_cut_of_a_restored_run_is_balanced(mpi_tmp_path):
    comm = MPI.COMM_WORLD
    sim, _, checkpoint, state = stored_run(comm, mpi_tmp_path)
    back = restored(sim.case, comm, checkpoint, state)
    work = reduce_state(back).work
    rebalance(back, work)
    fewest = comm.allreduce(back.particles.n, MPI.MIN)
    agree(comm, [] if fewest > 0 and work.max() < 2.0 * work.mean() else [work])


@pytest.mark.parametrize("field", ["body", "material"])
@pytest.mark.parametrize("value", [-1, 2])
def test_labels_out_of_range_are_refused(field, value, tmp_path):
    comm = MPI.COMM_SELF
    sim, _, checkpoint, state = stored_run(comm, tmp_path)
    getattr(checkpoint.particles, field)[7] = value
    with pytest.raises(MpisphError, match="no case's"):
        restored(sim.case, comm, checkpoint, state)
