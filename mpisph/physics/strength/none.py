"""No strength: a fluid."""

from mpisph.core.jit import ENTRY
from mpisph.core.jitted import jitted
from mpisph.physics.models import Model


@jitted(**ENTRY)
def _shear_modulus(x, k, mat):
    return 0.0


@jitted(**ENTRY)
def _flow_stress(x, k, mat, increment, dt):
    return 0.0, 0.0


MODEL = Model(
    "none", "none", None, {"shear_modulus": _shear_modulus, "flow_stress": _flow_stress}
)
