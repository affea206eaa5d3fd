"""What all ranks must agree on before a step, gathered in one collective.

Every rank sends one record: its step limit, the bounding box of its halo, its work, any
fault or request to stop, and its part of the sums as integers. Every rank receives all
records and draws the same conclusions, so no step needs another reduction.
"""

from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.core.particles import FloatArray, Particles
from mpisph.diagnostics.cloud import CloudDefinition, in_cloud, local_extent
from mpisph.diagnostics.conservation import totals
from mpisph.diagnostics.stability import STABLE, Bounds, first_fault
from mpisph.parallel.halo import bounding_box
from mpisph.parallel.load_balance import relative_pair_costs, work_of
from mpisph.parallel.reproducible_sum import CHUNKS, fixed_point_chunks, from_chunks
from mpisph.physics.response import MaterialTable
from mpisph.physics.scheme import SchemeConstants
from mpisph.sph.timestep import StepRule, local_limit

N_SUMS = 5
"""The conserved sums and the mass of the cloud."""

HEAD = 13
"""Numbers of a record before the sums."""


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
    sums : ndarray, shape (4,)
        Mass [kg], axial momentum [kg m/s], kinetic and internal energy [J].
    cloud_mass : float
        Mass of the cloud [kg].
    extent : ndarray, shape (2,)
        R_b and L_b by the outermost particles of the cloud [m].
    """

    limit: float
    limited_by: int
    rank_boxes: FloatArray
    work: FloatArray
    pair_costs: FloatArray
    fault: int
    fault_id: int
    stop_request: int
    sums: FloatArray
    cloud_mass: float
    extent: FloatArray


def global_reduction(
    comm: MPI.Intracomm, p: Particles, table: MaterialTable, scheme: SchemeConstants,
    rule: StepRule, bounds: Bounds, sum_bounds: FloatArray, cloud: CloudDefinition,
    pair_cost: float = 0.0, stop_request: int = 0,
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
    sum_bounds : ndarray, shape (4,)
        Bounds of one particle's terms of the conserved sums.
    cloud : CloudDefinition
    pair_cost : float, optional
        Measured time of a pair on this rank [s], 0 for unknown.
    stop_request : int, optional
        What this rank asks for, such as to stop.
    """
    limit, where = local_limit(p, scheme)
    fault, fault_id = first_fault(p, table, bounds)
    bounds_of_terms = np.append(sum_bounds, sum_bounds[0])
    chunks = fixed_point_chunks(_terms(p, cloud), bounds_of_terms)
    record = np.empty(HEAD + N_SUMS * CHUNKS)
    record[0] = limit
    record[1] = p.id[where] if where >= 0 else -1
    record[2:6] = bounding_box(p, scheme.kappa, rule.allowed(limit), rule.kick)
    record[6] = work_of(p.neighbours).sum()
    record[7:9] = fault, fault_id
    record[9:11] = local_extent(p, cloud)
    record[11:13] = pair_cost, stop_request
    record[HEAD:] = chunks.ravel().view(np.float64)
    records = np.empty((comm.size, record.size))
    comm.Allgather(record, records)
    return _conclude(records, bounds_of_terms)


def _terms(p: Particles, cloud: CloudDefinition) -> FloatArray:
    """Return what each particle adds to the sums, shape (N_SUMS, n)."""
    cloud_mass = p.m * in_cloud(p.z, p.u_z, cloud)
    return np.concatenate([totals(p), cloud_mass[np.newaxis]])


def _conclude(records: FloatArray, bounds_of_terms: FloatArray) -> Reduction:
    """Draw the same conclusions from all records on every rank."""
    first, fault, who = _first_and_fault(records)
    chunks = np.ascontiguousarray(records[:, HEAD:]).view(np.int64).sum(axis=0)
    *sums, cloud_mass = from_chunks(chunks.reshape(N_SUMS, CHUNKS), bounds_of_terms)
    pair_costs = relative_pair_costs(records[:, 11])
    return Reduction(
        limit=float(records[first, 0]),
        limited_by=int(records[first, 1]),
        rank_boxes=records[:, 2:6].copy(),
        work=pair_costs * records[:, 6],
        pair_costs=pair_costs,
        fault=int(fault),
        fault_id=int(who),
        stop_request=int(np.maximum.reduce(records[:, 12])),
        sums=np.array(sums),
        cloud_mass=float(cloud_mass),
        extent=np.maximum.reduce(records[:, 9:11]),
    )


@njit(**EXACT)  # type: ignore[untyped-decorator]
def _first_and_fault(records: FloatArray) -> tuple[int, int, int]:
    """Return the rank with the smallest limit, the fault of smallest id, and that id.

    Of equal limits, the smaller id's comes first.
    """
    first, faulty = 0, -1
    for k in range(records.shape[0]):
        limit, where = records[k, 0], records[k, 1]
        if limit < records[first, 0] or (
            limit == records[first, 0] and where < records[first, 1]
        ):
            first = k
        if records[k, 7] != STABLE and (
            faulty < 0 or records[k, 8] < records[faulty, 8]
        ):
            faulty = k
    if faulty < 0:
        return first, STABLE, -1
    return first, int(records[faulty, 7]), int(records[faulty, 8])
