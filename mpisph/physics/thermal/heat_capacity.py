"""Heat capacity above the isentrope, and melting by Lindemann's law (R13).

References
----------
Steinberg, Cochran, Guinan (1980), J. Appl. Phys. 51, 1498: the melting temperature.
"""

import math
from typing import Annotated, ClassVar

from pydantic import Field, model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import (
    Fraction,
    HeatCapacity,
    NonNegativeEnergy,
    Quantity,
    Temperature,
    check_melting,
)
from mpisph.inputs.sourced import Sourced
from mpisph.physics.isentrope import on_isentrope
from mpisph.physics.models import Model


class HeatCapacityModel(Sourced):
    """Constants of temperature and melting (R13)."""

    DERIVED: ClassVar[tuple[str, ...]] = ("hot_heat_capacity", "span")

    heat_capacity: HeatCapacity
    """Specific heat at the reference temperature."""
    heat_to_melting: NonNegativeEnergy = 0.0
    """Energy from there to melting at zero pressure; 0: specific heat is constant."""
    reference_temperature: Temperature = 300.0
    """Temperature at the reference density and zero internal energy."""
    melting_temperature: Temperature
    """Melting temperature at the reference density."""
    heat_of_fusion: NonNegativeEnergy = 0.0
    """Latent heat of melting."""
    melting_gamma: Annotated[float, Field(ge=0, le=20), Quantity("")] = 1.0 / 3.0
    """Grueneisen parameter of Lindemann's law; 1/3 with a slope of 0: no rise."""
    melting_slope: Annotated[float, Field(ge=0, le=20), Quantity("")] = 0.0
    """First-order volume correction of that parameter, Steinberg's a."""
    heating_share: Fraction = 1.0
    """Share of the plastic work that becomes heat (Taylor-Quinney)."""

    @model_validator(mode="after")
    def _check_melting(self) -> "HeatCapacityModel":
        """Require matter that is solid at its reference state."""
        check_melting(self.melting_temperature, self.reference_temperature)
        least = 0.25 * self.heat_capacity * self.span
        if 0.0 < self.heat_to_melting <= least:
            raise ValueError(
                f"heat_to_melting must exceed {least:.4g} J/kg, a quarter of "
                "heat_capacity times the span to melting, got "
                f"{self.heat_to_melting:g} J/kg"
            )
        return self

    @property
    def span(self) -> float:
        """Temperature from the reference to melting at zero pressure [K]."""
        return self.melting_temperature - self.reference_temperature

    @property
    def hot_heat_capacity(self) -> float:
        """Specific heat from halfway to melting at zero pressure on [J/kg/K]."""
        if self.heat_to_melting == 0.0:
            return self.heat_capacity
        return (4.0 * self.heat_to_melting / self.span - self.heat_capacity) / 3.0


@jitted(**EXACT)
def melting_temperature(eta, T_m0, gamma, slope):
    """Return the melting temperature at ``eta = rho/rho0`` (R13) [K].

    Lindemann's law for ``Gamma = gamma - slope (1 - 1/eta)``; constant in expansion.
    """
    if eta <= 1.0:
        return T_m0
    power = 2.0 * (gamma - slope - 1.0 / 3.0)
    return T_m0 * math.exp(2.0 * slope * (1.0 - 1.0 / eta)) * eta**power


@jitted(**EXACT)
def heating(q, cold, hot, span):
    """Return the rise in temperature by an energy q above the isentrope (R13) [K].

    The specific heat goes linearly from ``cold`` to ``hot`` over half of the span, and
    stays there.
    """
    if q <= 0.0:
        return q / cold
    half = 0.5 * span
    way = 0.5 * (cold + hot) * half
    if q >= way:
        return half + (q - way) / hot
    return 2.0 * q / (cold + math.sqrt(cold * cold + 2.0 * (hot - cold) * q / half))


@jitted(**EXACT)
def share_molten(T, T_m, heat_capacity, heat_of_fusion):
    """Return temperature and molten share of what had T without melting (R13)."""
    if T <= T_m:
        return T, 0.0
    excess = heat_capacity * (T - T_m)
    if excess < heat_of_fusion:
        return T_m, excess / heat_of_fusion
    return T - heat_of_fusion / heat_capacity, 1.0


@jitted(**ENTRY)
def _temperature(x, k, mat):
    thermal = mat.heat_capacity
    eta = x.distension[k] * x.rho[k] / mat.rho0
    E_s, T_s = on_isentrope(eta, mat.isentrope)
    stored = (1.0 - thermal.heating_share) * x.plastic_work[k]
    hot = thermal.hot_heat_capacity
    rise = heating(x.E[k] - E_s - stored, thermal.heat_capacity, hot, thermal.span)
    T = max(T_s + rise, 0.0)
    T_m0, gamma = thermal.melting_temperature, thermal.melting_gamma
    slope = thermal.melting_slope
    # Most matter is far from melting; to know it costs less than the law, which then
    # only rises.
    if T <= T_m0 and gamma - slope >= 1.0 / 3.0:
        return T, 0.0
    T_m = melting_temperature(eta, T_m0, gamma, slope)
    return share_molten(T, T_m, hot, thermal.heat_of_fusion)


MODEL = Model(
    "heat-capacity",
    "heat capacity and melting",
    HeatCapacityModel,
    {"temperature": _temperature},
    ("T", "melt", "plastic_work"),
)
