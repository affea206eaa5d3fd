"""Thermal response: one file a model (R13).

The equation ``temperature`` of a model returns the temperature [K] and the molten share
of the mass.
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "none",
        "heat_capacity",
    ],
)

temperature = choose("thermal", "temperature", MODELS)
