"""Equations of state: one file a model (R8).

The equation ``pressure(rho, E, mat)`` of a model returns the pressure [Pa] and its
derivatives by density and by energy; the sound speed follows from them in one place.
Its constants have a method ``bulk_sound_speed(rho0)``, the sound speed at rest [m/s],
or for a gas a typical one.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (18), (19), sections 2.5 and 2.6.
"""

from typing import Any

from mpisph.physics.models import choose, load_models

MODELS = load_models(
    __name__,
    [
        "mie_grueneisen",
        "linear",
        "tillotson",
        "ideal_gas",
        "table",
    ],
)

GASES = frozenset({"ideal-gas"})
"""Models of matter that has no bulk modulus and expands without being hit."""


def is_gas(model: str, constants: Any, rho0: float) -> bool:
    """Say whether matter expands without being hit.

    Parameters
    ----------
    model : str
        Name of its equation of state.
    constants : Sourced
        Of that model.
    rho0 : float
        Reference density [kg/m3].
    """
    tabled = model == "table" and constants is not None
    return model in GASES or (tabled and bool(constants.is_gas(rho0)))


pressure = choose("eos", "pressure", MODELS)
