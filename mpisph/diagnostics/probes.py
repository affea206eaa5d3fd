"""What is followed besides the whole: each body, and gauges at chosen places.

All of it has the same bits on any number of ranks: sums are of integers, maxima exact,
and what a moving gauge reads belongs to one particle.
"""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.case.sections import Gauge
from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import LABEL, VALUE, FloatArray, IntArray, Particles
from mpisph.diagnostics.series import ROOM, Quantity, Scales, column_name
from mpisph.parallel.reproducible_sum import (
    CHUNKS,
    fixed_point_chunks,
    from_chunks,
    scale_of,
    split,
)

BODY_QUANTITIES = (
    Quantity("mass", "kg", "mass"),
    Quantity("momentum_z", "kg m/s", "axial momentum"),
    Quantity("momentum_r", "kg m/s", "radial momentum, sum of m u_r"),
    Quantity("kinetic_energy", "J", "kinetic energy"),
    Quantity("internal_energy", "J", "internal energy"),
    Quantity("peak_pressure", "Pa", "largest pressure so far of a particle"),
)
"""Of each body; all but the last are sums over its particles."""

GAUGE_QUANTITIES = (
    Quantity("z", "m", "axial position"),
    Quantity("r", "m", "radius"),
    Quantity("P", "Pa", "pressure"),
    Quantity("rho", "kg/m3", "density"),
    Quantity("E", "J/kg", "specific internal energy"),
    Quantity("u_z", "m/s", "axial velocity"),
    Quantity("u_r", "m/s", "radial velocity"),
    Quantity("S_rr", "Pa", "deviatoric stress rr"),
    Quantity("S_zz", "Pa", "deviatoric stress zz"),
    Quantity("S_rz", "Pa", "deviatoric stress rz"),
)
"""At each gauge."""

_FIELDS = tuple(quantity.name for quantity in GAUGE_QUANTITIES)
_SAMPLED = _FIELDS[2:]
_ODD = np.array([-1.0 if name in {"u_r", "S_rz"} else 1.0 for name in _SAMPLED])
# What changes its sign on the other side of the axis.
_ODD_IN_Z = np.array([-1.0 if name in {"u_z", "S_rz"} else 1.0 for name in _SAMPLED])
# What changes its sign behind a rigid plane.

_BODY_SUMS = len(BODY_QUANTITIES) - 1

COVERED = 0.1
"""Least sum of the kernel's weights at a place where there is matter: it is 1 within a
body, a half at its surface."""

_LARGEST = 1e21
# Bound of a sampled value times its weight; the sums are exact to 1e-9 of an SI unit.


class ProbeValues(NamedTuple):
    """What the probes read at one time.

    Attributes
    ----------
    bodies : ndarray, shape (bodies, len(BODY_QUANTITIES))
    gauges : ndarray, shape (gauges, len(GAUGE_QUANTITIES))
        NaN where there is no matter.
    """

    bodies: FloatArray
    gauges: FloatArray


def nearest_particles(
    comm: MPI.Intracomm, p: Particles, gauges: Sequence[Gauge]
) -> dict[str, int]:
    """Return the id of the particle nearest to each moving gauge; collective.

    Of equally near ones it is the smallest id.
    """
    found = {}
    for gauge in gauges:
        if gauge.kind == "moving":
            distance = (p.r - gauge.r) ** 2 + (p.z - gauge.z) ** 2
            mine = (np.inf, -1)
            if p.n:
                k = np.lexsort((p.id, distance))[0]
                mine = (float(distance[k]), int(p.id[k]))
            found[gauge.name] = min(pair for pair in comm.allgather(mine))[1]
    return found


def note_peaks(p: Particles, peaks: FloatArray) -> None:
    """Raise the largest pressures of the bodies, shape (bodies,), to those of now."""
    _note_peaks(p.labels, p.values, peaks)


@jitted(**EXACT)
def _note_peaks(labels: IntArray, values: FloatArray, peaks: FloatArray) -> None:
    body, P = labels[LABEL.body], values[VALUE.P]
    for k in range(P.size):
        if P[k] > peaks[body[k]] or np.isnan(P[k]):
            peaks[body[k]] = P[k]


def read_probes(
    comm: MPI.Intracomm,
    groups: Sequence[Particles],
    peaks: FloatArray,
    gauges: Sequence[Gauge],
    followed: dict[str, int],
    scales: Scales,
    kappa: float,
    planes: tuple[float, float],
) -> ProbeValues:
    """Read all probes; collective.

    Parameters
    ----------
    comm : MPI.Intracomm
    groups : sequence of Particles
        Together the owned particles.
    peaks : ndarray, shape (bodies,)
        Largest pressures that this rank has seen [Pa].
    gauges : sequence of Gauge
    followed : dict of str to int
        From `nearest_particles`.
    scales : Scales
    kappa : float
        Cut of the kernel in smoothing lengths.
    planes : tuple of float
        Rigid planes, behind which fixed gauges see mirror images of the matter;
        infinite where there is none [m].
    """
    fixed = [gauge for gauge in gauges if gauge.kind == "fixed"]
    moving = [gauge for gauge in gauges if gauge.kind == "moving"]
    n = len(peaks)
    first = n * _BODY_SUMS  # of the gauges' sums
    bounds = np.array([*_body_bounds(scales)] * n)
    at_gauges = np.full(1 + len(_SAMPLED), _LARGEST)
    sums = np.zeros((first + len(fixed) * at_gauges.size, CHUNKS), np.int64)
    mine = np.zeros((len(moving), len(_FIELDS)))
    for p in groups:
        sums[:first] += _body_sums(p.labels, p.values, bounds)
        for j, gauge in enumerate(fixed):
            begin = first + j * at_gauges.size
            sums[begin : begin + at_gauges.size] += fixed_point_chunks(
                _weighted(p, gauge, kappa, planes), at_gauges
            )
        for row, gauge in zip(mine, moving, strict=True):
            for k in np.flatnonzero(p.id == followed[gauge.name]):
                row[:] = [getattr(p, name)[k] for name in _FIELDS]
    comm.Allreduce(MPI.IN_PLACE, sums, MPI.SUM)
    one = np.concatenate([peaks, mine.ravel()])
    all_ranks = np.empty((comm.size, one.size))
    comm.Allgather(one, all_ranks)
    totals = from_chunks(sums[:first], bounds).reshape(n, _BODY_SUMS)
    highest = all_ranks[:, :n].max(axis=0)
    # One rank owns the particle, the others add zeros.
    of_moving = all_ranks[:, n:].sum(axis=0).reshape(mine.shape)
    of_fixed = sums[first:].reshape(len(fixed), at_gauges.size, CHUNKS)
    read = {g.name: row for g, row in zip(moving, of_moving, strict=True)}
    for gauge, chunks in zip(fixed, of_fixed, strict=True):
        weight, *values = from_chunks(chunks, at_gauges)
        if weight < COVERED:
            values = [np.nan] * len(values)
        mean = np.array(values) / weight if weight else np.array(values)
        read[gauge.name] = np.array([gauge.z, gauge.r, *mean])
    rows = [read[gauge.name] for gauge in gauges]
    return ProbeValues(
        np.column_stack([totals, highest]),
        np.array(rows).reshape(len(gauges), len(_FIELDS)),
    )


def _body_bounds(scales: Scales) -> tuple[float, ...]:
    """Return what no particle's term of the sums exceeds."""
    m = scales.mass
    momentum, energy = m * ROOM * scales.speed, m * ROOM * scales.energy
    return m, momentum, momentum, energy, energy


@jitted(**EXACT)
def _body_sums(labels: IntArray, values: FloatArray, bounds: FloatArray) -> IntArray:
    """Return the parts of the sums of all bodies, shape (bodies * sums, CHUNKS)."""
    scales = np.array([scale_of(bound) for bound in bounds])
    sums = np.zeros((bounds.size, CHUNKS), np.int64)
    for k in range(labels.shape[1]):
        m, E = values[VALUE.m, k], values[VALUE.E, k]
        u_r, u_z = values[VALUE.u_r, k], values[VALUE.u_z, k]
        terms = (m, m * u_z, m * u_r, 0.5 * m * (u_r * u_r + u_z * u_z), m * E)
        for j in range(_BODY_SUMS):
            row = _BODY_SUMS * labels[LABEL.body, k] + j
            chunks = split(terms[j], bounds[row], scales[row])
            for c in range(CHUNKS):
                sums[row, c] += chunks[c]
    return sums


def _weighted(
    p: Particles, gauge: Gauge, kappa: float, planes: tuple[float, float]
) -> FloatArray:
    """Return weights at a place, and weighted values, of the particles that reach it.

    The weight is the particle's area in the r-z plane times a Gaussian of its smoothing
    length; what lies on the other side of the axis counts too, and behind a plane the
    images. Behind a plane itself there is no matter.

    Returns
    -------
    ndarray, shape (1 + sampled, terms)
    """
    low, high = planes
    if not low <= gauge.z <= high:
        return np.zeros((1 + len(_SAMPLED), 0))
    images = [(p.z, np.ones(len(_SAMPLED)))]
    images += [(2.0 * z - p.z, _ODD_IN_Z) for z in planes if np.isfinite(z)]
    parts: list[npt.NDArray[np.float64]] = []
    for side, (z, mirrored) in product((1.0, -1.0), images):
        squared = (side * p.r - gauge.r) ** 2 + (z - gauge.z) ** 2
        near = np.flatnonzero(squared < (kappa * p.h) ** 2)
        h, r = p.h[near], p.r[near]
        area = p.m[near] / (2.0 * np.pi * r * p.rho[near])
        weight = area * np.exp(-squared[near] / h**2) / (np.pi * h**2)
        signs = mirrored * (_ODD if side < 0.0 else 1.0)
        values = [s * getattr(p, n)[near] for s, n in zip(signs, _SAMPLED, strict=True)]
        parts.append(np.stack([weight, *(weight * value for value in values)]))
    return np.ascontiguousarray(np.concatenate(parts, axis=1))


def body_columns(names: Sequence[str]) -> list[str]:
    """Return the names of the columns of the bodies, in the order of the values."""
    return [column_name(q, name) for name in names for q in BODY_QUANTITIES]


def gauge_columns(names: Sequence[str]) -> list[str]:
    """Return the names of the columns of the gauges, in the order of the values."""
    return [column_name(q, name) for name in names for q in GAUGE_QUANTITIES]
