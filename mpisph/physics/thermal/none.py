"""No temperature is known, and nothing melts."""

import math

from numba import njit

from mpisph.core.jit import ENTRY
from mpisph.physics.models import Model


@njit(**ENTRY)
def _temperature(x, k, mat):
    return math.nan, 0.0


MODEL = Model("none", "none", None, {"temperature": _temperature})
