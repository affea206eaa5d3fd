"""No strength: a fluid."""

from numba import njit

from mpisph.core.jit import ENTRY
from mpisph.physics.models import Model


@njit(**ENTRY)
def _zero(x, k, mat):
    return 0.0


MODEL = Model("none", "none", None, {"shear_modulus": _zero, "yield_stress": _zero})
