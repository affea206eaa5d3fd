"""Compile what a run calls once, and let all ranks load the result.

Ranks that compile the same at the same time can spoil Numba's disk cache. So the ranks
of rank 0's node go first, then those of other nodes (whose cache may be their own). On
a node they share what takes longest, one of them compiles the rest, and the others load
the result. Where all that a run calls has been compiled before, there is nothing to do:
each function is loaded when it is first called.
"""

import gc
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager

import numpy as np
from mpi4py import MPI

from mpisph.case import Case, case_from_dict
from mpisph.case.sections import PAIR_FORMS
from mpisph.core.jit import CACHE_FOLDER, is_compiled, mark_compiled, prune_cache
from mpisph.core.particles import Particles
from mpisph.diagnostics.condition import measure_condition
from mpisph.diagnostics.probes import note_peaks, read_probes
from mpisph.diagnostics.series import Scales, local_parts
from mpisph.parallel.collectives import caught, raise_together
from mpisph.physics.eos.table import Tabulated, tabulated
from mpisph.physics.isentrope import fill_isentrope
from mpisph.physics.models import record_type
from mpisph.solver.setup import make_simulation
from mpisph.solver.start import start
from mpisph.solver.state import Simulation
from mpisph.solver.step import advance, rebalance, reduce_state, respond_to_state
from mpisph.sph.pair_records import RECORD_FIELDS
from mpisph.sph.rates import update_rates
from mpisph.sph.sources import AHEAD, EXCHANGED, ROW, sort_fields

TINY = {
    "title": "two plates, to compile with",
    "bodies": [
        {
            "name": name,
            "shape": "plate",
            "material": "al-lee2003",
            "thickness": 2e-3,
            "radius": 3e-3,
            "position": position,
            "velocity": velocity,
        }
        for name, position, velocity in (("flyer", -2e-3, 100.0), ("target", 0.0, 0.0))
    ],
    "resolution": {"spacing": 1e-3},
    "time": {"end": 1e-6},
}


def warm_up(comm: MPI.Intracomm, forms: Collection[str] = PAIR_FORMS) -> None:
    """Compile all that a run calls, unless the disk cache holds it on every rank.

    Parameters
    ----------
    comm : MPI.Intracomm
        Collective over it.
    forms : collection of str, optional
        Pair forms of the runs. With both, it takes a sixth longer than with one.
    """
    at_hand = np.array([is_compiled(form) for form in forms])
    comm.Allreduce(MPI.IN_PLACE, at_hand, MPI.LAND)
    missing = [form for form, found in zip(forms, at_hand, strict=True) if not found]
    if not missing:
        return
    node = MPI.Intracomm(comm.Split_type(MPI.COMM_TYPE_SHARED, key=comm.rank))
    turn = 0 if node.bcast(comm.rank) == 0 else 1
    for now in range(2):
        if now == turn:
            for form in missing:
                _compile(form, node)
                mark_compiled(form)
        comm.Barrier()
    node.Free()
    if comm.rank == 0:
        prune_cache()


def _compile(form: str, node: MPI.Intracomm) -> None:
    """Compile all that a run with a pair form calls; collective over a node."""

    def share() -> None:
        sim = _empty_simulation(form)
        for part in PARTS[node.rank :: node.size]:
            part(sim)

    with rarely_collected():
        raise_together(node, _compiled(share))
        for mine in (node.rank == 0, node.rank > 0):
            rest = _compiled(lambda: run_tiny_case(form)) if mine else None
            raise_together(node, rest)


def _compiled(action: Callable[[], object]) -> Exception | None:
    """Do what compiles; return the error it met. Numba does not say on which disk."""
    error = caught(action)
    if isinstance(error, OSError) and error.filename is None:
        return OSError(error.errno, error.strerror, str(CACHE_FOLDER))
    return error


def _compile_response(sim: Simulation) -> None:
    respond_to_state(sim, 0.0)


def _compile_rates(sim: Simulation) -> None:
    ahead, records = np.zeros((len(AHEAD), 0)), np.zeros((0, RECORD_FIELDS))
    fields = ahead[: len(EXCHANGED)]
    update_rates(
        fields, sort_fields(fields, sim.lattice), sim.lattice, sim.table, sim.scheme,
        ahead[ROW.G], sim.particles, records,
    )  # fmt: skip


PARTS = (_compile_response, _compile_rates, reduce_state)
"""What takes longest to compile, apart from each other; on two ranks one makes the
first and the last."""


def _empty_simulation(form: str) -> Simulation:
    """Return a simulation without particles on this rank alone."""
    nothing, whole, scales = Particles.zeros(0), (), Scales(1.0, 1.0)
    return make_simulation(_tiny_case(form), MPI.COMM_SELF, nothing, 0, whole, scales)


def _tiny_case(form: str) -> Case:
    return case_from_dict({**TINY, "scheme": {"pair_form": form}})


@contextmanager
def rarely_collected() -> Iterator[None]:
    """Look for garbage after 200 000 objects: after 700, it takes a tenth of compiling.

    Without any look, it would need 200 MB more.
    """
    usual = gc.get_threshold()
    gc.set_threshold(200_000, *usual[1:])
    try:
        yield
    finally:
        gc.set_threshold(*usual)


def run_tiny_case(form: str) -> None:
    """Make two steps of a tiny case on this rank alone, and measure its matter."""
    case = _tiny_case(form)
    sim = start(case, MPI.COMM_SELF)
    for _ in range(2):
        found = reduce_state(sim)
        advance(sim, 1e-10, found.rank_boxes)
        rebalance(sim, found.work)
    p, peaks = sim.particles, np.zeros(len(case.bodies))
    note_peaks(p, peaks)
    read_probes(sim.comm, [p], peaks, (), {}, sim.scales, sim.scheme.kappa, sim.planes)
    local_parts(p, sim.cloud, sim.sum_bounds)
    measure_condition(sim.comm, p, len(case.bodies), sim.scales)
    fill_isentrope(sim.table[0], 300.0)
    tabulated(1.0, 0.0, np.zeros(1, record_type(Tabulated))[0])
