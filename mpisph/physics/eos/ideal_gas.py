"""The ideal gas (R8): its pressure follows from density and internal energy alone."""

from typing import Annotated

from pydantic import Field

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import Quantity
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class IdealGas(Sourced):
    """Constants of the ideal gas (R8)."""

    gamma: Annotated[float, Field(gt=1, le=100), Quantity("")]
    """Ratio of specific heats."""
    c0: Annotated[float, Field(ge=1e-6, le=1e6), Quantity("m/s")]
    """Typical sound speed; the lowest one and the expected steps are measured by it."""

    def bulk_sound_speed(self, rho0: float) -> float:
        """Return the typical sound speed [m/s]: at rest and cold a gas has none."""
        return self.c0


@jitted(**EXACT)
def ideal_gas(rho, E, gamma):
    """Return P, dP/drho, dP/dE of ``P = (gamma - 1) rho E`` (R8)."""
    g = gamma - 1.0
    return g * rho * E, g * E, g * rho


@jitted(**ENTRY)
def _pressure(rho, E, mat):
    return ideal_gas(rho, E, mat.ideal_gas.gamma)


MODEL = Model("ideal-gas", "ideal gas", IdealGas, {"pressure": _pressure})
