"""Failure in tension: one file a model (R9, R16, R17).

Equations of a model: ``limit_tension(x, k, mat)`` returns what is left of the pressure
``x.P`` that the equation of state gives [Pa], and the share of the shear that matter
still carries. ``damage_growth(x, k, mat, dt)`` returns by how much the damage grows
within a time [s], from the state that ``x`` has now: ``x.P`` is still the pressure of
the equation of state.
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

limit_tension = choose("failure", "limit_tension", MODELS)
damage_growth = choose("failure", "damage_growth", MODELS)
