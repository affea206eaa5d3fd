"""Compile what a run calls once, and let all ranks load the result.

Ranks that compile at the same time can spoil Numba's disk cache, and would each spend
the same half minute. So rank 0 goes first, then one rank of each node (whose cache may
be its own), then the others. Where all that a run calls has been compiled before, there
is nothing to do: each function is loaded when it is first called.
"""

import gc
from collections.abc import Collection, Iterator
from contextlib import contextmanager

import numpy as np
from mpi4py import MPI

from mpisph.case import case_from_dict
from mpisph.case.sections import PAIR_FORMS
from mpisph.core.jit import is_compiled, mark_compiled, prune_cache
from mpisph.diagnostics.probes import note_peaks, read_probes
from mpisph.solver.start import start
from mpisph.solver.step import advance, rebalance, reduce_state

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
    node = comm.Split_type(MPI.COMM_TYPE_SHARED, key=comm.rank)
    turn = 0 if comm.rank == 0 else 1 if node.rank == 0 else 2
    node.Free()
    for now in range(3):
        if now == turn:
            for form in missing:
                with rarely_collected():
                    run_tiny_case(form)
                mark_compiled(form)
        comm.Barrier()
    if comm.rank == 0:
        prune_cache()


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
    """Make two steps of a tiny case on this rank alone, and read its probes."""
    case = case_from_dict({**TINY, "scheme": {"pair_form": form}})
    sim = start(case, MPI.COMM_SELF)
    for _ in range(2):
        found = reduce_state(sim)
        advance(sim, 1e-10, found.rank_boxes)
        rebalance(sim, found.work)
    peaks = np.zeros(len(case.bodies))
    note_peaks(sim.particles, peaks)
    read_probes(
        sim.comm, [sim.particles], peaks, (), {}, sim.scales, sim.scheme.kappa,
        sim.planes,
    )  # fmt: skip
