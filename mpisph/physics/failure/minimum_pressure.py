"""Minimum tensile pressure (R9): matter carries no more tension than that.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, sections 2.5 and 3.4.5.
"""

from typing import Literal

from mpisph.core.jit import ENTRY, EXACT
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import TensionLimit
from mpisph.inputs.sourced import Sourced
from mpisph.physics.cracks import borne
from mpisph.physics.failure.none import no_growth
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


@jitted(**EXACT)
def minimum_pressure(P, P_min, mode):
    """Return P with the tensile limit applied (R9) [Pa]."""
    if mode == OFF or P >= P_min:
        return P
    return P_min if mode == CLAMP else 0.0


@jitted(**EXACT)
def _share(P, damage, limit):
    # Torn matter has no shear either, while that lasts.
    torn = minimum_pressure(P, limit.value, limit.mode) > P
    return 0.0 if torn else 1.0 - damage


@jitted(**ENTRY)
def _sound_share(x, k, mat):
    return _share(x.P[k], x.damage[k], mat.minimum_pressure)


@jitted(**ENTRY)
def _limit_tension(x, k, mat, dt):
    limit = mat.minimum_pressure
    P = minimum_pressure(x.P[k], limit.value, limit.mode)
    return borne(P, 1.0 - x.damage[k]), 0.0


MODEL = Model(
    "minimum-pressure",
    "minimum pressure",
    MinimumPressure,
    {
        "sound_share": _sound_share,
        "limit_tension": _limit_tension,
        "damage_growth": no_growth,
    },
)
