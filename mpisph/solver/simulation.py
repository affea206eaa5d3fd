"""The state of a run and one step of it.

A step reads as the algorithm::

    kick half, drift, predict                     (R11)
    send ghosts their fields
    sort owned and ghosts into the global order
    find neighbours; evaluate rates               (R1-R7, R10)
    kick half; apply yield and equation of state  (R7-R9)

Before each step all ranks take one survey, the step's only reduction; now and then
the cut is moved and particles change their owner.
"""

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.discretise import InitialParticles, discretise
from mpisph.core.memory import keep_freed_memory
from mpisph.core.particles import INTEGRATED, STRESS_ROWS, FloatArray, Particles
from mpisph.core.timers import Phases
from mpisph.diagnostics.diagnostics import CloudDefinition, cloud_definition
from mpisph.diagnostics.stability import Bounds
from mpisph.materials import Material
from mpisph.parallel.cost_model import fastest_cut
from mpisph.parallel.decomposition import (
    Cut,
    Pace,
    Patience,
    imbalance,
    owners,
    part_work,
    work_of,
)
from mpisph.parallel.halo import Halo, boxes, exchange_halo, reach
from mpisph.parallel.migration import migrate
from mpisph.physics.eos import KINDS, P_MIN_MODES, MaterialConstants
from mpisph.physics.response import MaterialTable, limit_stress, material_table, respond
from mpisph.physics.scheme import Scheme
from mpisph.physics.smoothing import MODES
from mpisph.solver.reduction import Survey, take_survey
from mpisph.sph.integrator import drift, kick, predict
from mpisph.sph.neighbours import Lattice, cell_keys, make_lattice
from mpisph.sph.rates import update_rates
from mpisph.sph.sources import exchanged_fields, name_fields, sort_fields
from mpisph.sph.timestep import StepRule

NO_STEP = StepRule(fixed=True, longest=0.0, courant=0.0)

MIGRATE_EVERY = 20
"""Steps after which particles that have drifted out of their part are given away, where
the cut stays. Until then they cost some ghosts; moving them takes a tenth of a step."""

SORT_EVERY = 60
"""Steps after which particles are stored in cell order again. What lies together in
space then lies together in memory."""

MOVE_GAIN = 0.02
"""Share of the largest work of a rank that moving the cut must save."""


class Scales(NamedTuple):
    """Magnitudes of a run, taken at its start.

    Attributes
    ----------
    energy : float
        Specific energy: the largest kinetic one, or that of a hundredth of the bulk
        sound speed where nothing moves [J/kg].
    sums : ndarray, shape (4,)
        Bounds of one particle's terms of the conserved sums. They may be loose: see
        `collectives.fixed_point_chunks`.
    """

    energy: float
    sums: FloatArray


@dataclass
class Simulation:
    """Everything that a step reads or changes.

    Attributes
    ----------
    case : Case
    comm : MPI.Intracomm
    particles : Particles
        Owned by this rank.
    n_total : int
        Number of particles on all ranks.
    scheme, table, lattice, bounds, scales, cloud
        Constants of the run, derived from the case.
    cut : Cut
        Of the domain, one part a rank.
    patience : Patience
        With an imbalance that no other cut could lessen.
    pace : Pace
        Measured time of this rank's pairs.
    relative_pace : float
        That over the mean of all ranks, at the last survey.
    halo : Halo
        Buffers of the exchange, and what this rank has sent.
    time : float
        [s].
    step : int
        Steps made.
    dt : float
        Length of the last step [s].
    first_dt : float
        Length that the limits allowed for the first step [s]; 0 before it.
    interactions : int
        Directed interactions evaluated by this rank.
    next_migration : int
        Step from which on particles that have left their part change their owner.
    next_sort : int
        Step from which on this rank's particles are put into cell order again.
    phases : Phases
        Time spent in each phase of the step.
    skip_quiescent : bool
        Whether matter at rest is left out of the pair loop; no bit depends on it.
    """

    case: Case
    comm: MPI.Intracomm
    particles: Particles
    n_total: int
    scheme: Scheme
    table: MaterialTable
    lattice: Lattice
    bounds: Bounds
    scales: Scales
    cloud: CloudDefinition
    cut: Cut
    time: float = 0.0
    step: int = 0
    dt: float = 0.0
    first_dt: float = 0.0
    interactions: int = 0
    next_migration: int = 0
    next_sort: int = 0
    patience: Patience = field(default_factory=Patience)
    pace: Pace = field(default_factory=Pace)
    relative_pace: float = 1.0
    halo: Halo = field(default_factory=Halo)
    phases: Phases = field(default_factory=Phases)
    skip_quiescent: bool = True


def make_scheme(case: Case) -> Scheme:
    """Return the scheme's parameters as the jitted functions take them."""
    s = case.scheme
    return Scheme(
        alpha=s.viscosity.alpha,
        beta=s.viscosity.beta,
        epsilon=s.viscosity.epsilon,
        printed=s.viscosity.form == "printed",
        g1=s.heat.g1 if s.heat.enabled else 0.0,
        g2=s.heat.g2 if s.heat.enabled else 0.0,
        kappa=s.kappa,
        self_term=s.self_term,
        P_min=s.p_min.value,
        P_min_mode=P_MIN_MODES[s.p_min.mode],
        smoothing=MODES[s.smoothing],
        sound_speed_floor=s.sound_speed_floor,
    )


def make_table(case: Case) -> MaterialTable:
    """Return the constants of the case's materials, one row an entry of its table."""
    strong = case.scheme.strength != "none"
    return material_table(
        [_constants(entry.material, entry.eos, strong) for entry in case.material_table]
    )


def _constants(material: Material, eos: str, strong: bool) -> MaterialConstants:
    t = material.tillotson
    unused = (math.nan,) * 9
    return MaterialConstants(
        KINDS[eos],
        material.rho0,
        material.c0,
        material.hugoniot_slope,
        material.gamma0,
        material.bulk_modulus,
        material.shear_modulus if strong else 0.0,
        material.yield_strength if strong else 0.0,
        *(
            unused
            if t is None
            else (t.a, t.b, t.A, t.B, t.E0, t.Es, t.Es_prime, t.alpha, t.beta)
        ),
    )


def start(case: Case, comm: MPI.Intracomm) -> Simulation:
    """Discretise the bodies, share the particles out and evaluate the first rates.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm

    Returns
    -------
    Simulation
        At time zero.
    """
    return start_from(case, comm, discretise(case), 0.0)


def start_from(
    case: Case, comm: MPI.Intracomm, initial: InitialParticles, time: float
) -> Simulation:
    """Share given particles out and evaluate the first rates.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
    initial : InitialParticles
        All particles, the same on every rank.
    time : float
        Time of this state [s].

    Returns
    -------
    Simulation
    """
    keep_freed_memory()
    n_total = initial.id.size
    scales = _scales(case, initial)
    cut = _first_cut(case, comm, initial)
    mine = np.flatnonzero(owners(cut, initial.r, initial.z) == comm.rank)
    particles = _initial_particles(initial, mine)
    del initial  # every rank holds all of it
    sim = _simulation(case, comm, particles, n_total, cut, scales)
    sim.time = time
    respond(sim.particles, sim.table, sim.scheme)
    claims = survey(sim, NO_STEP).claims
    evaluate_rates(sim, sim.particles.integrated.copy(), claims, 0.0)
    sim.pace = Pace()  # the first time, compiled code was loaded too
    rebalance(sim, survey(sim).work)  # the neighbours are known only now
    return sim


def restore(
    case: Case,
    comm: MPI.Intracomm,
    particles: Particles,
    n_total: int,
    scales: Scales,
) -> Simulation:
    """Share out particles that are complete, rates included, between two steps.

    Nothing is evaluated: the next step has the bits that it would have had.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
    particles : Particles
        Any share of all particles on each rank.
    n_total : int
        Their number on all ranks.
    scales : Scales
        Those of the run's start.

    Returns
    -------
    Simulation
        At time zero and step zero: those are for the caller to set.
    """
    keep_freed_memory()
    p = particles
    half = reach(p.h, case.scheme.kappa)
    work = np.rint(work_of(p.neighbours))
    cut = fastest_cut(comm, p.r, p.z, half, work, mode=case.parallel.cut)
    mine = migrate(comm, p, cut)
    return _simulation(case, comm, mine, n_total, cut, scales)


def _simulation(
    case: Case,
    comm: MPI.Intracomm,
    particles: Particles,
    n_total: int,
    cut: Cut,
    scales: Scales,
) -> Simulation:
    """Return the simulation of a case with these particles."""
    scheme = make_scheme(case)
    return Simulation(
        case=case,
        comm=comm,
        particles=particles,
        n_total=n_total,
        scheme=scheme,
        table=make_table(case),
        lattice=make_lattice(case.smoothing_length, scheme.kappa),
        bounds=_bounds(case, scales.energy),
        scales=scales,
        cloud=cloud_definition(case),
        cut=cut,
    )


def _first_cut(case: Case, comm: MPI.Intracomm, initial: InitialParticles) -> Cut:
    """Return a cut into parts of equally many particles."""
    dealt = slice(comm.rank, None, comm.size)
    r, z, h = initial.r[dealt], initial.z[dealt], initial.h[dealt]
    half = reach(h, case.scheme.kappa)
    return fastest_cut(comm, r, z, half, np.ones(r.size), mode=case.parallel.cut)


def _initial_particles(initial: InitialParticles, mine: np.ndarray) -> Particles:
    p = Particles.zeros(mine.size)
    for name, values in initial._asdict().items():
        if values is not None:
            getattr(p, name)[:] = values[mine]
    return p


def _scales(case: Case, initial: InitialParticles) -> Scales:
    slow = 0.01 * max(entry.material.c0 for entry in case.material_table)
    speed = max(float(np.abs(initial.u_z).max()), slow)
    energy = 0.5 * speed**2
    room = 1e6
    mass = float(initial.m.max())
    terms = np.array([1.0, room * speed, room * energy, room * energy])
    return Scales(energy, mass * terms)


def step_rule(case: Case) -> StepRule:
    """Return how the case's steps follow from the limits."""
    longest = math.inf if case.time.dt is None else case.time.dt
    kick = 0.5 if case.time.order == 2 else 1.0
    return StepRule(case.time.step == "fixed", longest, case.time.cfl, kick)


def _bounds(case: Case, energy: float) -> Bounds:
    limits = case.limits
    return Bounds(
        density_min=limits.density_ratio_min,
        density_max=limits.density_ratio_max,
        energy=limits.energy_ratio_max * energy,
        h_min=case.smoothing_length / limits.smoothing_ratio_max,
        h_max=case.smoothing_length * limits.smoothing_ratio_max,
    )


def survey(sim: Simulation, rule: StepRule | None = None, wish: int = 0) -> Survey:
    """Take the survey before a step.

    Parameters
    ----------
    sim : Simulation
    rule : StepRule, optional
        Which the step follows; by default the case's.
    wish : int, optional
        What this rank asks for (see `guard`).
    """
    with sim.phases.measure("survey"):
        found = take_survey(
            sim.comm,
            sim.particles,
            sim.table,
            sim.scheme,
            rule or step_rule(sim.case),
            sim.bounds,
            sim.scales.sums,
            sim.cloud,
            sim.pace.value,
            wish,
        )
    sim.relative_pace = float(found.paces[sim.comm.rank])
    return found


def rebalance(sim: Simulation, work: FloatArray) -> None:
    """Move the cut where the work is unequal; give particles to their parts.

    Parameters
    ----------
    sim : Simulation
    work : ndarray, shape (ranks,)
        Work of each rank.
    """
    with sim.phases.measure("balance"):
        old, excess = sim.cut, imbalance(work)
        if excess > sim.case.parallel.imbalance_threshold and sim.patience.due(excess):
            sim.cut = _better_cut(sim, work)
            sim.patience.note(excess, in_vain=sim.cut is old)
        if sim.cut is not old or sim.step >= sim.next_migration:
            sim.next_migration = sim.step + MIGRATE_EVERY
            sim.particles = migrate(sim.comm, sim.particles, sim.cut)
        if sim.step >= sim.next_sort:
            sim.next_sort = sim.step + SORT_EVERY
            p = sim.particles
            keys = cell_keys(p.r, p.z, p.h, sim.lattice)
            sim.particles = p.take(np.argsort(keys, kind="stable"))


def _better_cut(sim: Simulation, work: FloatArray) -> Cut:
    """Return a new cut, or the present one where the new one would save too little.

    Layers of the initial lattice cannot be divided, so some imbalance may have to stay.
    """
    p, old = sim.particles, sim.cut
    # Whole numbers: their sums over ranks have no rounding.
    mine = np.rint(sim.relative_pace * work_of(p.neighbours))
    half = reach(p.h, sim.scheme.kappa)
    new = fastest_cut(
        sim.comm, p.r, p.z, half, mine,
        mode=sim.case.parallel.cut, current=old.columns,
    )  # fmt: skip
    after = part_work(sim.comm, owners(new, p.r, p.z), mine)
    saves = after.max() < (1.0 - MOVE_GAIN) * work.max()
    return new if saves or new.columns != old.columns else old


def advance(sim: Simulation, dt: float, claims: FloatArray) -> None:
    """Make one step of `dt` [s] (R11).

    Parameters
    ----------
    sim : Simulation
    dt : float
    claims : ndarray, shape (ranks, 4)
        From the survey before this step.
    """
    p = sim.particles
    before = step_rule(sim.case).kick * dt
    after = dt - before
    with sim.phases.measure("stepping"):
        kick(p, before)
        drift(p, dt)
        predicted = predict(p, after)
    evaluate_rates(sim, predicted, claims, dt)
    with sim.phases.measure("stepping"):
        kick(p, after)
    with sim.phases.measure("materials"):
        respond(p, sim.table, sim.scheme)
    sim.time += dt
    sim.step += 1
    sim.dt = dt


def evaluate_rates(
    sim: Simulation, integrated: FloatArray, claims: FloatArray, dt: float
) -> None:
    """Evaluate the rates of the owned particles (R1-R10).

    Parameters
    ----------
    sim : Simulation
    integrated : ndarray, shape (8, n)
        Integrated fields at the time of evaluation; its stress is brought back to the
        yield surface.
    claims : ndarray, shape (ranks, 4)
        Halo claims that hold for the positions and `integrated`.
    dt : float
        Time since the last evaluation, zero for the first [s].
    """
    p, scheme = sim.particles, sim.scheme
    h = integrated[INTEGRATED.index("h")]
    # Artificial heat (R6) needs the divergence, which this evaluation is to yield. The
    # last one alone would make the scheme first order in time; extrapolated, it keeps
    # the second.
    last_div = p.div.copy()
    div = last_div + dt * p.ddiv
    with sim.phases.measure("materials"):
        limit_stress(integrated[STRESS_ROWS], p.material, sim.table, p.plastic)
    with sim.phases.measure("halo"):
        fields = exchanged_fields(p, integrated, div)
        half = reach(h, scheme.kappa)
        these = boxes(p.r, p.z, half, half)
        ghosts = exchange_halo(sim.comm, fields, these, claims, sim.halo)
        if ghosts.size > 0:
            fields = np.concatenate([fields, ghosts], axis=1)
    with sim.phases.measure("neighbours"):
        cells = sort_fields(fields, sim.lattice)
    with sim.phases.measure("pair loop") as watch:
        pairs = update_rates(
            name_fields(fields),
            cells,
            sim.lattice,
            sim.table,
            scheme,
            p.rates,
            p.div,
            p.neighbours,
            sim.skip_quiescent,
        )
    sim.pace.note(watch.spent, pairs)
    sim.interactions += pairs
    if dt > 0.0:
        p.ddiv[:] = (p.div - last_div) / dt
