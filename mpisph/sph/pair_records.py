"""One record a particle, in the global order: all that the pair loop reads of it."""

from typing import NamedTuple

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.physics.heat import diffusivity
from mpisph.sph.gradient import corrected

TINY_RADIUS = 1e-150
"""Keeps 1/r finite for a particle on the axis [m]."""


class PairRecord(NamedTuple):
    """What a pair needs to know of one ring, SI units.

    Chosen so that the loop over pairs multiplies little: `half_h` and `half_rho` add up
    to the pair's means, `half_alpha_c` (alpha c/2) to that of alpha c, and `two_zeta`
    to four times that of zeta; `V_F` is ``-2 m/(rho r^(1/2))``, which is
    V F h^2 r^(-1/2); `s_..` is sigma B, compression positive (R3), and `half_s_tr` is
    ``(s_tt - s_rr)/2``. `eta` is rho over its value at rest, negative where theta is
    zero (R3).
    """

    r: float
    z: float
    half_h: float
    V_F: float
    u_r: float
    u_z: float
    half_rho: float
    eta: float
    half_alpha_c: float
    E: float
    two_zeta: float
    s_rr: float
    half_s_tr: float
    s_zz: float
    s_rz: float
    s_zr: float


RECORD_FIELDS = len(PairRecord._fields)


@jitted(**EXACT)
def write_pair_records(sources, order, table, scheme, records):
    """Write the records of `PairRecord` in the global order.

    Parameters
    ----------
    sources : Sources
    order : ndarray of int64, shape (n,)
        Puts them into the global order.
    table : structured ndarray
        Material constants.
    scheme : SchemeConstants
    records : ndarray, shape (n, 16)
        Written.
    """
    for i in range(order.size):
        k = order[i]
        rho, E, h = sources.rho[k], sources.E[k], sources.h[k]
        P, c, div = sources.P[k], sources.c[k], sources.div[k]
        S_rr, S_zz, S_rz = sources.S_rr[k], sources.S_zz[k], sources.S_rz[k]
        mat = table[sources.material[k]]
        eta = rho / mat.rest_density
        by_mass = div < 0.0 or (mat.gas and eta > 1.0)
        sigma = (P - S_rr, P + S_rr + S_zz, -S_rz, -S_rz, P - S_zz)
        B = (sources.B_rr[k], sources.B_tt[k], sources.B_rz[k], sources.B_zz[k])
        s_rr, s_tt, s_rz, s_zr, s_zz = corrected(sigma, B)
        r = max(sources.r[k], TINY_RADIUS)
        ring = records[i]
        ring[0] = r
        ring[1] = sources.z[k]
        ring[2] = 0.5 * h
        ring[3] = -2.0 * sources.m[k] / (rho * np.sqrt(r))
        ring[4] = sources.u_r[k]
        ring[5] = sources.u_z[k]
        ring[6] = 0.5 * rho
        ring[7] = eta if by_mass else -eta
        ring[8] = 0.5 * scheme.alpha * c
        ring[9] = E
        ring[10] = 2.0 * diffusivity(scheme.g1, scheme.g2, h, c, div)
        ring[11] = s_rr
        ring[12] = 0.5 * (s_tt - s_rr)
        ring[13] = s_zz
        ring[14] = s_rz
        ring[15] = s_zr


@jitted(**EXACT)
def record_at(records, i):
    """Return record `i` as a `PairRecord`."""
    x = records[i]
    return PairRecord(
        x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7], x[8], x[9],
        x[10], x[11], x[12], x[13], x[14], x[15],
    )  # fmt: skip
