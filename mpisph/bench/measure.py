"""Timing the steady loop of a run: reduction, step, rebalance."""

import contextlib
import gc
import resource
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
from mpi4py import MPI

from mpisph.bench.record import Measurement, Scaling, Spread, Traffic
from mpisph.bench.scenes import Scene
from mpisph.core.particles import FloatArray
from mpisph.io.snapshot import write_snapshot
from mpisph.parallel.collectives import caught, on_root, raise_together
from mpisph.parallel.load_balance import imbalance
from mpisph.run.loop import make_step
from mpisph.solver.setup import step_rule
from mpisph.solver.state import Simulation
from mpisph.solver.step import reduce_state
from mpisph.sph.timestep import allowed_step

WARM_UP_STEPS = 5
"""Steps before the first that is timed: the impact begins, caches fill."""

POLL = 0.02
"""How often a rank that has nothing to do looks up [s]."""

T = TypeVar("T")


class Counters(NamedTuple):
    """What the ranks have spent up to some moment, summed over all of them.

    Attributes
    ----------
    interactions : int
    timers : dict of str to float
        [s].
    traffic : ndarray, shape (3,)
        Messages, bytes, ghosts.
    """

    interactions: int
    timers: dict[str, float]
    traffic: FloatArray

    @classmethod
    def of(cls, sim: Simulation) -> "Counters":
        """Return the counters as they stand; collective."""
        totals: dict[str, float] = {}
        for seconds in sim.comm.allgather(sim.timers.seconds):
            for name, spent in seconds.items():
                totals[name] = totals.get(name, 0.0) + spent
        sent = sim.halo.traffic
        mine = np.array([sent.messages, sent.bytes, sent.ghosts], float)
        interactions = sim.comm.allreduce(sim.interactions)
        return cls(interactions, totals, sim.comm.allreduce(mine))


class Block(NamedTuple):
    """Some steps that were timed together.

    Attributes
    ----------
    wall : float
        On the slowest rank [s].
    spent : Counters
        During these steps.
    """

    wall: float
    spent: Counters


def make_steps(sim: Simulation, count: int) -> None:
    """Make steps as a run does between two snapshots."""
    rule = step_rule(sim.case)
    for _ in range(count):
        found = reduce_state(sim)
        make_step(sim, found, allowed_step(rule, found.limit))


def time_block(sim: Simulation, steps: int) -> Block:
    """Time some steps; collective."""
    before = Counters.of(sim)
    sim.comm.Barrier()
    begin = time.perf_counter()
    make_steps(sim, steps)
    wall = sim.comm.allreduce(time.perf_counter() - begin, MPI.MAX)
    after = Counters.of(sim)
    timers = {
        name: seconds - before.timers.get(name, 0.0)
        for name, seconds in after.timers.items()
    }
    interactions = after.interactions - before.interactions
    return Block(wall, Counters(interactions, timers, after.traffic - before.traffic))


def measure(
    scene: Scene,
    scaling: Scaling,
    comm: MPI.Intracomm,
    steps: int,
    repeats: int,
    idle_memory: int,
) -> Measurement:
    """Measure one scene on the ranks of a communicator; collective.

    Parameters
    ----------
    scene : Scene
    scaling : {"strong", "weak"}
    comm : MPI.Intracomm
    steps : int
        Steps of one repeat.
    repeats : int
    idle_memory : int
        Memory of this rank before any scene [bytes].
    """
    counted = comm.allreduce(reset_peak(), MPI.LAND)
    sim = scene.start(comm)
    make_steps(sim, WARM_UP_STEPS)
    begin = sim.time
    blocks = [time_block(sim, steps) for _ in range(repeats)]
    growth = comm.allreduce(peak_memory() - idle_memory)
    return Measurement(
        scene=scene.name,
        scaling=scaling,
        ranks=comm.size,
        npr=scene.npr,
        time=begin,
        particles=sim.n_total,
        neighbours=comm.allreduce(sim.particles.neighbours.sum()) / sim.n_total,
        steps=steps,
        repeats=repeats,
        interactions=sum(b.spent.interactions for b in blocks) / (steps * repeats),
        **_costs(blocks, comm.size, steps),
        traffic=_traffic(blocks, comm.size * steps * repeats),
        imbalance=imbalance(reduce_state(sim).work),
        snapshot_ms=1e3 * _time_snapshot(sim),
        memory=growth / sim.n_total if counted else None,
    )


def _costs(blocks: list[Block], ranks: int, steps: int) -> dict[str, Any]:
    """Return the times of a `Measurement`."""

    def per_interaction(name: str) -> Spread:
        return Spread.of(
            [1e9 * b.spent.timers.get(name, 0.0) / b.spent.interactions for b in blocks]
        )

    return {
        "step_ms": Spread.of([1e3 * b.wall / steps for b in blocks]),
        "interaction_ns": Spread.of(
            [1e9 * b.wall * ranks / b.spent.interactions for b in blocks]
        ),
        "timers": {name: per_interaction(name) for name in blocks[-1].spent.timers},
    }


def _traffic(blocks: list[Block], rank_steps: int) -> Traffic:
    sent = np.sum([b.spent.traffic for b in blocks], axis=0) / rank_steps
    messages, size, ghosts = sent.tolist()
    return Traffic(messages=messages, bytes=size, ghosts=ghosts)


def _time_snapshot(sim: Simulation) -> float:
    """Return the time to write one snapshot into a folder that is then removed [s]."""
    with contextlib.ExitStack() as stack:
        made: list[str] = []
        on_root(
            sim.comm,
            lambda: made.append(stack.enter_context(tempfile.TemporaryDirectory())),
        )
        folder = Path(sim.comm.bcast(made)[0])
        begin = time.perf_counter()
        write_snapshot(
            sim.comm,
            folder,
            0,
            sim.everything,
            time=sim.time,
            step=sim.step,
            metadata={"case": sim.case.to_toml()},
            n_total=sim.n_total,
            fields=sim.case.saved_fields,
        )
        spent = time.perf_counter() - begin
        return float(sim.comm.allreduce(spent, MPI.MAX))


def reset_peak() -> bool:
    """Let this process's peak memory count from here; say whether the system can."""
    gc.collect()
    try:
        Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    except OSError:
        return False
    return True


def peak_memory() -> int:
    """Return the peak memory of this process [bytes]."""
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def on_ranks(
    comm: MPI.Intracomm, ranks: int, action: Callable[[MPI.Intracomm], T]
) -> T:
    """Do something on the first `ranks` ranks; the others sleep. Collective.

    Parameters
    ----------
    comm : MPI.Intracomm
    ranks : int
    action : callable
        Called with a communicator of those ranks.

    Returns
    -------
    object
        What the action returned on rank 0, on all ranks.

    Raises
    ------
    CollectiveError, MpisphError, RuntimeError
        On all ranks, if the action failed on all of the first.
    """
    part = comm.Split(0 if comm.rank < ranks else MPI.UNDEFINED, comm.rank)
    results: list[T] = []
    error = None
    if part != MPI.COMM_NULL:
        assert isinstance(part, MPI.Intracomm)
        error = caught(lambda: results.append(action(part)))
        part.Free()
    done = comm.Ibarrier()
    while not done.Test():
        time.sleep(POLL)
    raise_together(comm, error)
    results = comm.bcast(results)
    return results[0]
