"""Matter without pores."""

from numba import njit

from mpisph.core.jit import ENTRY
from mpisph.physics.models import Model


@njit(**ENTRY)
def _distension(x, k, mat):
    return 1.0


MODEL = Model("none", "none", None, {"distension": _distension})
