"""Sound matter bears any tension; what other causes have damaged, less of it."""

from mpisph.core.jit import ENTRY
from mpisph.core.jitted import jitted
from mpisph.physics.cracks import borne
from mpisph.physics.models import Model


@jitted(**ENTRY)
def undamaged(x, k, mat):
    """Return the share that damage has left (R16)."""
    return 1.0 - x.damage[k]


@jitted(**ENTRY)
def limit_by_damage(x, k, mat, dt):
    """Return the pressure, in tension less the damage (R16), and no excess [Pa]."""
    return borne(x.P[k], 1.0 - x.damage[k]), 0.0


@jitted(**ENTRY)
def no_growth(x, k, mat, excess, dt):
    """Return no damage."""
    return 0.0


MODEL = Model(
    "none",
    "none",
    None,
    {
        "sound_share": undamaged,
        "limit_tension": limit_by_damage,
        "damage_growth": no_growth,
    },
)
