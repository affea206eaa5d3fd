"""Matter that bears any tension."""

from numba import njit

from mpisph.core.jit import ENTRY
from mpisph.physics.models import Model


@njit(**ENTRY)
def unlimited(x, k, mat):
    """Return the pressure as it is [Pa]."""
    return x.P[k]


@njit(**ENTRY)
def no_growth(x, k, mat, dt):
    """Return no damage."""
    return 0.0


MODEL = Model(
    "none", "none", None, {"limit_pressure": unlimited, "damage_growth": no_growth}
)
