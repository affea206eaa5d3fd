"""The Mie-Grueneisen equation of state on the Hugoniot of U_s = c0 + slope u_p (R8)."""

from typing import Annotated

from numba import njit
from pydantic import Field

from mpisph.core.jit import ENTRY, EXACT
from mpisph.inputs.quantities import Quantity, SoundSpeed
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class MieGrueneisen(Sourced):
    """Constants of the Mie-Grueneisen equation of state (R8)."""

    c0: SoundSpeed
    """Bulk sound speed, the intercept of the shock velocity line."""
    slope: Annotated[float, Field(gt=0, le=20), Quantity("")]
    """Slope of shock velocity against particle velocity."""
    gamma0: Annotated[float, Field(ge=0, le=20), Quantity("")]
    """Grueneisen parameter at the reference density."""

    def bulk_sound_speed(self, rho0: float) -> float:
        """Return the sound speed at rest [m/s]."""
        return self.c0


POLE_SHARE = 0.8
"""Share of the way to the pole of the Hugoniot, at m = 1/(slope - 1), from which on its
tangent continues it."""


@njit(**EXACT)
def hugoniot_pressure(m, rho0, constants):
    """Return P_H and dP_H/dm of U_s = c0 + slope u_p; linear in tension (R8)."""
    a = rho0 * constants.c0 * constants.c0
    if m < 0.0:
        return a * m, a
    s = constants.slope - 1.0
    x = min(m, POLE_SHARE / s) if s > 0.0 else m
    inv = 1.0 / (1.0 - s * x)
    P = a * x * (1.0 + x) * inv * inv
    dP = a * (1.0 + x * (2.0 + s)) * inv * inv * inv
    return P + dP * (m - x), dP


@njit(**EXACT)
def mie_grueneisen(rho, E, rho0, constants):
    """Return P, dP/drho, dP/dE of the Mie-Grueneisen equation (R8)."""
    m = rho / rho0 - 1.0
    gamma = constants.gamma0
    P_H, dP_H = hugoniot_pressure(m, rho0, constants)
    if m < 0.0:  # no shock leads there: P_H is a cold curve, Gamma constant
        return P_H + gamma * rho * E, dP_H / rho0 + gamma * E, gamma * rho
    # Gamma rho is constant.
    v = 1.0 / (1.0 + m)
    share = 1.0 - 0.5 * gamma * m * v
    P = share * P_H + gamma * rho0 * E
    dP_drho = (share * dP_H - 0.5 * gamma * v * v * P_H) / rho0
    return P, dP_drho, gamma * rho0


@njit(**ENTRY)
def _pressure(rho, E, mat):
    return mie_grueneisen(rho, E, mat.rho0, mat.mie_grueneisen)


MODEL = Model("mie-grueneisen", "Mie-Grüneisen", MieGrueneisen, {"pressure": _pressure})
