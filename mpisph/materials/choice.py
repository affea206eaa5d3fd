"""Which models a material is used with: its own choice, else the scheme's."""

from __future__ import annotations

from typing import Protocol

from mpisph.materials.model import (
    TABLES,
    Ductile,
    EquationOfState,
    Failure,
    Material,
    Porosity,
    Strength,
    Thermal,
)
from mpisph.physics.failure.minimum_pressure import MinimumPressure
from mpisph.physics.response import KINDS, MaterialModels


class Defaults(Protocol):
    """What a scheme chooses for all materials that choose nothing themselves."""

    @property
    def eos(self) -> EquationOfState:
        """Equation of state."""

    @property
    def porosity(self) -> Porosity:
        """Porosity model."""

    @property
    def thermal(self) -> Thermal:
        """Thermal model."""

    @property
    def strength(self) -> Strength:
        """Strength model."""

    @property
    def failure(self) -> Failure:
        """Model of failure in tension."""

    @property
    def ductile(self) -> Ductile:
        """Model of ductile failure."""

    @property
    def p_min(self) -> MinimumPressure:
        """Minimum tensile pressure."""


def chosen_models(
    material: Material, defaults: Defaults, eos: EquationOfState | None = None
) -> MaterialModels:
    """Return the models of a material, with the constants that it has for them.

    Parameters
    ----------
    material : Material
    defaults : Defaults
        The scheme of the case.
    eos : str, optional
        The choice of a body, which goes before that of the material.
    """
    names = {kind: getattr(material, kind) or getattr(defaults, kind) for kind in KINDS}
    names["eos"] = eos or names["eos"]
    constants = {
        "minimum-pressure": defaults.p_min,
        **{name: own for name in TABLES if (own := material.constants(name))},
    }
    return MaterialModels(material.name, material.rho0, names, constants)
