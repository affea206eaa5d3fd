"""Elastic, perfectly plastic (R7): constant shear modulus and yield strength."""

from pydantic import model_validator

from mpisph.core.jit import ENTRY
from mpisph.core.jitted import jitted
from mpisph.inputs.quantities import NonNegativePressure
from mpisph.inputs.sourced import Sourced
from mpisph.physics.models import Model


class ElasticPlastic(Sourced):
    """Constants of elastic, perfectly plastic strength (R7)."""

    shear_modulus: NonNegativePressure
    """Shear modulus."""
    yield_strength: NonNegativePressure
    """Yield strength; at most the shear modulus, unless that is zero."""

    @model_validator(mode="after")
    def _check_strength(self) -> "ElasticPlastic":
        """Require that a solid yields before it is sheared by its own size."""
        if 0.0 < self.shear_modulus < self.yield_strength:
            raise ValueError(
                f"yield_strength must not exceed shear_modulus = "
                f"{self.shear_modulus:g} Pa, got {self.yield_strength:g}"
            )
        return self


@jitted(**ENTRY)
def _shear_modulus(x, k, mat):
    return mat.elastic_plastic.shear_modulus


@jitted(**ENTRY)
def _flow_stress(x, k, mat, increment, dt):
    return mat.elastic_plastic.yield_strength, 0.0


MODEL = Model(
    "elastic-plastic",
    "elastic, perfectly plastic",
    ElasticPlastic,
    {"shear_modulus": _shear_modulus, "flow_stress": _flow_stress},
)
