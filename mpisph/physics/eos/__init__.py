"""Equations of state: one file a model (R8).

The equation ``pressure(rho, E, mat)`` of a model returns the pressure [Pa] and its
derivatives by density and by energy; the sound speed follows from them in one place.
Its constants have a method ``bulk_sound_speed(rho0)``, the sound speed at rest [m/s],
or for a gas a typical one.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (18), (19), sections 2.5 and 2.6.
"""

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "mie_grueneisen",
        "linear",
        "tillotson",
        "ideal_gas",
    ],
)

GASES = frozenset({"ideal-gas"})
"""Models of matter that has no bulk modulus and expands without being hit."""

pressure = choose("eos", "pressure", MODELS)
