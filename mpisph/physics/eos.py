"""Equations of state and minimum tensile pressure (R8, R9): equations only.

Each equation returns the pressure and its two derivatives; the sound speed follows
from them in one place. ``eta = rho/rho0``, ``m = eta - 1``.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (18), (19), sections 2.5 and 2.6.
Tillotson (1962), General Atomic report GA-3216.
"""

import math
from typing import NamedTuple

from numba import njit

from mpisph.core.jit import EXACT

LINEAR = 0
MIE_GRUENEISEN = 1
TILLOTSON = 2
KINDS = {"linear": LINEAR, "mie-grueneisen": MIE_GRUENEISEN, "tillotson": TILLOTSON}

OFF = 0
CLAMP = 1
ZERO = 2
P_MIN_MODES = {"off": OFF, "clamp": CLAMP, "zero": ZERO}


class MaterialConstants(NamedTuple):
    """Constants of one material as the jitted functions take them, SI units."""

    eos: int
    rho0: float
    c0: float
    slope: float
    gamma: float
    K: float
    mu: float
    Y: float
    a: float
    b: float
    A: float
    B: float
    E0: float
    Es: float
    Es_prime: float
    alpha: float
    beta: float


@njit(**EXACT)
def linear(rho, mat):
    """Return P, dP/drho, dP/dE of ``P = K m`` (R8)."""
    return mat.K * (rho / mat.rho0 - 1.0), mat.K / mat.rho0, 0.0


@njit(**EXACT)
def hugoniot_pressure(m, mat):
    """Return P_H and dP_H/dm of the cubic fit; linear in tension (R8)."""
    a = mat.rho0 * mat.c0 * mat.c0
    if m < 0.0:
        return a * m, a
    s = mat.slope - 1.0
    b = a * (1.0 + 2.0 * s)
    c = a * (2.0 * s + 3.0 * s * s)
    return m * (a + m * (b + m * c)), a + m * (2.0 * b + m * 3.0 * c)


@njit(**EXACT)
def mie_grueneisen(rho, E, mat):
    """Return P, dP/drho, dP/dE of the Mie-Grueneisen equation (R8)."""
    m = rho / mat.rho0 - 1.0
    P_H, dP_H = hugoniot_pressure(m, mat)
    share = 1.0 - 0.5 * mat.gamma * m
    P = share * P_H + mat.gamma * rho * E
    dP_drho = (share * dP_H - 0.5 * mat.gamma * P_H) / mat.rho0 + mat.gamma * E
    return P, dP_drho, mat.gamma * rho


@njit(**EXACT)
def tillotson_denominator(eta, E, mat):
    """Return E/(E0 eta^2) + 1, at least 1 (R8).

    Integration may leave a cold particle with a slightly negative energy, and the
    equation has a pole at ``E = -E0 eta^2``.
    """
    return max(E, 0.0) / (mat.E0 * eta * eta) + 1.0


@njit(**EXACT)
def tillotson_compressed(rho, E, mat):
    """Return P, dP/drho, dP/dE of Tillotson's compressed or cold branch (R8)."""
    eta = rho / mat.rho0
    m = eta - 1.0
    w = tillotson_denominator(eta, E, mat)
    share = mat.a + mat.b / w
    P = share * rho * E + m * (mat.A + mat.B * m)
    # dw/drho = -2 (w - 1)/rho and dw/dE = (w - 1)/E.
    dP_drho = (
        share * E
        + 2.0 * mat.b * E * (w - 1.0) / (w * w)
        + (mat.A + 2.0 * mat.B * m) / mat.rho0
    )
    dP_dE = rho * (mat.a + mat.b / (w * w))
    return P, dP_drho, dP_dE


@njit(**EXACT)
def tillotson_expanded(rho, E, mat):
    """Return P, dP/drho, dP/dE of Tillotson's expanded hot branch (R8)."""
    eta = rho / mat.rho0
    m = eta - 1.0
    w = tillotson_denominator(eta, E, mat)
    x = 1.0 / eta - 1.0
    fade = math.exp(-mat.alpha * x * x)
    cold = mat.A * m * math.exp(-mat.beta * x)
    hot = mat.b * rho * E / w
    P = mat.a * rho * E + (hot + cold) * fade
    dx = -1.0 / (eta * rho)
    dhot = mat.b * E * (1.0 + 2.0 * (w - 1.0) / w) / w
    dcold = mat.A * math.exp(-mat.beta * x) * (1.0 / mat.rho0 - m * mat.beta * dx)
    dfade = -2.0 * mat.alpha * x * dx
    dP_drho = mat.a * E + fade * (dhot + dcold + (hot + cold) * dfade)
    dP_dE = rho * (mat.a + fade * mat.b / (w * w))
    return P, dP_drho, dP_dE


@njit(**EXACT)
def tillotson(rho, E, mat):
    """Return P, dP/drho, dP/dE of the Tillotson equation, with its mix (R8)."""
    if rho >= mat.rho0 or E <= mat.Es:
        return tillotson_compressed(rho, E, mat)
    if E >= mat.Es_prime:
        return tillotson_expanded(rho, E, mat)
    P_c, dr_c, dE_c = tillotson_compressed(rho, E, mat)
    P_e, dr_e, dE_e = tillotson_expanded(rho, E, mat)
    width = mat.Es_prime - mat.Es
    f = (E - mat.Es) / width
    P = f * P_e + (1.0 - f) * P_c
    dP_dE = f * dE_e + (1.0 - f) * dE_c + (P_e - P_c) / width
    return P, f * dr_e + (1.0 - f) * dr_c, dP_dE


@njit(**EXACT)
def pressure(rho, E, mat):
    """Return P, dP/drho, dP/dE of the material's equation of state (R8)."""
    if mat.eos == MIE_GRUENEISEN:
        return mie_grueneisen(rho, E, mat)
    if mat.eos == TILLOTSON:
        return tillotson(rho, E, mat)
    return linear(rho, mat)


@njit(**EXACT)
def bulk_sound_speed(mat):
    """Return the reference sound speed of the material's equation (R8) [m/s]."""
    if mat.eos == MIE_GRUENEISEN:
        return mat.c0
    return math.sqrt((mat.A if mat.eos == TILLOTSON else mat.K) / mat.rho0)


@njit(**EXACT)
def sound_speed(rho, P, dP_drho, dP_dE, floor):
    """Return the sound speed (R8, eq 19) [m/s], at least `floor`."""
    c2 = dP_drho + P / (rho * rho) * dP_dE
    return math.sqrt(max(c2, floor * floor))


@njit(**EXACT)
def minimum_pressure(P, P_min, mode):
    """Return P with the tensile limit applied (R9) [Pa]."""
    if mode == OFF or P >= P_min:
        return P
    return P_min if mode == CLAMP else 0.0
