"""Strength: one file a model (R7).

Equations of a model: ``shear_modulus`` [Pa] and ``yield_stress`` [Pa]. The stress rate
and the return to the yield surface are common to all (see `stress`).
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "elastic_plastic",
        "none",
    ],
)

shear_modulus = choose("strength", "shear_modulus", MODELS)
yield_stress = choose("strength", "yield_stress", MODELS)
