"""Material response of particles: pressure, sound speed and yield."""

import numpy as np
import numpy.typing as npt
from numba import njit

from mpisph.core.jit import EXACT
from mpisph.core.particles import Particles
from mpisph.physics.eos import (
    KINDS,
    MaterialConstants,
    bulk_sound_speed,
    minimum_pressure,
    pressure,
    sound_speed,
)
from mpisph.physics.scheme import SchemeConstants
from mpisph.physics.strength import yield_factor

MaterialTable = npt.NDArray[np.void]
"""Structured array of `MaterialConstants`, one row a material."""

TABLE_TYPE = np.dtype(
    [
        (name, np.int64 if kind is int else np.float64)
        for name, kind in MaterialConstants.__annotations__.items()
    ]
)


def material_table(rows: list[MaterialConstants]) -> MaterialTable:
    """Return the constants as the structured array that jitted functions index.

    Raises
    ------
    ValueError
        If a row's equation of state is unknown.
    """
    for row in rows:
        if row.eos not in KINDS.values():
            raise ValueError(f"unknown equation of state number {row.eos}")
    return np.array([tuple(row) for row in rows], dtype=TABLE_TYPE)


@njit(**EXACT)
def pressure_and_sound_speed(rho, E, mat, scheme):
    """Return P with its tensile limit (R8, R9) [Pa] and c (R8) [m/s]."""
    P, dP_drho, dP_dE = pressure(rho, E, mat)
    floor = scheme.sound_speed_floor * bulk_sound_speed(mat)
    c = sound_speed(rho, P, dP_drho, dP_dE, floor)
    return minimum_pressure(P, scheme.P_min, scheme.P_min_mode), c


@njit(**EXACT)
def limit_stress(S, material, table, plastic):
    """Bring the stress back to the yield surface, in place (R7).

    Parameters
    ----------
    S : ndarray, shape (3, n)
        S_rr, S_zz, S_rz [Pa]; scaled where they lie outside.
    material : ndarray of int64, shape (n,)
    table : structured ndarray
    plastic : ndarray, shape (n,)
        Written: 1 where the particle yields, else 0.
    """
    for i in range(material.size):
        factor = yield_factor(S[0, i], S[1, i], S[2, i], table[material[i]].Y)
        plastic[i] = 1.0 if factor < 1.0 else 0.0
        for k in range(3):
            S[k, i] *= factor


@njit(**EXACT)
def _pressures(rho, E, material, table, scheme, P, c):
    for i in range(rho.size):
        P[i], c[i] = pressure_and_sound_speed(rho[i], E[i], table[material[i]], scheme)


def respond(p: Particles, table: MaterialTable, scheme: SchemeConstants) -> None:
    """Apply the yield limit (R7) and set P and c (R8, R9) of owned particles.

    Parameters
    ----------
    p : Particles
        S_rr, S_zz, S_rz, plastic, P and c are written.
    table : structured ndarray
    scheme : SchemeConstants
    """
    limit_stress(p.stress, p.material, table, p.plastic)
    _pressures(p.rho, p.E, p.material, table, scheme, p.P, p.c)
