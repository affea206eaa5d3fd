"""What the pair loop reads: owned and ghost particles in one global order.

Owned particles, predicted to the new time, and the ghosts received are joined and
sorted by (cell, id). The cells are those of a lattice that does not depend on the
ranks, so the neighbours of a particle stand in the same order on any number of ranks,
and sums over them have the same bits.
"""

import collections
from collections.abc import Mapping
from typing import Any

import numpy as np

from mpisph.core.particles import (
    FIELDS,
    LABELS,
    FloatArray,
    Particles,
)
from mpisph.sph.neighbours import CellOrder, Lattice, sort_into_cells

EXCHANGED = tuple(f.name for f in FIELDS if f.exchanged)
"""Rows of what is sent, in the order of `FIELDS`: labels first, by their bits."""

_LABELS = [name for name in EXCHANGED if name in LABELS]


_namedtuple: Any = collections.namedtuple  # of fields that follow the table

Sources: Any = _namedtuple("Sources", EXCHANGED)
"""Owned particles and then ghosts; each array has shape (n + ghosts,), SI units."""


def exchanged_fields(p: Particles, ahead: Mapping[str, FloatArray]) -> FloatArray:
    """Pack the fields that ghosts need, as they are at the time of evaluation.

    Parameters
    ----------
    p : Particles
        The owned particles; positions and what never changes are theirs.
    ahead : mapping of str to ndarray
        The fields that are others at that time than now, each of shape (n,).

    Returns
    -------
    ndarray of float64, shape (len(EXCHANGED), n)
    """
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
