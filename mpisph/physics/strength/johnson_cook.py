"""Johnson-Cook: hardening by strain and rate, softening by heat (R14).

References
----------
Johnson, Cook (1983), 7th Int. Symp. Ballistics, 541.
"""

import math
from typing import Annotated

from pydantic import Field, model_validator

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import (
    NonNegative,
    NonNegativePressure,
    Positive,
    PositivePressure,
    Quantity,
    Temperature,
    check_melting,
)
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class JohnsonCook(Sourced):
    """Constants of Johnson-Cook strength (R14)."""

    shear_modulus: PositivePressure
    """Shear modulus."""
    A: PositivePressure
    """Yield stress without strain, at the reference rate and temperature."""
    B: NonNegativePressure
    """Coefficient of hardening."""
    n: Positive
    """Exponent of hardening."""
    C: NonNegative
    """Coefficient of the logarithm of the strain rate."""
    m: Positive
    """Exponent of softening by heat."""
    melting_temperature: Temperature
    """Temperature at which the yield stress vanishes."""
    reference_temperature: Temperature = 298.0
    """Temperature up to which heat does not soften."""
    reference_rate: Annotated[float, Field(gt=0, le=1e12), Quantity("1/s")] = 1.0
    """Strain rate up to which rate does not harden."""

    @property
    def needs_temperature(self) -> bool:
        """Heat always softens."""
        return True

    @model_validator(mode="after")
    def _check_temperatures(self) -> "JohnsonCook":
        """Require a melting temperature above that of the reference."""
        check_melting(self.melting_temperature, self.reference_temperature)
        return self


@jitted(**EXACT)
def homologous_temperature(T, T_ref, T_melt):
    """Return the share of the way from a reference to melting, within 0 and 1 (R14)."""
    return min(max((T - T_ref) / (T_melt - T_ref), 0.0), 1.0)


@jitted(**EXACT)
def johnson_cook(strain, rate, T, mat):
    """Return the yield stress [Pa], and its slopes with strain and with rate (R14).

    Parameters
    ----------
    strain : float
        Equivalent plastic strain.
    rate : float
        Its rate [1/s].
    T : float
        Temperature [K].
    mat : record of JohnsonCook
    """
    hot = homologous_temperature(T, mat.reference_temperature, mat.melting_temperature)
    thermal = 1.0 - hot**mat.m
    hardened, slope = mat.A, 0.0
    if strain > 0.0:
        risen = mat.B * strain**mat.n
        hardened += risen
        slope = mat.n * risen / strain
    ratio = rate / mat.reference_rate
    if ratio <= 1.0:
        return hardened * thermal, slope * thermal, 0.0
    fast = 1.0 + mat.C * math.log(ratio)
    Y = hardened * thermal
    return Y * fast, slope * fast * thermal, Y * mat.C / rate


@jitted(**ENTRY)
def _shear_modulus(x, k, mat):
    return mat.johnson_cook.shear_modulus


@jitted(**ENTRY)
def _flow_stress(x, k, mat, increment, dt):
    rate = increment / dt if dt > 0.0 else 0.0
    Y, by_strain, by_rate = johnson_cook(
        x.plastic_strain[k] + increment, rate, x.T[k], mat.johnson_cook
    )
    return Y, by_strain + (by_rate / dt if dt > 0.0 else 0.0)


MODEL = Model(
    "johnson-cook",
    "Johnson-Cook",
    JohnsonCook,
    {"shear_modulus": _shear_modulus, "flow_stress": _flow_stress},
)
