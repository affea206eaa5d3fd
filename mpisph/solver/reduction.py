"""What all ranks must agree on before a step, gathered in one collective.

Every rank sends one record: its step limit, the bounding box of its halo, its work, any
fault or request to stop, and its part of the sums as integers. Every rank receives all
records and draws the same conclusions, so no step needs another reduction.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.core.particles import FloatArray, Particles
from mpisph.diagnostics.cloud import CloudDefinition
from mpisph.diagnostics.series import PARTS_TYPE, Parts, joined, local_parts
from mpisph.diagnostics.stability import STABLE, Bounds, first_fault
from mpisph.parallel.halo import bounding_box
from mpisph.parallel.load_balance import relative_pair_costs, work_of
from mpisph.physics.response import MaterialTable
from mpisph.physics.scheme import SchemeConstants
from mpisph.sph.timestep import StepRule, local_limit

Records = npt.NDArray[np.void]

RECORD = np.dtype(
    (
        np.record,
        [
            ("limit", np.float64),
            ("limited_by", np.int64),
            ("box", np.float64, (4,)),
            ("work", np.float64),
            ("pair_cost", np.float64),
            ("fault", np.int64),
            ("fault_id", np.int64),
            ("stop_request", np.int64),
            *PARTS_TYPE,
        ],
    )
)
"""What each rank sends; all of its items have eight bytes."""


class Reduction(NamedTuple):
    """The state of a run, the same on all ranks.

    Attributes
    ----------
    limit : float
        Smallest step limit, without Courant factor [s].
    limited_by : int
        Id of the particle that sets it.
    rank_boxes : ndarray, shape (ranks, 4)
        Bounding box of each rank's halo [m].
    work : ndarray, shape (ranks,)
        Work of each rank, in pairs of average cost.
    pair_costs : ndarray, shape (ranks,)
        Measured time of a pair on each rank, relative to the mean.
    fault : int
        Fault found (see `stability`).
    fault_id : int
        Smallest id of a particle with that fault.
    stop_request : int
        Largest request of a rank (see `signals`).
    series : dict of str to float
        The quantities of `diagnostics.series` by name, in SI units.
    """

    limit: float
    limited_by: int
    rank_boxes: FloatArray
    work: FloatArray
    pair_costs: FloatArray
    fault: int
    fault_id: int
    stop_request: int
    series: dict[str, float]


def global_reduction(
    comm: MPI.Intracomm, p: Particles, table: MaterialTable, scheme: SchemeConstants,
    rule: StepRule, bounds: Bounds, sum_bounds: FloatArray, cloud: CloudDefinition,
    pair_cost: float = 0.0, stop_request: int = 0, retired: Parts | None = None,
) -> Reduction:  # fmt: skip
    """Gather the records of all ranks (the step's only collective).

    Parameters
    ----------
    comm : MPI.Intracomm
    p : Particles
    table : structured ndarray
    scheme : SchemeConstants
    rule : StepRule
        Of the coming step: the bounding boxes must hold until its end.
    bounds : Bounds
        Of sound runs.
    sum_bounds : ndarray, shape (sums,)
        Bounds of one particle's terms of the sums; see `series.bounds_of`.
    cloud : CloudDefinition
    pair_cost : float, optional
        Measured time of a pair on this rank [s], 0 for unknown.
    stop_request : int, optional
        What this rank asks for, such as to stop.
    retired : Parts, optional
        What matter that has left the game on this rank adds to the sums.
    """
    limit, where = local_limit(p, scheme)
    fault, fault_id = first_fault(p, table, bounds)
    parts = local_parts(p, cloud, sum_bounds)
    record = np.zeros(1, RECORD)
    record["limit"] = limit
    record["limited_by"] = p.id[where] if where >= 0 else -1
    record["box"] = bounding_box(p, scheme.kappa, rule.allowed(limit), rule.kick)
    record["work"] = work_of(p.neighbours).sum()
    record["pair_cost"] = pair_cost
    record["fault"], record["fault_id"] = fault, fault_id
    record["stop_request"] = stop_request
    record["sums"], record["maxima"] = parts
    if retired is not None:
        record["sums"] += retired.sums
        record["maxima"] = np.maximum(record["maxima"], retired.maxima)
    records = np.empty(comm.size, RECORD)
    comm.Allgather(record.view(np.int64), records.view(np.int64))
    return _conclude(records, sum_bounds)


def _conclude(records: Records, sum_bounds: FloatArray) -> Reduction:
    """Draw the same conclusions from all records on every rank."""
    first, fault, who = _first_and_fault(records)
    pair_costs = relative_pair_costs(records["pair_cost"])
    return Reduction(
        limit=float(records["limit"][first]),
        limited_by=int(records["limited_by"][first]),
        rank_boxes=records["box"].copy(),
        work=pair_costs * records["work"],
        pair_costs=pair_costs,
        fault=int(fault),
        fault_id=int(who),
        stop_request=int(records["stop_request"].max()),
        series=joined(records["sums"], records["maxima"], sum_bounds),
    )


@njit(**EXACT)  # type: ignore[untyped-decorator]
def _first_and_fault(records: Records) -> tuple[int, int, int]:
    """Return the rank with the smallest limit, the fault of smallest id, and that id.

    Of equal limits, the smaller id's comes first.
    """
    first, faulty = 0, -1
    for k in range(records.size):
        mine, best = records[k], records[first]
        if mine.limit < best.limit or (
            mine.limit == best.limit and mine.limited_by < best.limited_by
        ):
            first = k
        if mine.fault != STABLE and (
            faulty < 0 or mine.fault_id < records[faulty].fault_id
        ):
            faulty = k
    if faulty < 0:
        return first, STABLE, -1
    return first, records[faulty].fault, records[faulty].fault_id
