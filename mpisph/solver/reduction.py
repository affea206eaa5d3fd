"""What all ranks must agree on before a step, gathered in one collective.

Every rank sends one record: its step limit, the bounding box of its halo, its work, any
fault or request to stop, and its part of the sums as integers. Every rank receives all
records and draws the same conclusions, so no step needs another reduction.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.core.jit import EXACT
from mpisph.core.jitted import copy_to, jitted
from mpisph.core.particles import LABEL, VALUE, FloatArray, IntArray, Particles
from mpisph.diagnostics.cloud import CloudDefinition
from mpisph.diagnostics.series import PARTS_TYPE, Parts, joined, parts_of
from mpisph.diagnostics.stability import STABLE, Bounds, first_fault
from mpisph.parallel.halo import bounding_box
from mpisph.parallel.load_balance import relative_pair_costs, work_of
from mpisph.parallel.reproducible_sum import CHUNKS
from mpisph.physics.response import MaterialTable
from mpisph.physics.scheme import SchemeConstants
from mpisph.sph.timestep import StepRule, allowed_step, local_limit

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


_AGREED = Reduction._fields[:-1]


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
    mine, records = np.zeros(1, RECORD), np.empty(comm.size, RECORD)
    _take_down(
        p.labels, p.values, table, scheme, rule, bounds, sum_bounds, cloud,
        pair_cost, int(stop_request), mine,
    )  # fmt: skip
    if retired is not None:
        mine["sums"] += retired.sums
        mine["maxima"] = np.maximum(mine["maxima"], retired.maxima)
    comm.Allgather(mine.view(np.int64), records.view(np.int64))
    return _conclude(records, sum_bounds)


@jitted(**EXACT)
def _take_down(
    labels: IntArray, values: FloatArray, table: MaterialTable,
    scheme: SchemeConstants, rule: StepRule, bounds: Bounds, sum_bounds: FloatArray,
    cloud: CloudDefinition, pair_cost: float, stop_request: int, records: Records,
) -> None:  # fmt: skip
    """Write this rank's record: one call, for in a small run calls are what counts."""
    mine = records[0]
    limit, where = local_limit(labels, values, scheme)
    mine.limit, mine.limited_by = limit, labels[LABEL.id, where] if where >= 0 else -1
    box = bounding_box(values, scheme.kappa, allowed_step(rule, limit), rule.kick)
    copy_to(box, mine.box)
    mine.work = work_of(values[VALUE.neighbours]).sum()
    mine.pair_cost, mine.stop_request = pair_cost, stop_request
    mine.fault, mine.fault_id = first_fault(labels, values, table, bounds)
    sums, maxima = parts_of(labels, values, cloud, sum_bounds)
    for row in range(sums.shape[0]):
        copy_to(sums[row], mine.sums[row])
    copy_to(maxima, mine.maxima)


def _conclude(records: Records, sum_bounds: FloatArray) -> Reduction:
    """Draw the same conclusions from all records on every rank."""
    agreed, sums, maxima = _agree(records)
    series = joined(sums, maxima, sum_bounds)
    return Reduction(**dict(zip(_AGREED, agreed, strict=True)), series=series)


@jitted(**EXACT)
def _agree(records: Records) -> Any:
    """Return the items of `Reduction`, and for its series the sums and maxima.

    Of equal limits, the smaller id's comes first.
    """
    first, faulty, stop_request = 0, -1, 0
    boxes, work, pair_costs = (
        np.empty((records.size, 4)), np.empty(records.size), np.empty(records.size),
    )  # fmt: skip
    sums = np.zeros(records[0].sums.shape, np.int64)
    maxima = records[0].maxima.copy()
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
        stop_request = max(stop_request, mine.stop_request)
        work[k], pair_costs[k] = mine.work, mine.pair_cost
        copy_to(mine.box, boxes[k])
        for row in range(sums.shape[0]):
            for column in range(CHUNKS):
                sums[row, column] += mine.sums[row, column]
        for row in range(maxima.size):
            maxima[row] = np.maximum(maxima[row], mine.maxima[row])
    relative = relative_pair_costs(pair_costs)
    agreed = (
        records[first].limit,
        records[first].limited_by,
        boxes,
        relative * work,
        relative,
        records[faulty].fault if faulty >= 0 else STABLE,
        records[faulty].fault_id if faulty >= 0 else -1,
        stop_request,
    )
    return agreed, sums, maxima
