"""What the pair loop reads: owned and ghost particles in one global order.

Owned particles, predicted to the new time, and the ghosts received are joined and put
in the order (cell, id). The cells are those of a lattice that does not depend on the
ranks, so the neighbours of a particle stand in the same order on any number of ranks,
and sums over them have the same bits.
"""

from typing import NamedTuple

import numpy as np

from mpisph.neighbours import CellOrder
from mpisph.particles import FIELDS, FloatArray, IntArray, Particles

EXCHANGED = tuple(f.name for f in FIELDS if f.exchanged)
LABEL_ROWS = 2
"""The first rows of the exchanged fields, id and material, are integers' bits."""


class Sources(NamedTuple):
    """Owned and ghost particles in global order; each array has shape (n + ghosts,).

    `slot` is the index among the owned particles, or -1 for a ghost; the other fields
    are those that `FIELDS` marks as exchanged, in SI units.
    """

    slot: IntArray
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


def exchanged_fields(p: Particles, integrated: FloatArray) -> FloatArray:
    """Pack the fields that ghosts need, with `integrated` in place of the state.

    Parameters
    ----------
    p : Particles
        The owned particles.
    integrated : ndarray, shape (8, n)
        The integrated fields at the time at which rates are wanted.

    Returns
    -------
    ndarray of float64, shape (len(EXCHANGED), n)
    """
    packed = np.empty((len(EXCHANGED), p.n))
    packed[0] = p.id.view(np.float64)
    packed[1] = p.material.view(np.float64)
    packed[2], packed[3], packed[4] = p.m, p.r, p.z
    packed[5:13] = integrated
    packed[13] = p.div
    return packed


def in_global_order(fields: FloatArray, n_owned: int, cells: CellOrder) -> Sources:
    """Return `fields` (shape (len(EXCHANGED), n + ghosts)) in the order of `cells`."""
    ordered = np.take(fields, cells.order, axis=1)
    slot = np.where(cells.order < n_owned, cells.order, -1)
    labels = ordered[:LABEL_ROWS].view(np.int64)
    return Sources(slot, labels[0], labels[1], *ordered[LABEL_ROWS:])
