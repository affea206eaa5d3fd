"""The Mie-Grueneisen equation of state on the Hugoniot of a shocked solid (R8).

``U_s = c0 + s u_p + s2 (u_p/U_s) u_p + s3 (u_p/U_s)^2 u_p``, and
``Gamma = (gamma0 + b m)/(1 + m)`` with ``m = rho/rho0 - 1``.

References
----------
Steinberg (1996), UCRL-MA-106439: the form, and constants of many materials.
"""

import math
from typing import Annotated, ClassVar

import numpy as np
from numpy.polynomial import Polynomial
from pydantic import Field

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import Quantity, SoundSpeed
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model

POLE_SHARE = 0.8
"""Share of the way in m to where the pressure without energy has its pole, or stops
rising, from which on its tangent continues."""

_LARGEST_STRAIN = 0.999
# Of 1 - rho0/rho; there is a root at 1 itself, known to its rounding only.

_Coefficient = Annotated[float, Field(ge=-20, le=20), Quantity("")]


class MieGrueneisen(Sourced):
    """Constants of the Mie-Grueneisen equation of state (R8)."""

    c0: SoundSpeed
    """Bulk sound speed, the intercept of the shock velocity line."""
    slope: Annotated[float, Field(gt=0, le=20), Quantity("")]
    """Slope of shock velocity against particle velocity, s."""
    slope2: _Coefficient = 0.0
    """Quadratic coefficient s2."""
    slope3: _Coefficient = 0.0
    """Cubic coefficient s3."""
    gamma0: Annotated[float, Field(ge=0, le=20), Quantity("")]
    """Grueneisen parameter at the reference density."""
    gamma_slope: Annotated[float, Field(ge=0, le=20), Quantity("")] = 0.0
    """First-order volume correction b of the Grueneisen parameter."""

    DERIVED: ClassVar[tuple[str, ...]] = ("last_compression",)

    def bulk_sound_speed(self, rho0: float) -> float:
        """Return the sound speed at rest [m/s]."""
        return self.c0

    @property
    def last_compression(self) -> float:
        """The m from which on the pressure without energy goes on along its tangent."""
        x = Polynomial([0.0, 1.0])  # 1 - rho0/rho
        D = Polynomial([1.0, -self.slope, -self.slope2, -self.slope3])
        # P = rho0 c0^2 n/((1 - x) D^2), and the numerator of its slope:
        n = x * (1 - x) - 0.5 * x**2 * (self.gamma0 * (1 - x) + self.gamma_slope * x)
        rise = (1 - x) * (n.deriv() * D - 2 * n * D.deriv()) + n * D
        roots = np.concatenate([D.roots(), rise.roots()])
        real = roots.real[np.abs(roots.imag) < 1e-9]
        ends = [float(x) for x in real if 0.0 < x < _LARGEST_STRAIN]
        return POLE_SHARE * min(ends) / (1.0 - min(ends)) if ends else math.inf


@jitted(**EXACT)
def hugoniot_pressure(m, rho0, constants):
    """Return P_H and dP_H/dm of the Hugoniot; linear in tension (R8)."""
    a = rho0 * constants.c0 * constants.c0
    if m < 0.0:
        return a * m, a
    v = 1.0 / (1.0 + m)
    x = m * v
    D = 1.0 - x * (constants.slope + x * (constants.slope2 + x * constants.slope3))
    rise = constants.slope + x * (2.0 * constants.slope2 + 3.0 * x * constants.slope3)
    return a * x / (D * D), a * v * v * (D + 2.0 * x * rise) / (D * D * D)


@jitted(**EXACT)
def mie_grueneisen(rho, E, rho0, constants):
    """Return P, dP/drho, dP/dE of the Mie-Grueneisen equation (R8)."""
    m = rho / rho0 - 1.0
    gamma, b = constants.gamma0, constants.gamma_slope
    end = min(m, constants.last_compression)
    P_H, dP_H = hugoniot_pressure(end, rho0, constants)
    if m < 0.0:  # no shock leads there: P_H is a cold curve, Gamma constant
        return P_H + gamma * rho * E, dP_H / rho0 + gamma * E, gamma * rho
    gamma += b * end  # Gamma rho/rho0
    v = 1.0 / (1.0 + end)
    share = 1.0 - 0.5 * gamma * end * v
    slope = share * dP_H - 0.5 * v * (b * end + gamma * v) * P_H
    P = share * P_H + slope * (m - end) + gamma * rho0 * E
    dP_drho = slope / rho0
    if m == end:
        dP_drho += b * E
    return P, dP_drho, gamma * rho0


@jitted(**ENTRY)
def _pressure(rho, E, mat):
    return mie_grueneisen(rho, E, mat.rho0, mat.mie_grueneisen)


MODEL = Model("mie-grueneisen", "Mie-Grüneisen", MieGrueneisen, {"pressure": _pressure})
