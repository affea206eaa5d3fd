"""The sound speed that follows from an equation of state (R8, eq 19)."""

import math

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted


@jitted(**EXACT)
def sound_speed(rho, P, dP_drho, dP_dE, floor):
    """Return the sound speed (R8, eq 19) [m/s], at least `floor`."""
    c2 = dP_drho + P / (rho * rho) * dP_dE
    return math.sqrt(max(c2, floor * floor))
