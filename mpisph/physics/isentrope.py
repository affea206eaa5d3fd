"""The isentrope through the reference state (R13): the cold curve of temperatures.

It is integrated once for each material, for any equation of state, and then read
between its nodes. In expansion it is left at its start: what sound matter stores in
tension is worth a few kelvins, and in failed matter solid pieces stand at P = 0.
"""

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted
from mpisph.physics.eos import pressure

NODES = 65
"""Between them cubics match values and slopes, to 1e-6 of the temperature's rise."""

LARGEST_COMPRESSION = 0.6
"""Of ``1 - rho0/rho``; the last slope continues beyond."""

_SUBSTEPS = 8

# Not T: of a record without compiling, that is its transpose.
_COLUMNS = ("energy", "energy_slope", "temperature", "temperature_slope")
ISENTROPE = np.dtype((np.record, [(n, np.float64, (NODES,)) for n in _COLUMNS]))
"""Energy [J/kg] and temperature over ``x = 1 - rho0/rho``, and their slopes."""


@jitted(**EXACT)
def _slopes(x, E, T, mat):
    """Return dE/dx, dT/dx at constant entropy: ``P/rho0`` and ``T Gamma rho/rho0``."""
    eta = 1.0 / (1.0 - x)
    P, _, dP_dE = pressure(eta * mat.rho0, E, mat)
    return P / mat.rho0, T * dP_dE / mat.rho0


@jitted(**EXACT)
def fill_isentrope(mat, T0):
    """Integrate the isentrope of a material from its reference state [K] on (R13).

    Parameters
    ----------
    mat : record
        Row of the table of constants, whose ``isentrope`` is set.
    T0 : float
        Temperature of the reference state [K].
    """
    curve = mat.isentrope
    E, T = 0.0, T0
    dx = LARGEST_COMPRESSION / (NODES - 1) / _SUBSTEPS
    for node in range(NODES):
        x = node * dx * _SUBSTEPS
        curve.energy[node], curve.temperature[node] = E, T
        slopes = _slopes(x, E, T, mat)
        curve.energy_slope[node], curve.temperature_slope[node] = slopes
        for _ in range(_SUBSTEPS):  # fourth order, Runge-Kutta
            a, A = _slopes(x, E, T, mat)
            b, B = _slopes(x + 0.5 * dx, E + 0.5 * dx * a, T + 0.5 * dx * A, mat)
            c, C = _slopes(x + 0.5 * dx, E + 0.5 * dx * b, T + 0.5 * dx * B, mat)
            d, D = _slopes(x + dx, E + dx * c, T + dx * C, mat)
            E += dx * (a + 2.0 * b + 2.0 * c + d) / 6.0
            T += dx * (A + 2.0 * B + 2.0 * C + D) / 6.0
            x += dx


@jitted(**EXACT)
def on_isentrope(eta, curve):
    """Return energy [J/kg] and temperature [K] of the isentrope at rho/rho0 (R13)."""
    E, dE = curve.energy, curve.energy_slope
    T, dT = curve.temperature, curve.temperature_slope
    if eta <= 1.0:
        return E[0], T[0]
    width = LARGEST_COMPRESSION / (NODES - 1)
    x = (1.0 - 1.0 / eta) / width
    last = NODES - 1
    if x >= last:
        beyond = (x - last) * width
        return E[last] + beyond * dE[last], T[last] + beyond * dT[last]
    i = int(x)
    s = x - i
    a, b = (1.0 + 2.0 * s) * (1.0 - s) ** 2, s * s * (3.0 - 2.0 * s)
    c, d = width * s * (1.0 - s) ** 2, width * s * s * (s - 1.0)
    j = i + 1
    return (
        a * E[i] + b * E[j] + c * dE[i] + d * dE[j],
        a * T[i] + b * T[j] + c * dT[i] + d * dT[j],
    )
