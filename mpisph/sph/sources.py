"""What the pair loop reads: owned and ghost particles in one global order.

Owned particles, predicted to the new time, and the ghosts received are joined and
sorted by (cell, id). The cells are those of a lattice that does not depend on the
ranks, so the neighbours of a particle stand in the same order on any number of ranks,
and sums over them have the same bits.
"""

from typing import NamedTuple

import numpy as np

from mpisph.core.particles import (
    FIELDS,
    INTEGRATED,
    LABELS,
    FloatArray,
    IntArray,
    Particles,
)
from mpisph.sph.neighbours import CellOrder, Lattice, sort_into_cells

EXCHANGED = tuple(f.name for f in FIELDS if f.exchanged)
"""Rows of what is sent, in the order of `FIELDS`: labels first, by their bits."""

_LABELS = [name for name in EXCHANGED if name in LABELS]


class Sources(NamedTuple):
    """Owned particles and then ghosts; each array has shape (n + ghosts,), SI units.

    The fields are those that `FIELDS` marks as exchanged, in its order.
    """

    id: IntArray
    material: IntArray
    m: FloatArray
    r: FloatArray
    z: FloatArray
    u_r: FloatArray
    u_z: FloatArray
    rho: FloatArray
    E: FloatArray
    S_rr: FloatArray
    S_zz: FloatArray
    S_rz: FloatArray
    h: FloatArray
    div: FloatArray


def exchanged_fields(
    p: Particles, integrated: FloatArray, div: FloatArray
) -> FloatArray:
    """Pack the fields that ghosts need, as they are at the time of evaluation.

    Parameters
    ----------
    p : Particles
        The owned particles; positions and what never changes are theirs.
    integrated : ndarray, shape (8, n)
        The integrated fields at that time.
    div : ndarray, shape (n,)
        The velocity divergence expected at that time [1/s].

    Returns
    -------
    ndarray of float64, shape (len(EXCHANGED), n)
    """
    ahead = {**dict(zip(INTEGRATED, integrated, strict=True)), "div": div}
    packed = np.empty((len(EXCHANGED), p.n))
    for row, name in enumerate(EXCHANGED):
        values = ahead.get(name, getattr(p, name))
        packed[row] = values.view(np.float64)
    return packed


def sort_fields(fields: FloatArray, lattice: Lattice) -> CellOrder:
    """Sort exchanged fields, shape (len(EXCHANGED), n), into the cells."""
    row = EXCHANGED.index
    return sort_into_cells(
        fields[row("id")].view(np.int64),
        fields[row("r")],
        fields[row("z")],
        fields[row("h")],
        lattice,
    )


def name_fields(fields: FloatArray) -> Sources:
    """Return views of exchanged fields, shape (len(EXCHANGED), n), by their names."""
    rows = dict(zip(EXCHANGED, fields, strict=True))
    return Sources(**{**rows, **{name: rows[name].view(np.int64) for name in _LABELS}})
