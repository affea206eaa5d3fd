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
from numba import njit
from pydantic import Field

from mpisph.core.jit import ENTRY, EXACT
from mpisph.inputs.quantities import Quantity, SoundSpeed
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model

POLE_SHARE = 0.8
"""Share of the way in m to the Hugoniot's pole from which on its tangent continues."""

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
        """The m from which on the Hugoniot is continued by its tangent."""
        roots = np.roots([-self.slope3, -self.slope2, -self.slope, 1.0])
        poles = [x.real for x in roots if abs(x.imag) < 1e-9 and 0.0 < x.real < 1.0]
        return POLE_SHARE * min(poles) / (1.0 - min(poles)) if poles else math.inf


@njit(**EXACT)
def hugoniot_pressure(m, rho0, constants):
    """Return P_H and dP_H/dm of the Hugoniot; linear in tension (R8)."""
    a = rho0 * constants.c0 * constants.c0
    if m < 0.0:
        return a * m, a
    end = min(m, constants.last_compression)
    v = 1.0 / (1.0 + end)
    x = end * v
    D = 1.0 - x * (constants.slope + x * (constants.slope2 + x * constants.slope3))
    rise = constants.slope + x * (2.0 * constants.slope2 + 3.0 * x * constants.slope3)
    P = a * x / (D * D)
    dP = a * v * v * (D + 2.0 * x * rise) / (D * D * D)
    return P + dP * (m - end), dP


@njit(**EXACT)
def mie_grueneisen(rho, E, rho0, constants):
    """Return P, dP/drho, dP/dE of the Mie-Grueneisen equation (R8)."""
    m = rho / rho0 - 1.0
    gamma = constants.gamma0
    P_H, dP_H = hugoniot_pressure(m, rho0, constants)
    if m < 0.0:  # no shock leads there: P_H is a cold curve, Gamma constant
        return P_H + gamma * rho * E, dP_H / rho0 + gamma * E, gamma * rho
    b = constants.gamma_slope
    gamma += b * m  # Gamma rho/rho0
    v = 1.0 / (1.0 + m)
    share = 1.0 - 0.5 * gamma * m * v
    P = share * P_H + gamma * rho0 * E
    fall = 0.5 * v * (b * m + gamma * v)
    dP_drho = (share * dP_H - fall * P_H) / rho0 + b * E
    return P, dP_drho, gamma * rho0


@njit(**ENTRY)
def _pressure(rho, E, mat):
    return mie_grueneisen(rho, E, mat.rho0, mat.mie_grueneisen)


MODEL = Model("mie-grueneisen", "Mie-Grüneisen", MieGrueneisen, {"pressure": _pressure})
