"""What all ranks must agree on before a step, gathered in one collective.

Every rank sends one record: its step limit, its halo claim, its work, any fault or
wish, and its part of the conserved sums as integers. Every rank receives all records
and draws the same conclusions, so no step needs another reduction.
"""

from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.core.particles import FloatArray, Particles
from mpisph.diagnostics.diagnostics import (
    CloudDefinition,
    in_cloud,
    local_extent,
    totals,
)
from mpisph.diagnostics.stability import STABLE, Bounds, first_fault
from mpisph.parallel.collectives import CHUNKS, fixed_point_chunks, from_chunks
from mpisph.parallel.decomposition import relative_paces, work_of
from mpisph.parallel.halo import claim
from mpisph.physics.response import MaterialTable
from mpisph.physics.scheme import Scheme
from mpisph.sph.timestep import StepRule, local_limit

N_SUMS = 5
"""The conserved sums and the mass of the cloud."""

HEAD = 13
"""Numbers of a record before the sums."""


class Survey(NamedTuple):
    """The state of a run, the same on all ranks.

    Attributes
    ----------
    limit : float
        Smallest step limit, without Courant factor [s].
    limited_by : int
        Id of the particle that sets it.
    claims : ndarray, shape (ranks, 4)
        Halo claim of each rank [m].
    work : ndarray, shape (ranks,)
        Work of each rank, in pairs of average pace.
    paces : ndarray, shape (ranks,)
        Measured time of a pair on each rank, relative to the mean.
    fault : int
        Fault found (see `stability`).
    fault_id : int
        Smallest id of a particle with that fault.
    wish : int
        Largest wish of a rank (see `guard`).
    sums : ndarray, shape (4,)
        Mass [kg], axial momentum [kg m/s], kinetic and internal energy [J].
    cloud_mass : float
        Mass of the cloud [kg].
    extent : ndarray, shape (2,)
        R_b and L_b by the outermost particles of the cloud [m].
    """

    limit: float
    limited_by: int
    claims: FloatArray
    work: FloatArray
    paces: FloatArray
    fault: int
    fault_id: int
    wish: int
    sums: FloatArray
    cloud_mass: float
    extent: FloatArray


def take_survey(
    comm: MPI.Intracomm, p: Particles, table: MaterialTable, scheme: Scheme,
    rule: StepRule, bounds: Bounds, sum_bounds: FloatArray, cloud: CloudDefinition,
    pace: float = 0.0, wish: int = 0,
) -> Survey:  # fmt: skip
    """Gather the records of all ranks (the step's only collective).

    Parameters
    ----------
    comm : MPI.Intracomm
    p : Particles
    table : structured ndarray
    scheme : Scheme
    rule : StepRule
        Of the coming step: the halo claims must hold until its end.
    bounds : Bounds
        Of sound runs.
    sum_bounds : ndarray, shape (4,)
        Bounds of one particle's terms of the conserved sums.
    cloud : CloudDefinition
    pace : float, optional
        Measured time of a pair on this rank [s], 0 for unknown.
    wish : int, optional
        What this rank asks for, such as to stop.
    """
    limit, where = local_limit(p, scheme)
    fault, fault_id = first_fault(p, table, bounds)
    bounds_of_terms = np.append(sum_bounds, sum_bounds[0])
    chunks = fixed_point_chunks(_terms(p, cloud), bounds_of_terms)
    record = np.empty(HEAD + N_SUMS * CHUNKS)
    record[0] = limit
    record[1] = p.id[where] if where >= 0 else -1
    record[2:6] = claim(p, scheme.kappa, rule.allowed(limit), rule.kick)
    record[6] = work_of(p.neighbours).sum()
    record[7:9] = fault, fault_id
    record[9:11] = local_extent(p, cloud)
    record[11:13] = pace, wish
    record[HEAD:] = chunks.ravel().view(np.float64)
    records = np.empty((comm.size, record.size))
    comm.Allgather(record, records)
    return _conclude(records, bounds_of_terms)


def _terms(p: Particles, cloud: CloudDefinition) -> FloatArray:
    """Return what each particle adds to the sums, shape (N_SUMS, n)."""
    cloud_mass = p.m * in_cloud(p.z, p.u_z, cloud)
    return np.concatenate([totals(p), cloud_mass[np.newaxis]])


def _conclude(records: FloatArray, bounds_of_terms: FloatArray) -> Survey:
    """Draw the same conclusions from all records on every rank."""
    first, fault, who = _first_and_fault(records)
    chunks = np.ascontiguousarray(records[:, HEAD:]).view(np.int64).sum(axis=0)
    *sums, cloud_mass = from_chunks(chunks.reshape(N_SUMS, CHUNKS), bounds_of_terms)
    paces = relative_paces(records[:, 11])
    return Survey(
        limit=float(records[first, 0]),
        limited_by=int(records[first, 1]),
        claims=records[:, 2:6].copy(),
        work=paces * records[:, 6],
        paces=paces,
        fault=int(fault),
        fault_id=int(who),
        wish=int(np.maximum.reduce(records[:, 12])),
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
