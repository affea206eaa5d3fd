"""Failure: one file a model (R9).

The equation ``limit_pressure`` of a model returns what is left of the pressure ``x.P``
that the equation of state gives [Pa].
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "minimum_pressure",
    ],
)

limit_pressure = choose("failure", "limit_pressure", MODELS)
