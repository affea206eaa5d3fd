"""No temperature is known: it is zero, and nothing melts."""

from mpisph.core.jit import ENTRY
from mpisph.core.jitted import jitted
from mpisph.physics.models import Model


@jitted(**ENTRY)
def _temperature(x, k, mat):
    return 0.0, 0.0


MODEL = Model("none", "none", None, {"temperature": _temperature})
