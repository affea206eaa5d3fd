"""Ductile failure: one file a model (R18).

The equation ``used_up(x, k, mat, increment, dt)`` of a model returns the share of the
strain to fracture that an increment of the equivalent plastic strain, within a time
[s], uses up. When it is used up, ``torn(x, k, mat, work)`` returns the damage that a
plastic work of the sound share per area [J/m2], in a band of R16, does.
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "none",
        "johnson_cook_damage",
    ],
)

used_up = choose("ductile", "used_up", MODELS)
torn = choose("ductile", "torn", MODELS)
