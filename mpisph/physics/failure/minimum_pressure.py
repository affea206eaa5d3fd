"""Minimum tensile pressure (R9): matter carries no more tension than that.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, sections 2.5 and 3.4.5.
"""

from typing import Literal

from numba import njit

from mpisph.core.jit import ENTRY, EXACT
from mpisph.inputs.quantities import TensionLimit
from mpisph.inputs.sourced import Sourced
from mpisph.physics.failure.none import limit_by_damage, no_growth
from mpisph.physics.models import Model

CLAMP = 0
ZERO = 1
OFF = 2


class MinimumPressure(Sourced):
    """Minimum tensile pressure (R9)."""

    value: TensionLimit = 0.0
    """Lowest pressure allowed; -inf for no limit."""
    mode: Literal["clamp", "zero", "off"] = "clamp"
    """What a lower pressure becomes: the limit, zero, or left as it is."""


@njit(**EXACT)
def minimum_pressure(P, P_min, mode):
    """Return P with the tensile limit applied (R9) [Pa]."""
    if mode == OFF or P >= P_min:
        return P
    return P_min if mode == CLAMP else 0.0


@njit(**ENTRY)
def _limit_tension(x, k, mat):
    limit = mat.minimum_pressure
    P = minimum_pressure(x.P[k], limit.value, limit.mode)
    if P > x.P[k]:  # torn: no shear either, while that lasts
        return P, 0.0
    return limit_by_damage(x, k, mat)


MODEL = Model(
    "minimum-pressure",
    "minimum pressure",
    MinimumPressure,
    {"limit_tension": _limit_tension, "damage_growth": no_growth},
)
