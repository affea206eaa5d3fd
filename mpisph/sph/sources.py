"""What the pair loop reads: owned and ghost particles in one global order.

Owned particles, predicted to the new time, and the ghosts received are joined and
sorted by (cell, id). The cells are those of a lattice that does not depend on the
ranks, so the neighbours of a particle stand in the same order on any number of ranks,
and sums over them have the same bits.
"""

import collections
from typing import Any

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import copy_to, jitted
from mpisph.core.particles import (
    CORRECTION,
    FIELDS,
    HISTORY,
    LABEL,
    VALUE,
    FloatArray,
    MaterialState,
    Particles,
)
from mpisph.sph.integrator import predict
from mpisph.sph.neighbours import CellOrder, Lattice, sort_into_cells

EXCHANGED = tuple(f.name for f in FIELDS if f.exchanged)
"""Rows of what is sent, in the order of `FIELDS`: labels first, by their bits."""

AHEAD = (*EXCHANGED, *(n for n in MaterialState._fields if n not in EXCHANGED))
"""Rows of `look_ahead`: what is sent, then what material models need besides."""

_namedtuple: Any = collections.namedtuple  # of fields that follow the table

Sources: Any = _namedtuple("Sources", EXCHANGED)
"""Owned particles and then ghosts; each array has shape (n + ghosts,), SI units."""

ROW: Any = _namedtuple("ROW", AHEAD)(*range(len(AHEAD)))
"""Row of each field, by its name."""

LAST = ("div", *CORRECTION)
"""Rows of what an evaluation gives besides rates, as the one before left it."""

_INTEGRATED = slice(ROW.u_r, ROW.h + 1)
_SAME = ("m", "r", "z", *HISTORY, "melt")
_SAME_TO = np.array([AHEAD.index(name) for name in _SAME])
_SAME_FROM = np.array([getattr(VALUE, name) for name in _SAME])
_LAST = np.array([getattr(VALUE, name) for name in LAST])
_LAST_RATES = np.array([getattr(VALUE, f"d{name}") for name in LAST])
_LAST_AHEAD = np.array([AHEAD.index(name) for name in LAST])
OF_AHEAD = MaterialState(*(AHEAD.index(name) for name in MaterialState._fields))
"""Rows of what material models read and set, for `response.respond_rows`."""


def look_ahead(
    p: Particles, after: float, dt: float, ahead: FloatArray, last: FloatArray
) -> None:
    """Write the state that the rates are evaluated for (R11).

    Artificial heat (R6) and the weights (R3) need the divergence, and solids the
    correction (R2, R3), which that evaluation is to give. The last ones alone would
    make the scheme first order in time; extrapolated, they keep the second.

    Parameters
    ----------
    p : Particles
        The owned particles, at their new positions; ``w_r, w_z`` are set to the
        velocities of that state.
    after : float
        How far ahead of the other fields that state is [s].
    dt : float
        Time since the last evaluation [s].
    ahead : ndarray, shape (len(AHEAD), n)
        Written, but for the response.
    last : ndarray, shape (len(LAST), n)
        Written, for `note_changes`.
    """
    predict(p, after, ahead[_INTEGRATED])
    _carry(p.labels, p.values, dt, ahead, last)


@jitted(**EXACT)
def _carry(labels: Any, values: Any, dt: float, ahead: Any, last: Any) -> None:
    """Write what is not integrated: copies, and what the last two steps foretell."""
    copy_to(ahead[ROW.u_r], values[VALUE.w_r])
    copy_to(ahead[ROW.u_z], values[VALUE.w_z])
    copy_to(labels[LABEL.id], ahead[ROW.id].view(np.int64))
    copy_to(labels[LABEL.material], ahead[ROW.material].view(np.int64))
    for k in range(_SAME_TO.size):
        copy_to(values[_SAME_FROM[k]], ahead[_SAME_TO[k]])
    for k in range(_LAST.size):
        now, rate = values[_LAST[k]], values[_LAST_RATES[k]]
        copy_to(now, last[k])
        for i in range(now.size):
            ahead[_LAST_AHEAD[k], i] = now[i] + dt * rate[i]


@jitted(**EXACT)
def note_changes(values: Any, last: Any, dt: float) -> None:
    """Set the rates of `LAST` to what an evaluation, `dt` [s] later, has changed (R11).

    Parameters
    ----------
    values : ndarray
        Of `Particles`.
    last : ndarray, shape (len(LAST), n)
        From `look_ahead`.
    dt : float
        Not zero.
    """
    for k in range(_LAST.size):
        now, rate = values[_LAST[k]], values[_LAST_RATES[k]]
        for i in range(now.size):
            rate[i] = (now[i] - last[k, i]) / dt


def sort_fields(fields: FloatArray, lattice: Lattice) -> CellOrder:
    """Sort exchanged fields, shape (len(EXCHANGED), n), into the cells."""
    return sort_into_cells(
        fields[ROW.id].view(np.int64), fields[ROW.r], fields[ROW.z], fields[ROW.h],
        lattice,
    )  # fmt: skip


@jitted(**EXACT)
def name_fields(fields: Any) -> Sources:
    """Return views of exchanged fields, shape (len(EXCHANGED), n), by their names."""
    return Sources(
        id=fields[ROW.id].view(np.int64),
        material=fields[ROW.material].view(np.int64),
        m=fields[ROW.m],
        r=fields[ROW.r],
        z=fields[ROW.z],
        u_r=fields[ROW.u_r],
        u_z=fields[ROW.u_z],
        rho=fields[ROW.rho],
        E=fields[ROW.E],
        S_rr=fields[ROW.S_rr],
        S_zz=fields[ROW.S_zz],
        S_rz=fields[ROW.S_rz],
        h=fields[ROW.h],
        div=fields[ROW.div],
        P=fields[ROW.P],
        c=fields[ROW.c],
        B_rr=fields[ROW.B_rr],
        B_tt=fields[ROW.B_tt],
        B_rz=fields[ROW.B_rz],
        B_zz=fields[ROW.B_zz],
    )
