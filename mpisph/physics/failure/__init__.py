"""Failure in tension: one file a model (R9, R16).

Equations of a model: ``limit_pressure(x, k, mat)``, what is left of the pressure
``x.P`` that the equation of state gives [Pa]; where it is more, matter is torn for that
step. ``damage_growth(x, k, mat, dt)``: by how much the damage grows within a time [s],
from the stress that matter bears now.
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

limit_pressure = choose("failure", "limit_pressure", MODELS)
damage_growth = choose("failure", "damage_growth", MODELS)
