"""The linear equation of state (R8)."""

import math

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import PositivePressure
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class Linear(Sourced):
    """Constants of the linear equation of state (R8)."""

    bulk_modulus: PositivePressure
    """Bulk modulus."""

    def bulk_sound_speed(self, rho0: float) -> float:
        """Return the sound speed at rest [m/s]."""
        return math.sqrt(self.bulk_modulus / rho0)


@jitted(**EXACT)
def linear(rho, rho0, K):
    """Return P, dP/drho, dP/dE of ``P = K m`` (R8)."""
    return K * (rho / rho0 - 1.0), K / rho0, 0.0


@jitted(**ENTRY)
def _pressure(rho, E, mat):
    return linear(rho, mat.rho0, mat.linear.bulk_modulus)


MODEL = Model("linear", "linear", Linear, {"pressure": _pressure})
