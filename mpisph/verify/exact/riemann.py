"""The Riemann problem of the ideal gas.

References
----------
E. F. Toro, Riemann Solvers and Numerical Methods for Fluid Dynamics, 3rd ed., Springer
(2009), chapter 4: equations (4.5) to (4.7) for the middle state, (4.53) to (4.63) for
the waves.
"""

import math
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

FloatArray = npt.NDArray[np.float64]


class GasState(NamedTuple):
    """Density, velocity and pressure of a point or of many, in any consistent units."""

    rho: Any
    u: Any
    P: Any


class Riemann(NamedTuple):
    """The solution to two states that meet at x = 0 and t = 0.

    Attributes
    ----------
    left, right : GasState
    gamma : float
        Ratio of specific heats.
    P, u : float
        Pressure and velocity between the two waves.
    """

    left: GasState
    right: GasState
    gamma: float
    P: float
    u: float

    @property
    def shock_speed(self) -> float:
        """Speed of the right wave's front, a shock where P is above the right one."""
        rho, u, P = self.right
        c = math.sqrt(self.gamma * P / rho)
        if self.P <= P:
            return float(u + c)
        g = self.gamma
        return float(
            u + c * math.sqrt((g + 1) / (2 * g) * self.P / P + (g - 1) / (2 * g))
        )

    def at(self, speed: npt.ArrayLike) -> GasState:
        """Return the state at x/t, of any shape."""
        s = np.asarray(speed, dtype=np.float64)
        to_left = GasState(*_side(self, self.left, s, -1.0))
        to_right = GasState(*_side(self, self.right, s, 1.0))
        pairs = zip(to_left, to_right, strict=True)
        return GasState(*(np.where(s < self.u, a, b) for a, b in pairs))


def solve_riemann(left: GasState, right: GasState, gamma: float) -> Riemann:
    """Return the solution to two states that meet.

    Parameters
    ----------
    left, right : GasState
        Of positive density and pressure.
    gamma : float
        Ratio of specific heats.

    Raises
    ------
    ValueError
        If a vacuum opens between the states.
    """

    def closing(P: float) -> float:
        return float(_jump(P, left, gamma) + _jump(P, right, gamma) + right.u - left.u)

    if closing(0.0) >= 0.0:
        raise ValueError("a vacuum opens between the states")
    high = max(left.P, right.P)
    while closing(high) < 0.0:
        high *= 2.0
    P = float(brentq(closing, 0.0, high, xtol=1e-14 * high, rtol=1e-14))
    jumps = _jump(P, right, gamma) - _jump(P, left, gamma)
    return Riemann(left, right, gamma, P, 0.5 * (left.u + right.u + jumps))


def _jump(P: float, side: GasState, gamma: float) -> float:
    """Return by how much a wave to pressure P changes the velocity."""
    if P > side.P:  # a shock
        a = 2.0 / ((gamma + 1.0) * side.rho)
        b = (gamma - 1.0) / (gamma + 1.0) * side.P
        return float((P - side.P) * math.sqrt(a / (P + b)))
    c = math.sqrt(gamma * side.P / side.rho)
    power = (gamma - 1.0) / (2.0 * gamma)
    return float(2.0 * c / (gamma - 1.0) * ((P / side.P) ** power - 1.0))


def _front_speed(side: GasState, ratio: float, gamma: float) -> float:
    """Return the speed of a shock into a state whose pressure rises by `ratio`."""
    c = math.sqrt(gamma * side.P / side.rho)
    return c * math.sqrt(1.0 + (gamma + 1.0) / (2.0 * gamma) * (ratio - 1.0))


def _side(
    solution: Riemann, side: GasState, s: FloatArray, sign: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the state on one side of the contact; `sign` is -1 on the left."""
    g, P, u = solution.gamma, solution.P, solution.u
    c = math.sqrt(g * side.P / side.rho)
    ratio, q = P / side.P, (g - 1.0) / (g + 1.0)
    # As seen from a wave that runs to the right.
    x = sign * (s - side.u)
    if P > side.P:
        rho = side.rho * (ratio + q) / (q * ratio + 1.0)
        behind = x < _front_speed(side, ratio, g)
        return (
            np.where(behind, rho, side.rho),
            np.where(behind, u, side.u),
            np.where(behind, P, side.P),
        )
    rho = side.rho * ratio ** (1.0 / g)
    tail = sign * (u - side.u) + c * ratio ** ((g - 1.0) / (2.0 * g))
    inner, fan = x < tail, (x >= tail) & (x < c)
    base = np.where(fan, 2.0 / (g + 1.0) + q * x / c, 1.0)
    motion = 2.0 / (g + 1.0) * (x - c)
    return (
        np.where(inner, rho, side.rho * base ** (2.0 / (g - 1.0))),
        np.where(inner, u, side.u + np.where(fan, sign * motion, 0.0)),
        np.where(inner, P, side.P * base ** (2.0 * g / (g - 1.0))),
    )
