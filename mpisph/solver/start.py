"""How a run begins: from its bodies, from given particles, or from a checkpoint."""

import numpy as np
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.discretise import InitialParticles, discretise
from mpisph.core.memory import keep_freed_memory
from mpisph.core.particles import Particles
from mpisph.diagnostics.series import Scales
from mpisph.parallel.cost_model import fastest_cut
from mpisph.parallel.decomposition import Cut, owners
from mpisph.parallel.halo import reach
from mpisph.parallel.load_balance import PairCost, work_of
from mpisph.parallel.migration import migrate
from mpisph.physics.response import respond
from mpisph.solver.setup import initial_scales, make_simulation
from mpisph.solver.state import Simulation
from mpisph.solver.step import evaluate_rates, rebalance, reduce_state
from mpisph.sph.timestep import StepRule

NO_STEP = StepRule(fixed=True, longest=0.0, courant=0.0)


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
    scales = initial_scales(case, initial)
    cut = _first_cut(case, comm, initial)
    mine = np.flatnonzero(owners(cut, initial.r, initial.z) == comm.rank)
    particles = _initial_particles(initial, mine)
    del initial  # every rank holds all of it
    sim = make_simulation(case, comm, particles, n_total, cut, scales)
    sim.time = time
    respond(sim.particles.material_state(), sim.table, sim.scheme.sound_speed_floor)
    rank_boxes = reduce_state(sim, NO_STEP).rank_boxes
    evaluate_rates(sim, 0.0, rank_boxes, 0.0)
    sim.pair_cost = PairCost()  # the first time, compiled code was loaded too
    rebalance(sim, reduce_state(sim).work)  # the neighbours are known only now
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
    return make_simulation(case, comm, mine, n_total, cut, scales)


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
