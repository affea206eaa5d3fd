"""No temperature is known: it is zero, and nothing melts."""

from numba import njit

from mpisph.core.jit import ENTRY
from mpisph.physics.models import Model


@njit(**ENTRY)
def _temperature(x, k, mat):
    return 0.0, 0.0


MODEL = Model("none", "none", None, {"temperature": _temperature})
