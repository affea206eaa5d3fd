"""Failure in tension: one file a model (R9, R16, R17).

Equations of a model: ``sound_share(x, k, mat)`` returns the share of the shear that
matter still carries; then the stress is brought back to yield. ``limit_tension(x, k,
mat, dt)`` returns what is left of the pressure after a time [s], and the tension that
opens cracks meanwhile [Pa]. ``damage_growth(x, k, mat, excess, dt)`` returns by how
much the damage grows by that. For all of them ``x.P`` is the pressure of the
equation of state.
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "minimum_pressure",
        "spall",
        "grady_kipp",
        "none",
    ],
)

sound_share = choose("failure", "sound_share", MODELS)
limit_tension = choose("failure", "limit_tension", MODELS)
damage_growth = choose("failure", "damage_growth", MODELS)
