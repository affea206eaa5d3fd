"""Second-order stepping with one evaluation of rates a step (R11).

Kick by half a step, drift, predict to the full step; the rates are evaluated there;
kick by the other half. To compare with, a kick by the whole step before the drift gives
first order (the semi-implicit Euler method). All passes are elementwise, so they have
the same bits however the particles are spread over ranks.
"""

import math

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.core.particles import FloatArray, Particles


@jitted(**EXACT)
def _advance(values, rates, tau, out):
    for k in range(values.shape[0]):
        for i in range(values.shape[1]):
            out[k, i] = values[k, i] + tau * rates[k, i]


@jitted(**EXACT)
def _drift(r, z, u_r, u_z, S_rz, du_r, du_z, dS_rz, B_rz, dB_rz, tau, low, high):
    for i in range(r.size):
        r[i] += tau * u_r[i]
        z[i] += tau * u_z[i]
        if r[i] < 0.0:
            r[i] = -r[i]
            u_r[i] = -u_r[i]
            S_rz[i] = -S_rz[i]
            du_r[i] = -du_r[i]
            dS_rz[i] = -dS_rz[i]
            B_rz[i] = -B_rz[i]
            dB_rz[i] = -dB_rz[i]
        if z[i] < low or z[i] > high:
            z[i] = 2.0 * (low if z[i] < low else high) - z[i]
            u_z[i] = -u_z[i]
            S_rz[i] = -S_rz[i]
            du_z[i] = -du_z[i]
            dS_rz[i] = -dS_rz[i]
            B_rz[i] = -B_rz[i]
            dB_rz[i] = -dB_rz[i]


@jitted(**EXACT)
def _close_energy(E, u_r, u_z, du_r, du_z, w_r, w_z, tau):
    for i in range(E.size):
        work_r = du_r[i] * (u_r[i] - w_r[i] + 0.5 * tau * du_r[i])
        work_z = du_z[i] * (u_z[i] - w_z[i] + 0.5 * tau * du_z[i])
        E[i] -= tau * (work_r + work_z)


def kick(p: Particles, tau: float) -> None:
    """Advance every field that has a rate by `tau` [s], in place (R11).

    The rates conserve energy at the velocities w that they were evaluated for, while
    the forces act at the mean velocity of the kick. What a particle's kinetic energy
    gains by the difference, its internal energy gives.
    """
    _close_energy(p.E, p.u_r, p.u_z, p.du_r, p.du_z, p.w_r, p.w_z, tau)
    _advance(p.integrated, p.rates, tau, p.integrated)


def drift(
    p: Particles, tau: float, low: float = -math.inf, high: float = math.inf
) -> None:
    """Advance positions by `tau` [s]; reflect at the axis and at planes (R11).

    A particle that crosses the axis keeps its place in the half plane r >= 0: r, u_r,
    S_rz and B_rz change sign, and with them their rates. So do z about the plane, u_z,
    S_rz and B_rz of one that crosses ``z = low`` or ``z = high``.
    """
    _drift(
        p.r, p.z, p.u_r, p.u_z, p.S_rz, p.du_r, p.du_z, p.dS_rz, p.B_rz, p.dB_rz,
        tau, low, high,
    )  # fmt: skip


def predict(p: Particles, tau: float, out: FloatArray) -> None:
    """Write the integrated fields a further `tau` [s] ahead, shape (8, n) (R11)."""
    _advance(p.integrated, p.rates, tau, out)
