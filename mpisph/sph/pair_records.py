"""One record a particle, in the global order: all that the pair loop reads of it."""

from typing import NamedTuple

import numpy as np
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.physics.heat import diffusivity

TINY_RADIUS = 1e-150
"""Keeps 1/r finite for a particle on the axis [m]."""


class PairRecord(NamedTuple):
    """What a pair needs to know of one ring, SI units.

    Chosen so that the loop over pairs multiplies little: `half_h` and `half_rho` add up
    to the pair's means, `half_alpha_c` (alpha c/2) and `zeta` to those of alpha c and,
    doubled, of zeta; `root` is ``r^(-1/2)``, `m_F` is ``-2 m``, which is m F h^2;
    `s_..` is sigma/rho^2, compression positive (R3), and `s_tr` is ``s_tt - s_rr``.
    """

    r: float
    z: float
    half_h: float
    root: float
    u_r: float
    u_z: float
    m_F: float
    half_rho: float
    inv_rho: float
    half_alpha_c: float
    E: float
    zeta: float
    s_rr: float
    s_tr: float
    s_zz: float
    s_rz: float


RECORD_FIELDS = len(PairRecord._fields)


@njit(**EXACT)
def write_pair_records(sources, order, scheme, records):
    """Write the records of `PairRecord` in the global order.

    Parameters
    ----------
    sources : Sources
    order : ndarray of int64, shape (n,)
        Puts them into the global order.
    scheme : SchemeConstants
    records : ndarray, shape (n, 16)
        Written: a row is two cache lines.
    """
    for i in range(order.size):
        k = order[i]
        rho, E, h = sources.rho[k], sources.E[k], sources.h[k]
        P, c = sources.P[k], sources.c[k]
        S_rr, S_zz, S_rz = sources.S_rr[k], sources.S_zz[k], sources.S_rz[k]
        inv_rho = 1.0 / rho
        inv_rho2 = inv_rho * inv_rho
        ring = records[i]
        ring[0] = sources.r[k]
        ring[1] = sources.z[k]
        ring[2] = 0.5 * h
        ring[3] = 1.0 / np.sqrt(max(sources.r[k], TINY_RADIUS))
        ring[4] = sources.u_r[k]
        ring[5] = sources.u_z[k]
        ring[6] = -2.0 * sources.m[k]
        ring[7] = 0.5 * rho
        ring[8] = inv_rho
        ring[9] = 0.5 * scheme.alpha * c
        ring[10] = E
        ring[11] = diffusivity(scheme.g1, scheme.g2, h, c, sources.div[k])
        ring[12] = (P - S_rr) * inv_rho2
        ring[13] = (2.0 * S_rr + S_zz) * inv_rho2
        ring[14] = (P - S_zz) * inv_rho2
        ring[15] = -S_rz * inv_rho2


@njit(**EXACT)
def record_at(records, i):
    """Return record `i` as a `PairRecord`."""
    x = records[i]
    return PairRecord(
        x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7],
        x[8], x[9], x[10], x[11], x[12], x[13], x[14], x[15],
    )  # fmt: skip
