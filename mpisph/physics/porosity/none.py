"""Matter without pores."""

from mpisph.core.jit import ENTRY
from mpisph.core.jitted import jitted
from mpisph.physics.models import Model


@jitted(**ENTRY)
def _distension(x, k, mat):
    return 1.0


MODEL = Model("none", "none", None, {"distension": _distension})
