"""Matter that bears any plastic strain."""

from mpisph.core.jit import ENTRY
from mpisph.core.jitted import jitted
from mpisph.physics.models import Model


@jitted(**ENTRY)
def _used_up(x, k, mat, increment, dt):
    return 0.0


@jitted(**ENTRY)
def _torn(x, k, mat, work):
    return 0.0


MODEL = Model("none", "none", None, {"used_up": _used_up, "torn": _torn})
