"""Strength: one file a model (R7).

Equations of a model: ``shear_modulus(x, k, mat)`` [Pa], and ``flow_stress(x, k, mat,
increment, dt)``: the yield stress [Pa] when the equivalent plastic strain has grown by
an increment within a time, and its slope with the increment. It never falls with the
increment. The stress rate and the return to the yield surface are common to all (see
`stress`).
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "elastic_plastic",
        "none",
        "johnson_cook",
        "steinberg_guinan",
    ],
)

shear_modulus = choose("strength", "shear_modulus", MODELS)
flow_stress = choose("strength", "flow_stress", MODELS)
