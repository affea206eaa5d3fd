"""One step of a run.

A step reads as the algorithm::

    kick half, drift, predict                     (R11)
    take out what has left the game
    send ghosts their fields
    sort owned and ghosts into the global order
    find neighbours; evaluate rates               (R1-R7, R10)
    kick half; respond: pressure, heat, yield, damage (R7-R9, R13-R20)

Before each step the ranks make one reduction, the step's only one; now and then the
cut is moved and particles change their owner.
"""

import numpy as np

from mpisph.core.particles import FloatArray, Particles
from mpisph.diagnostics.series import local_parts
from mpisph.parallel.decomposition import Cut, equal_work_cut, owners, part_work
from mpisph.parallel.halo import boxes, exchange_halo, reach
from mpisph.parallel.load_balance import imbalance, work_of
from mpisph.parallel.migration import migrate
from mpisph.physics.response import OF_VALUES, respond_rows
from mpisph.solver.reduction import Reduction, global_reduction
from mpisph.solver.state import Simulation
from mpisph.sph.integrator import drift, kick
from mpisph.sph.neighbours import cell_keys
from mpisph.sph.pair_records import RECORD_FIELDS
from mpisph.sph.planes import with_images
from mpisph.sph.rates import update_rates
from mpisph.sph.retirement import has_left
from mpisph.sph.sources import (
    AHEAD,
    EXCHANGED,
    LAST,
    OF_AHEAD,
    ROW,
    look_ahead,
    note_changes,
    sort_fields,
)
from mpisph.sph.timestep import StepRule

MIGRATE_EVERY = 20
"""Steps after which particles that have drifted out of their part are given away, where
the cut stays. Until then they cost some ghosts; moving them takes a tenth of a step."""

RETIRE_EVERY = 20
"""Steps after which matter is looked for that has left the game."""

SORT_EVERY = 60
"""Steps after which particles are stored in cell order again. What lies together in
space then lies together in memory."""

MOVE_GAIN = 0.02
"""Share of the largest work of a rank that moving the cut must save."""


def reduce_state(
    sim: Simulation, rule: StepRule | None = None, stop_request: int = 0
) -> Reduction:
    """Make the global reduction before a step.

    Parameters
    ----------
    sim : Simulation
    rule : StepRule, optional
        Which the step follows; by default the case's.
    stop_request : int, optional
        What this rank asks for (see `signals`).
    """
    with sim.timers.measure("reduction"):
        found = global_reduction(
            sim.comm,
            sim.particles,
            sim.table,
            sim.scheme,
            rule or sim.rule,
            sim.bounds,
            sim.sum_bounds,
            sim.cloud,
            sim.pair_cost.value,
            stop_request,
            sim.retired_parts,
        )
    sim.relative_pair_cost = float(found.pair_costs[sim.comm.rank])
    return found


def rebalance(sim: Simulation, work: FloatArray) -> None:
    """Move the cut where the work is unequal; give particles to their parts.

    Parameters
    ----------
    sim : Simulation
    work : ndarray, shape (ranks,)
        Work of each rank.
    """
    with sim.timers.measure("balance"):
        old, excess = sim.cut, imbalance(work)
        if excess > sim.case.parallel.imbalance_threshold and sim.backoff.due(excess):
            sim.cut = _better_cut(sim, work)
            sim.backoff.note(excess, in_vain=sim.cut is old)
        if sim.cut is not old or sim.step >= sim.next_migration:
            sim.next_migration = sim.step + MIGRATE_EVERY
            sim.particles = migrate(sim.comm, sim.particles, sim.cut)
        if sim.step >= sim.next_sort:
            sim.next_sort = sim.step + SORT_EVERY
            p = sim.particles
            keys = cell_keys(p.r, p.z, p.h, sim.lattice)
            p.reorder(np.argsort(keys, kind="stable"))


def _better_cut(sim: Simulation, work: FloatArray) -> Cut:
    """Return a new cut, or the present one where the new one would save too little.

    Layers of the initial lattice cannot be divided, so some imbalance may have to stay.
    """
    p, old = sim.particles, sim.cut
    # Whole numbers: their sums over ranks have no rounding.
    mine = np.rint(sim.relative_pair_cost * work_of(p.neighbours))
    half = reach(p.h, sim.scheme.kappa)
    new = equal_work_cut(
        sim.comm, p.r, p.z, half, mine, sim.comm.size, sim.case.parallel.cut, old
    )
    after = part_work(sim.comm, owners(new, p.r, p.z), mine)
    return new if after.max() < (1.0 - MOVE_GAIN) * work.max() else old


def advance(sim: Simulation, dt: float, rank_boxes: FloatArray) -> None:
    """Make one step of `dt` [s] (R11).

    Parameters
    ----------
    sim : Simulation
    dt : float
    rank_boxes : ndarray, shape (ranks, 4)
        From the reduction before this step.
    """
    p = sim.particles
    before = sim.rule.kick * dt
    after = dt - before
    with sim.timers.measure("stepping"):
        kick(p, before)
        drift(p, dt, *sim.planes)
        p = _retire(sim, dt)
    evaluate_rates(sim, after, rank_boxes, dt)
    with sim.timers.measure("stepping"):
        kick(p, after)
    with sim.timers.measure("materials"):
        respond_to_state(sim, dt)
    sim.time += dt
    sim.step += 1
    sim.dt = dt


def respond_to_state(sim: Simulation, dt: float) -> None:
    """Set the response of the owned particles, `dt` [s] after the last (R7-R20)."""
    p = sim.particles
    respond_rows(
        p.id, p.material, p.values, OF_VALUES,
        sim.table, sim.scheme.sound_speed_floor, dt,
    )  # fmt: skip


def _retire(sim: Simulation, dt: float) -> Particles:
    """Let retired matter fly on; take out what has left the game; return the rest."""
    if sim.retirement is None:
        return sim.particles
    drift(sim.retired, dt)
    if sim.step % RETIRE_EVERY == 0:
        p = sim.particles
        left = has_left(p, sim.retirement, sim.time + dt)
        if left.any():
            leaving = p.take(left)
            leaving.rates[:] = 0.0
            leaving.neighbours[:] = 0.0
            leaving.retired[:] = 1.0
            sim.particles = p.take(~left)
            add_retired(sim, leaving)
    return sim.particles


def add_retired(sim: Simulation, leaving: Particles) -> None:
    """Add matter that has left the game on this rank."""
    sim.retired = Particles.unpack([sim.retired.pack(), leaving.pack()])
    sim.retired_parts = local_parts(sim.retired, sim.cloud, sim.sum_bounds)


def evaluate_rates(
    sim: Simulation, after: float, rank_boxes: FloatArray, dt: float
) -> None:
    """Evaluate the rates of the owned particles (R1-R10).

    Parameters
    ----------
    sim : Simulation
    after : float
        How far ahead of the particles the rates are evaluated [s].
    rank_boxes : ndarray, shape (ranks, 4)
        Bounding boxes that hold at that time.
    dt : float
        Time since the last evaluation, zero for the first [s].
    """
    p, scheme, room = sim.particles, sim.scheme, sim.workspace.room
    with sim.timers.measure("stepping"):
        ahead = room("ahead", len(AHEAD), p.n)
        last = room("last", len(LAST), p.n)
        look_ahead(p, after, dt, ahead, last)
    with sim.timers.measure("materials"):
        respond_rows(
            p.id, p.material, ahead, OF_AHEAD, sim.table, scheme.sound_speed_floor, dt
        )
    with sim.timers.measure("halo"):
        fields = _with_ghosts(sim, ahead[: len(EXCHANGED)], rank_boxes)
    with sim.timers.measure("neighbours"):
        cells = sort_fields(fields, sim.lattice)
    with sim.timers.measure("pair loop") as watch:
        records = room("records", fields.shape[1], RECORD_FIELDS)
        pairs = update_rates(
            fields, cells, sim.lattice, sim.table, scheme, ahead[ROW.G], p, records,
            sim.skip_quiescent,
        )  # fmt: skip
    sim.pair_cost.note(watch.spent, pairs)
    sim.interactions += pairs
    if dt > 0.0:
        note_changes(p.values, last, dt)


def _with_ghosts(
    sim: Simulation, fields: FloatArray, rank_boxes: FloatArray
) -> FloatArray:
    """Return the fields of the owned particles, then of ghosts and mirror images."""
    half = reach(fields[ROW.h], sim.scheme.kappa)
    these = boxes(fields[ROW.r], fields[ROW.z], half, half)
    ghosts = exchange_halo(sim.comm, fields, these, rank_boxes, sim.halo)
    owned = fields.shape[1]
    if ghosts.size > 0:
        n = owned + ghosts.shape[1]
        joined = sim.workspace.room("fields", len(EXCHANGED), n)
        fields = np.concatenate([fields, ghosts], axis=1, out=joined)
    return with_images(fields, owned, sim.planes, sim.scheme.kappa, sim.n_total)
