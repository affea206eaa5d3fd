"""Sedov's point explosion in a cold gas of uniform density.

References
----------
J. R. Kamm, F. X. Timmes, On efficient generation of numerically robust Sedov solutions,
LA-UR-07-2849 (2007): equations (28) to (42), the standard case in three dimensions with
omega = 0.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import trapezoid

from mpisph.verify.exact.riemann import GasState

_POINTS = 40001
# Values of the similarity variable that the solution is tabulated at.


class Sedov(NamedTuple):
    """The solution of a point explosion, over the distance from the point.

    Attributes
    ----------
    gamma : float
        Ratio of specific heats, below 2.
    share : ndarray
        Distance over that of the shock, from 0 to 1.
    rho, u, P : ndarray
        Over their values behind the shock.
    alpha : float
        ``energy / (rho0 radius**5 / time**2)``.
    """

    gamma: float
    share: npt.NDArray[np.float64]
    rho: npt.NDArray[np.float64]
    u: npt.NDArray[np.float64]
    P: npt.NDArray[np.float64]
    alpha: float

    @property
    def jump(self) -> float:
        """Density behind the shock over that ahead of it."""
        return (self.gamma + 1.0) / (self.gamma - 1.0)

    def energy(self, radius: float, time: float) -> float:
        """Return the energy whose shock is at a radius at a time; density 1."""
        return self.alpha * radius**5 / time**2

    def at(self, distance: npt.ArrayLike, radius: float, time: float) -> GasState:
        """Return the state at a distance when the shock is at `radius`, density 1."""
        g = self.gamma
        x = np.asarray(distance, dtype=np.float64) / radius
        speed = 0.4 * radius / time
        behind = (
            self.jump * np.interp(x, self.share, self.rho),
            2.0 / (g + 1.0) * speed * np.interp(x, self.share, self.u),
            2.0 / (g + 1.0) * speed**2 * np.interp(x, self.share, self.P),
        )
        ahead = (1.0, 0.0, 0.0)
        pairs = zip(behind, ahead, strict=True)
        return GasState(*(np.where(x < 1.0, a, b) for a, b in pairs))


def sedov(gamma: float) -> Sedov:
    """Return the solution in three dimensions.

    Parameters
    ----------
    gamma : float
        Ratio of specific heats, between 1 and 2.
    """
    g, j = gamma, 3.0
    low, high = 2.0 / ((j + 2.0) * g), 4.0 / ((j + 2.0) * (g + 1.0))
    # Where the variable is low the distance goes to zero with a small power.
    v = low + (high - low) * np.linspace(0.0, 1.0, _POINTS)[1:] ** 8
    a0 = 2.0 / (j + 2.0)
    a2 = -(g - 1.0) / (2.0 * (g - 1.0) + j)
    a1 = (j + 2.0) * g / (2.0 + j * (g - 1.0))
    a1 *= 2.0 * j * (2.0 - g) / (g * (j + 2.0) ** 2) - a2
    a3 = j / (2.0 * (g - 1.0) + j)
    a4 = a1 * (j + 2.0) / (2.0 - g)
    a5 = -2.0 / (2.0 - g)
    b = (g + 1.0) / (g - 1.0)
    e = 0.5 * (2.0 + j * (g - 1.0))
    wide = (j + 2.0) * (g + 1.0)
    x1 = 0.25 * wide * v
    x2 = b * (0.5 * (j + 2.0) * g * (v - low))
    x3 = wide / (wide - 4.0 * e) * (1.0 - e * v)
    x4 = b * (1.0 - 0.5 * (j + 2.0) * v)
    share = x1**-a0 * x2**-a2 * x3**-a1
    rho = x2**a3 * x3**a4 * x4**a5
    u = x1 * share
    P = x1 ** (a0 * j) * x3 ** (a4 - 2.0 * a1) * x4 ** (1.0 + a5)
    # To the middle, where the density vanishes and the pressure is finite.
    share, rho, u, P = (
        np.concatenate([[first], values])
        for first, values in ((0.0, share), (0.0, rho), (0.0, u), (P[0], P))
    )
    speed = 0.4
    kinetic = 0.5 * b * rho * (2.0 / (g + 1.0) * speed * u) ** 2
    internal = 2.0 / (g + 1.0) * speed**2 * P / (g - 1.0)
    alpha = 4.0 * np.pi * trapezoid((kinetic + internal) * share**2, share)
    return Sedov(g, share, rho, u, P, float(alpha))
