"""Porosity: one file a model (R19).

The equation ``distension(x, k, mat)`` of a model returns the volume of the matter with
its pores over that of its solid, at its present density and energy; it never grows.
The constants of a model with pores have an ``initial_distension``, from which bodies
start.
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "none",
        "p_alpha",
    ],
)

distension = choose("porosity", "distension", MODELS)
