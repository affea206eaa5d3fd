"""Verney's shell: a thick sphere of incompressible, perfectly plastic matter implodes.

The volume within every sphere is kept, so the velocity is ``u_i (r_i/s)**2`` at the
radius s. The equivalent strain rate is ``2 u/s``, and the kinetic energy is used up by
plastic work:

    K = 2 pi rho u_i**2 r_i**4 (1/r_i - 1/r_o),
    -dK/dt = integral of Y (2 |u|/s) 4 pi s**2 ds = 8 pi Y |u_i| r_i**2 ln(r_o/r_i)

where ``(r_o/r_i)**3 = 1 + W (R_i/r_i)**3`` with ``W = 3 a + 3 a**2 + a**3`` for a shell
that starts with the inner radius R_i and the thickness ``a R_i``.

References
----------
Verney (1968), in Behaviour of Dense Media under High Dynamic Pressures, 293-303.
Howell and Ball (2002), J. Comp. Phys. 175, 128-167.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import quad


class Shell(NamedTuple):
    """A shell before its implosion.

    Attributes
    ----------
    inner, outer : float
        Radii [m].
    density : float
        [kg/m3].
    yield_strength : float
        [Pa].
    """

    inner: float
    outer: float
    density: float
    yield_strength: float


def outer_radius(shell: Shell, inner: float) -> float:
    """Return the outer radius that belongs to an inner one [m]."""
    return math.cbrt(inner**3 + shell.outer**3 - shell.inner**3)


def plastic_work(shell: Shell, inner: float) -> float:
    """Return the work done when the inner radius has fallen to a value [J]."""

    def rate(r: float) -> float:
        return r * r * math.log(outer_radius(shell, r) / r)

    integral = float(quad(rate, inner, shell.inner)[0])
    return 8.0 * math.pi * shell.yield_strength * integral


def _inertia(shell: Shell, inner: float) -> float:
    """Return twice the kinetic energy over the square of the inner velocity [kg]."""
    outer = outer_radius(shell, inner)
    return 4.0 * math.pi * shell.density * inner**4 * (1.0 / inner - 1.0 / outer)


def starting_velocity(shell: Shell, stop: float) -> float:
    """Return the inward velocity of the inner surface that stops at a radius [m/s]."""
    return math.sqrt(2.0 * plastic_work(shell, stop) / _inertia(shell, shell.inner))


def stopping_time(shell: Shell, stop: float) -> float:
    """Return the time at which the inner surface stands still [s]."""

    # With r = stop + (inner - stop) x**2 the integrand is finite where the shell stops.
    def rate(x: float) -> float:
        r = stop + (shell.inner - stop) * x * x
        left = plastic_work(shell, stop) - plastic_work(shell, r)
        velocity = math.sqrt(2.0 * left / _inertia(shell, r))
        return 2.0 * (shell.inner - stop) * x / velocity

    return float(quad(rate, 1e-6, 1.0)[0])


def surface_of(
    before: npt.NDArray[np.float64], now: npt.NDArray[np.float64], surface: float
) -> npt.NDArray[np.float64]:
    """Return where a surface is, from matter beside it, if the volume between is kept.

    Parameters
    ----------
    before, now : ndarray, shape (n,)
        Radii of the matter at the start and later [m].
    surface : float
        Radius of the surface at the start [m].
    """
    return np.cbrt(surface**3 + now**3 - before**3)
