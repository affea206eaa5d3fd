"""Linear elasticity: vibrations and rotation in closed form.

References
----------
Love (1927), A Treatise on the Mathematical Theory of Elasticity, 4th ed.
Timoshenko and Goodier (1970), Theory of Elasticity, 3rd ed.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

FloatArray = npt.NDArray[np.float64]


class Elastic(NamedTuple):
    """An isotropic elastic solid.

    Attributes
    ----------
    density : float
        [kg/m3].
    bulk_modulus, shear_modulus : float
        [Pa].
    """

    density: float
    bulk_modulus: float
    shear_modulus: float

    @property
    def young(self) -> float:
        """Young's modulus [Pa]."""
        K, G = self.bulk_modulus, self.shear_modulus
        return 9.0 * K * G / (3.0 * K + G)

    @property
    def poisson(self) -> float:
        """Poisson's ratio."""
        K, G = self.bulk_modulus, self.shear_modulus
        return (3.0 * K - 2.0 * G) / (6.0 * K + 2.0 * G)

    @property
    def longitudinal_modulus(self) -> float:
        """Stress over strain where there is no lateral strain [Pa]."""
        return self.bulk_modulus + 4.0 / 3.0 * self.shear_modulus

    @property
    def longitudinal_speed(self) -> float:
        """Speed of plane longitudinal waves [m/s]."""
        return math.sqrt(self.longitudinal_modulus / self.density)

    @property
    def bar_speed(self) -> float:
        """Speed of long waves along a thin bar [m/s]."""
        return math.sqrt(self.young / self.density)


def sphere_wavenumber(solid: Elastic, radius: float) -> float:
    """Return the wavenumber of the lowest radial mode of a free sphere [1/m].

    The displacement is ``j1(k s)``. No radial stress at the surface means
    ``tan x / x = 1/(1 - x**2 M/(4 G))`` with ``x = k a`` and the longitudinal modulus
    M (Love, section 196). The angular frequency is k times the longitudinal speed.
    """
    ratio = solid.longitudinal_modulus / (4.0 * solid.shear_modulus)

    def excess(x: float) -> float:
        return (1.0 - ratio * x * x) * math.sin(x) - x * math.cos(x)

    # Below the first root of j1', x = 2.08, the surface is under the sign of the
    # dilatation; below the first root of j1, 4.49, the sphere breathes as one.
    return float(brentq(excess, 1.0, 4.4)) / radius


def sphere_displacement(x: FloatArray) -> FloatArray:
    """Return j1(x), the radial displacement of a breathing sphere at ``x = k s``."""
    x = np.asarray(x, dtype=np.float64)
    safe = np.where(x > 1e-3, x, 1.0)
    series = x / 3.0 - x**3 / 30.0
    return np.where(x > 1e-3, np.sin(safe) / safe**2 - np.cos(safe) / safe, series)


def bar_frequency(solid: Elastic, radius: float, length: float) -> float:
    """Return the lowest longitudinal angular frequency of a free round bar [rad/s].

    With Rayleigh's lateral inertia in the form of Love, ``w = c k/sqrt(1 + (nu k
    a)**2/2)``, ``k = pi/L`` (Love, section 278). It is good to (k a)**4.
    """
    k = math.pi / length
    lateral = 0.5 * (solid.poisson * k * radius) ** 2
    return solid.bar_speed * k / math.sqrt(1.0 + lateral)


def ring_frequency(solid: Elastic, radius: float) -> float:
    """Return the angular frequency at which a thin free ring breathes [rad/s].

    ``sqrt(E/rho)/R`` (Love, section 293a), good to the square of the section's radius
    over the ring's.
    """
    return solid.bar_speed / radius


def bar_stress(
    solid: Elastic, rate: float, length: float, z: FloatArray, time: float
) -> FloatArray:
    """Return the axial stress of a free bar that starts to stretch evenly [Pa].

    The bar is without stress at the start, its velocity is ``rate z`` and its ends at
    z = +-length/2 are free. By d'Alembert, with the velocity continued evenly about
    the ends, to a triangular wave f of period ``2 length`` (Timoshenko and Goodier,
    section 160): ``stress = rho c (f(z + c t) - f(z - c t))/2``. Lateral inertia is
    left out.
    """
    c = solid.bar_speed

    def wave(x: FloatArray) -> FloatArray:
        # z within the bar, and reflected about each end.
        y = np.mod(x + 0.5 * length, 2.0 * length)
        return rate * (np.minimum(y, 2.0 * length - y) - 0.5 * length)

    z = np.asarray(z, dtype=np.float64)
    return 0.5 * solid.density * c * (wave(z + c * time) - wave(z - c * time))


class SpunStress(NamedTuple):
    """Stresses of a rotating cylinder, positive in tension [Pa]."""

    radial: FloatArray
    hoop: FloatArray
    axial: FloatArray


def spun_cylinder(
    solid: Elastic, radius: float, rate: float, s: FloatArray
) -> SpunStress:
    """Return the stresses of a solid cylinder in steady rotation, in plane strain.

    Parameters
    ----------
    solid : Elastic
    radius : float
        [m].
    rate : float
        Angular velocity [rad/s].
    s : ndarray
        Distances from the axis of rotation [m].

    References
    ----------
    Timoshenko and Goodier (1970), section 32, with ``nu -> nu/(1 - nu)``.
    """
    nu = solid.poisson
    load = solid.density * rate**2 / (8.0 * (1.0 - nu))
    radial = load * (3.0 - 2.0 * nu) * (radius**2 - s**2)
    hoop = load * ((3.0 - 2.0 * nu) * radius**2 - (1.0 + 2.0 * nu) * s**2)
    return SpunStress(radial, hoop, nu * (radial + hoop))


def spun_section(
    solid: Elastic, ring: float, rate: float, time: float
) -> tuple[float, float]:
    """Return angle [rad] and angular velocity [rad/s] of a ring's spinning section.

    A ring that turns about the centre line of its section brings matter to other
    radii: after the angle phi the mean of its squared hoop strain is ``(a/R)**2 (1 -
    cos phi)/2``. The section turns as a pendulum whose energy is Young's modulus times
    half of that, and whose moment of inertia is ``rho a**2/2`` for each volume:
    ``phi'' = -(E/(2 rho R**2)) sin phi``. It is good to a/R, and slows a section down
    and lets it go on again; only for R much larger than ``a sqrt(E)/(rate a
    sqrt(rho))`` is the rotation rigid.
    """
    pull = solid.young / (2.0 * solid.density * ring**2)
    found = solve_ivp(
        lambda _, y: (y[1], -pull * math.sin(y[0])),
        (0.0, time),
        (0.0, rate),
        method="DOP853",
        rtol=1e-12,
        atol=1e-12 * abs(rate),
    )
    return float(found.y[0, -1]), float(found.y[1, -1])
