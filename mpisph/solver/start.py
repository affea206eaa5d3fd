"""How a run begins: from its bodies, from given particles, or from a checkpoint."""

from itertools import pairwise

import numpy as np
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.discretise import InitialParticles, discretise, initial_count
from mpisph.case.initial import read_initial
from mpisph.case.profiles import has_expressions
from mpisph.core.memory import keep_freed_memory
from mpisph.core.particles import INITIAL, Particles
from mpisph.diagnostics.series import Scales
from mpisph.parallel.collectives import caught, on_root, raise_together
from mpisph.parallel.decomposition import Cut, equal_work_cut, owners, part_work
from mpisph.parallel.halo import reach
from mpisph.parallel.load_balance import PairCost, work_of
from mpisph.parallel.migration import migrate
from mpisph.parallel.redistribution import block_starts
from mpisph.solver.setup import initial_scales, make_simulation, neighbours_inside
from mpisph.solver.state import Simulation
from mpisph.solver.step import (
    add_retired,
    evaluate_rates,
    rebalance,
    reduce_state,
    respond_to_state,
)
from mpisph.sph.gradient import UNITY
from mpisph.sph.timestep import StepRule

PIECES = 8
"""Pieces in which a rank's share is sent to its owners at the start. A particle on its
way takes half as much memory again as in a step."""

NO_STEP = StepRule(fixed=True, longest=0.0, courant=0.0)


def start(case: Case, comm: MPI.Intracomm) -> Simulation:
    """Make the first particles, share them out and evaluate the first rates.

    Each rank fills as much of the bodies as it will own. Where the case starts from
    particles of its own, rank 0 reads and checks them.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm

    Returns
    -------
    Simulation
        At time zero.

    Raises
    ------
    CaseError
        On all ranks, if the case's own particles cannot be read or are not sound, or
        if an expression of a body has no sound value somewhere.
    """
    if case.initial is None:
        shares: list[InitialParticles] = []
        block = id_block(case, comm)
        raise_together(comm, caught(lambda: shares.append(discretise(case, *block))))
        share = shares.pop()
    else:
        share = _own_share(case, comm)
    return start_from(case, comm, share, 0.0)


def _own_share(case: Case, comm: MPI.Intracomm) -> InitialParticles:
    """Return all of the case's own particles on rank 0, none on the others."""
    nothing = Particles.zeros(0)
    shares = [InitialParticles.of({n: getattr(nothing, n) for n in INITIAL})]
    on_root(comm, lambda: shares.append(read_initial(case)))
    return shares[-1]


def start_from(
    case: Case, comm: MPI.Intracomm, share: InitialParticles, time: float
) -> Simulation:
    """Share given particles out and evaluate the first rates.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
    share : InitialParticles
        Any share of all particles on each rank.
    time : float
        Time of this state [s].

    Returns
    -------
    Simulation
    """
    n_total = comm.allreduce(share.id.size)
    scales = initial_scales(case, comm, share)
    cut = _first_cut(case, comm, share)
    particles = _share_out(comm, share, cut)
    del share  # nothing else holds it
    keep_freed_memory()  # not before: what was made here is not made again
    sim = make_simulation(case, comm, particles, n_total, cut, scales)
    sim.time = time
    sim.particles.correction[:] = np.array(UNITY)[:, None]
    respond_to_state(sim, 0.0)
    rank_boxes = reduce_state(sim, NO_STEP).rank_boxes
    # Rates need the divergence and the correction of their own time: these come first.
    for _ in range(2):
        sim.interactions = 0
        evaluate_rates(sim, 0.0, rank_boxes, 0.0)
    sim.pair_cost = PairCost()  # the first time, compiled code was loaded too
    rebalance(sim, reduce_state(sim).work)  # the neighbours are known only now
    return sim


CHECKED_AT_ONCE = 1_000_000
"""Particles made to see whether they are sound."""


def check_expressions(case: Case, comm: MPI.Intracomm) -> None:
    """Evaluate the expressions of the bodies at every particle; collective.

    Raises
    ------
    CaseError
        On all ranks, with the first place where one has no sound value.
    """
    if case.initial is not None or not any(map(has_expressions, case.bodies)):
        return
    first, end = id_block(case, comm)

    def check() -> None:
        for begin in range(first, end, CHECKED_AT_ONCE):
            discretise(case, begin, min(begin + CHECKED_AT_ONCE, end))

    raise_together(comm, caught(check))


def id_block(case: Case, comm: MPI.Intracomm) -> tuple[int, int]:
    """Return the first id and the end of this rank's block of a case's particles.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
    """
    first, end = block_starts(initial_count(case), comm.size)[comm.rank :][:2]
    return int(first), int(end)


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
    left = particles.retired > 0.0
    p = particles.take(~left)
    half = reach(p.h, case.scheme.kappa)
    work = np.rint(work_of(p.neighbours))
    cut = equal_work_cut(comm, p.r, p.z, half, work, comm.size, case.parallel.cut)
    mine = migrate(comm, p, cut)
    sim = make_simulation(case, comm, mine, n_total, cut, scales)
    if left.any():
        add_retired(sim, particles.take(left))
    return sim


def _first_cut(case: Case, comm: MPI.Intracomm, share: InitialParticles) -> Cut:
    """Return a cut into parts of equally many particles, all taken as inside."""
    half = reach(share.h, case.scheme.kappa)
    equal = work_of(np.full(share.id.size, float(neighbours_inside(case))))
    return equal_work_cut(
        comm, share.r, share.z, half, equal, comm.size, case.parallel.cut
    )


def _share_out(comm: MPI.Intracomm, share: InitialParticles, cut: Cut) -> Particles:
    """Send each particle to its part, piece by piece to save memory."""
    owner = owners(cut, share.r, share.z)
    numbers = part_work(comm, owner, np.ones(owner.size))
    mine, filled = Particles.zeros(int(numbers[comm.rank])), 0
    for ends in pairwise(block_starts(share.id.size, PIECES)):
        received = migrate(comm, _particles(share, slice(*ends)), cut)
        place = slice(filled, filled + received.n)
        mine.labels[:, place] = received.labels
        mine.values[:, place] = received.values
        filled = place.stop
    return mine


def _particles(share: InitialParticles, piece: slice) -> Particles:
    ids = share.id[piece]
    p = Particles.zeros(ids.size)
    p.distension[:] = 1.0
    for name, values in share.fields().items():
        getattr(p, name)[:] = values[piece]
    return p
