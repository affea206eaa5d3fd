"""Sound matter bears any tension; what other causes have damaged, less of it."""

from numba import njit

from mpisph.core.jit import ENTRY
from mpisph.physics.models import Model


@njit(**ENTRY)
def limit_by_damage(x, k, mat):
    """Return the pressure, in tension less the damage, and the sound share (R16)."""
    P, sound = x.P[k], 1.0 - x.damage[k]
    return (sound * P if P < 0.0 else P), sound


@njit(**ENTRY)
def no_growth(x, k, mat, dt):
    """Return no damage."""
    return 0.0


MODEL = Model(
    "none",
    "none",
    None,
    {"limit_tension": limit_by_damage, "damage_growth": no_growth},
)
