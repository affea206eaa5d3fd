"""Steinberg-Guinan: moduli by pressure and temperature, hardening by strain (R15).

References
----------
Steinberg, Cochran, Guinan (1980), J. Appl. Phys. 51, 1498.
"""

from typing import Annotated

from pydantic import Field, model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import (
    NonNegative,
    NonNegativeRatio,
    PositivePressure,
    Quantity,
    Temperature,
)
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class SteinbergGuinan(Sourced):
    """Constants of Steinberg-Guinan strength (R15)."""

    shear_modulus: PositivePressure
    """Shear modulus at the reference state."""
    yield_strength: PositivePressure
    """Yield strength there, without strain."""
    largest_yield_strength: PositivePressure
    """What hardening ends at, there."""
    beta: NonNegativeRatio
    """Coefficient of hardening."""
    n: NonNegative
    """Exponent of hardening."""
    A: Annotated[float, Field(ge=0, le=1e-6), Quantity("1/Pa")]
    """Rise of the shear modulus with pressure, over the modulus."""
    B: Annotated[float, Field(ge=0, le=1), Quantity("1/K")]
    """Its fall with temperature."""
    reference_temperature: Temperature = 300.0
    """Temperature of the reference state."""

    @property
    def needs_temperature(self) -> bool:
        """Whether heat softens."""
        return self.B > 0.0

    @model_validator(mode="after")
    def _check_strengths(self) -> "SteinbergGuinan":
        """Require an order of the strengths and of the modulus."""
        if not self.yield_strength <= self.largest_yield_strength <= self.shear_modulus:
            raise ValueError(
                "expected yield_strength <= largest_yield_strength <= shear_modulus, "
                f"got {self.yield_strength:g}, {self.largest_yield_strength:g} and "
                f"{self.shear_modulus:g} Pa"
            )
        return self


@jitted(**EXACT)
def steinberg_modulus(eta, P, T, mat):
    """Return the shear modulus at rho/rho0, pressure and temperature (R15) [Pa]."""
    rise = mat.A * P / eta ** (1.0 / 3.0) - mat.B * (T - mat.reference_temperature)
    return max(mat.shear_modulus * (1.0 + rise), 0.0)


@jitted(**EXACT)
def steinberg_yield(strain, G, mat):
    """Return the yield stress [Pa] and its slope with plastic strain (R15)."""
    share = G / mat.shear_modulus
    base = 1.0 + mat.beta * strain
    Y = mat.yield_strength * base**mat.n
    if Y >= mat.largest_yield_strength:
        return share * mat.largest_yield_strength, 0.0
    return share * Y, share * Y * mat.n * mat.beta / base


@jitted(**ENTRY)
def _shear_modulus(x, k, mat):
    eta = x.distension[k] * x.rho[k] / mat.rho0
    return steinberg_modulus(eta, x.P[k], x.T[k], mat.steinberg_guinan)


@jitted(**ENTRY)
def _flow_stress(x, k, mat, increment, dt):
    return steinberg_yield(
        x.plastic_strain[k] + increment, x.G[k], mat.steinberg_guinan
    )


MODEL = Model(
    "steinberg-guinan",
    "Steinberg-Guinan",
    SteinbergGuinan,
    {"shear_modulus": _shear_modulus, "flow_stress": _flow_stress},
)
