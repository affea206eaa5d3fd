"""The Tillotson equation of state (R8).

``eta = rho/rho0``, ``m = eta - 1``.

References
----------
Tillotson (1962), General Atomic report GA-3216.
Saito, Kaiho, Abe, Katayama, Takayama (2008), Int. J. Impact Eng. 35, 1770: no B in
expansion.
"""

import math

from pydantic import model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import (
    Positive,
    PositivePressure,
    Pressure,
    SpecificEnergy,
)
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class Tillotson(Sourced):
    """Constants of the Tillotson equation of state (R8)."""

    a: Positive
    """Coefficient a, the thermal coefficient at high energy."""
    b: Positive
    """Coefficient b, added to a at low energy."""
    A: PositivePressure
    """Linear coefficient of the cold compression curve."""
    B: Pressure
    """Quadratic coefficient of the cold compression curve; none in expansion."""
    E0: SpecificEnergy
    """Energy that sets the fall of the b term."""
    Es: SpecificEnergy
    """Energy of incipient vaporisation."""
    Es_prime: SpecificEnergy
    """Energy of complete vaporisation."""
    alpha: Positive
    """Exponent of the expanded, vaporised branch."""
    beta: Positive
    """Exponent of the cold pressure in the expanded, vaporised branch."""

    @model_validator(mode="after")
    def _check_energies(self) -> "Tillotson":
        """Require the two vaporisation energies in their order."""
        if self.Es_prime <= self.Es:
            raise ValueError(
                f"Es_prime must exceed Es = {self.Es:g} J/kg, got {self.Es_prime:g}"
            )
        return self

    def bulk_sound_speed(self, rho0: float) -> float:
        """Return the sound speed at rest [m/s]."""
        return math.sqrt(self.A / rho0)


@jitted(**EXACT)
def tillotson_denominator(eta, E, mat):
    """Return E/(E0 eta^2) + 1, at least 1 (R8).

    Integration may leave a cold particle with a slightly negative energy, and the
    equation has a pole at ``E = -E0 eta^2``.
    """
    return max(E, 0.0) / (mat.E0 * eta * eta) + 1.0


@jitted(**EXACT)
def tillotson_compressed(rho, E, rho0, mat):
    """Return P, dP/drho, dP/dE of Tillotson's compressed or cold branch (R8).

    The quadratic term counts in compression alone: with it cold matter would push
    itself apart from ``eta = 1 - A/B`` on, nylon at 0.7.
    """
    eta = rho / rho0
    m = eta - 1.0
    B = mat.B if m > 0.0 else 0.0
    w = tillotson_denominator(eta, E, mat)
    share = mat.a + mat.b / w
    P = share * rho * E + m * (mat.A + B * m)
    # dw/drho = -2 (w - 1)/rho and dw/dE = (w - 1)/E.
    dP_drho = (
        share * E + 2.0 * mat.b * E * (w - 1.0) / (w * w) + (mat.A + 2.0 * B * m) / rho0
    )
    dP_dE = rho * (mat.a + mat.b / (w * w))
    return P, dP_drho, dP_dE


@jitted(**EXACT)
def tillotson_expanded(rho, E, rho0, mat):
    """Return P, dP/drho, dP/dE of Tillotson's expanded hot branch (R8)."""
    eta = rho / rho0
    m = eta - 1.0
    w = tillotson_denominator(eta, E, mat)
    x = 1.0 / eta - 1.0
    fade = math.exp(-mat.alpha * x * x)
    cold = mat.A * m * math.exp(-mat.beta * x)
    hot = mat.b * rho * E / w
    P = mat.a * rho * E + (hot + cold) * fade
    dx = -1.0 / (eta * rho)
    dhot = mat.b * E * (1.0 + 2.0 * (w - 1.0) / w) / w
    dcold = mat.A * math.exp(-mat.beta * x) * (1.0 / rho0 - m * mat.beta * dx)
    dfade = -2.0 * mat.alpha * x * dx
    dP_drho = mat.a * E + fade * (dhot + dcold + (hot + cold) * dfade)
    dP_dE = rho * (mat.a + fade * mat.b / (w * w))
    return P, dP_drho, dP_dE


@jitted(**EXACT)
def tillotson(rho, E, rho0, mat):
    """Return P, dP/drho, dP/dE of the Tillotson equation, with its mix (R8)."""
    if rho >= rho0 or E <= mat.Es:
        return tillotson_compressed(rho, E, rho0, mat)
    if E >= mat.Es_prime:
        return tillotson_expanded(rho, E, rho0, mat)
    P_c, dr_c, dE_c = tillotson_compressed(rho, E, rho0, mat)
    P_e, dr_e, dE_e = tillotson_expanded(rho, E, rho0, mat)
    width = mat.Es_prime - mat.Es
    f = (E - mat.Es) / width
    P = f * P_e + (1.0 - f) * P_c
    dP_dE = f * dE_e + (1.0 - f) * dE_c + (P_e - P_c) / width
    return P, f * dr_e + (1.0 - f) * dr_c, dP_dE


@jitted(**ENTRY)
def _pressure(rho, E, mat):
    return tillotson(rho, E, mat.rho0, mat.tillotson)


MODEL = Model("tillotson", "Tillotson", Tillotson, {"pressure": _pressure})
