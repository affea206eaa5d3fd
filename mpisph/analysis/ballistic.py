"""Christiansen's equation: the sphere that a Whipple shield just stops.

Christiansen, E. L. (1993), "Design and performance equations for advanced meteoroid and
debris shields", Int. J. Impact Engng 14, 145-156: aluminium, at normal incidence. The
branch at high velocity is Cour-Palais' thickness of the wall, solved for the diameter:
``t_w = 0.16 d^(1/2) (rho_p rho_b)^(1/6) M^(1/3) V S^(-1/2) (70/sigma)^(1/2)``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.materials.alloys import KSI

__all__ = [
    "BALLISTIC_VELOCITY",
    "HYPERVELOCITY",
    "Whipple",
    "critical_diameter",
]

BALLISTIC_VELOCITY = 3.0e3
"""Up to here the projectile stays whole [m/s]."""

HYPERVELOCITY = 7.0e3
"""From here on it melts or shatters finely [m/s]; between the two the equation is a
straight line."""

_CM, _KM_PER_S, _G_PER_CM3 = 1e-2, 1e3, 1e3


class Whipple(NamedTuple):
    """A shield of a single bumper, and the density of what hits it.

    Attributes
    ----------
    bumper_thickness, standoff, wall_thickness : float
        [m].
    bumper_density, projectile_density : float
        [kg/m^3].
    wall_yield : float
        Stress of the wall at 0.2 % plastic strain [Pa].
    """

    bumper_thickness: float
    bumper_density: float
    standoff: float
    wall_thickness: float
    wall_yield: float
    projectile_density: float


def critical_diameter(
    shield: Whipple, velocity: npt.ArrayLike
) -> npt.NDArray[np.float64]:
    """Return the diameter of the largest sphere that the shield stops.

    Parameters
    ----------
    shield : Whipple
    velocity : array_like
        Positive impact velocities [m/s].

    Returns
    -------
    ndarray of float64, shape of `velocity`
        [m].
    """
    v = np.asarray(velocity, dtype=np.float64)
    slow = _whole(shield, np.minimum(v, BALLISTIC_VELOCITY))
    fast = _shattered(shield, np.maximum(v, HYPERVELOCITY))
    share = (v - BALLISTIC_VELOCITY) / (HYPERVELOCITY - BALLISTIC_VELOCITY)
    # Beyond its ends a branch is held at its last value, so one mean serves all three.
    share = np.clip(share, 0.0, 1.0)
    found: npt.NDArray[np.float64] = (1.0 - share) * slow + share * fast
    return found


def _whole(
    shield: Whipple, velocity: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return the critical diameter where the projectile stays whole [m]."""
    strength = np.sqrt(shield.wall_yield / (40.0 * KSI))
    layers = (shield.wall_thickness * strength + shield.bumper_thickness) / _CM
    rho = shield.projectile_density / _G_PER_CM3
    v = velocity / _KM_PER_S
    found: npt.NDArray[np.float64] = _CM * (
        layers / (0.6 * np.sqrt(rho) * v ** (2 / 3))
    ) ** (18 / 19)
    return found


def _shattered(
    shield: Whipple, velocity: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Return the critical diameter where the projectile shatters [m]."""
    wall, standoff = shield.wall_thickness / _CM, shield.standoff / _CM
    rho_p = shield.projectile_density / _G_PER_CM3
    rho_b = shield.bumper_density / _G_PER_CM3
    v = velocity / _KM_PER_S
    matter = rho_p ** (-1 / 3) * rho_b ** (-1 / 9)
    strength = (shield.wall_yield / (70.0 * KSI)) ** (1 / 3)
    found: npt.NDArray[np.float64] = (
        _CM
        * 3.918
        * wall ** (2 / 3)
        * standoff ** (1 / 3)
        * strength
        * matter
        * v ** (-2 / 3)
    )
    return found
