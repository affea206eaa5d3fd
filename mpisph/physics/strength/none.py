"""No strength: a fluid."""

from numba import njit

from mpisph.core.jit import EXACT
from mpisph.physics.models import Model


@njit(**EXACT)
def _zero(x, k, mat):
    return 0.0


MODEL = Model("none", "none", None, {"shear_modulus": _zero, "yield_stress": _zero})
