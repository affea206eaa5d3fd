"""The constants of one material, each with the source it was taken from."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self, TypeAlias

from pydantic import Field, create_model, model_validator

from mpisph.inputs.quantities import (
    PROSE,
    Density,
    Description,
    Elongation,
    Fraction,
)
from mpisph.inputs.sourced import Sourced
from mpisph.physics.eos import is_gas
from mpisph.physics.eos.linear import Linear
from mpisph.physics.response import KINDS

if TYPE_CHECKING:
    EquationOfState: TypeAlias = str
    Porosity: TypeAlias = str
    Thermal: TypeAlias = str
    Strength: TypeAlias = str
    Failure: TypeAlias = str
    Ductile: TypeAlias = str
else:
    EquationOfState = Literal[tuple(KINDS["eos"])]
    Porosity = Literal[tuple(KINDS["porosity"])]
    Thermal = Literal[tuple(KINDS["thermal"])]
    Strength = Literal[tuple(KINDS["strength"])]
    Failure = Literal[tuple(KINDS["failure"])]
    Ductile = Literal[tuple(KINDS["ductile"])]

TABLES = {
    model.name: model.constants
    for models in KINDS.values()
    for model in models.values()
    if model.constants is not None
}
"""Constants of every model that has any, by its name."""


ELEMENTS = frozenset(
    "H He Li Be B C N O F Ne Na Mg Al Si P S Cl Ar K Ca Sc Ti V Cr Mn Fe Co Ni Cu Zn "
    "Ga Ge As Se Br Kr Rb Sr Y Zr Nb Mo Tc Ru Rh Pd Ag Cd In Sn Sb Te I Xe Cs Ba La Ce "
    "Pr Nd Pm Sm Eu Gd Tb Dy Ho Er Tm Yb Lu Hf Ta W Re Os Ir Pt Au Hg Tl Pb Bi Po At "
    "Rn Fr Ra Ac Th Pa U Np Pu Am Cm Bk Cf".split()
)
"""Symbols of the chemical elements with tabled attenuation."""

Composition = Annotated[dict[str, Fraction], PROSE]
"""No motion depends on it, so it is no part of which case it is."""

_DERIVED = "rho0 c^2"

_LEAST_MODULUS, _LARGEST_MODULUS = 1.0, 1e15
# Bounds of a pressure that is given [Pa].


class _Material(Sourced):
    """Constants of one material: a table for each model that it may be used with."""

    name: str = Field(default="", max_length=80)
    """Name by which bodies refer to the material."""
    description: Description = ""
    """What the material is, in words."""
    rho0: Density
    """Reference density."""
    composition: Composition = Field(default_factory=dict, max_length=20)
    """Elements by their fractions of the mass; radiographs alone need it."""
    elongation: Elongation | None = None
    """At break of the tensile test; the verdict on a shield alone needs it."""
    eos: EquationOfState | None = None
    """Equation of state (R8); the scheme's, if left out."""
    porosity: Porosity | None = None
    """Porosity model (R19); the scheme's, if left out."""
    thermal: Thermal | None = None
    """Thermal model (R13); the scheme's, if left out."""
    strength: Strength | None = None
    """Strength model (R7, R14, R15); the scheme's, if left out."""
    failure: Failure | None = None
    """Model of failure in tension (R9, R16, R17); the scheme's, if left out."""
    ductile: Ductile | None = None
    """Model of ductile failure (R18); the scheme's, if left out."""

    @model_validator(mode="after")
    def _check_composition(self) -> Self:
        """Require elements, whose fractions make a whole."""
        unknown = [name for name in self.composition if name not in ELEMENTS]
        if unknown:
            raise ValueError(f"composition: {', '.join(unknown)}: no chemical element")
        whole = math.fsum(self.composition.values())
        if self.composition and not math.isclose(whole, 1.0, abs_tol=0.01):
            raise ValueError(f"composition: the fractions make {whole:g}; expected 1")
        return self

    @model_validator(mode="wrap")
    @classmethod
    def _derive_bulk_modulus(cls, data: Any, handler: Any) -> Any:
        """Fill in the bulk modulus where another equation of state implies it."""
        material: _Material = handler(data)
        if material.constants("linear") is not None:
            return material
        for model in KINDS["eos"].values():
            constants = material.constants(model.name)
            if constants is None or is_gas(model.name, constants, material.rho0):
                continue
            modulus = material.rho0 * constants.bulk_sound_speed(material.rho0) ** 2
            if _LEAST_MODULUS <= modulus <= _LARGEST_MODULUS:
                source = f"{_DERIVED}, c the bulk sound speed of {model.label}"
                linear = Linear(bulk_modulus=modulus, sources={"bulk_modulus": source})
                return material.model_copy(update={"linear": linear})
        return material

    @property
    def sound_speed(self) -> float:
        """Largest bulk sound speed of its equations of state [m/s]; 0 without any."""
        tables = [self.constants(model) for model in KINDS["eos"]]
        return max((t.bulk_sound_speed(self.rho0) for t in tables if t), default=0.0)

    @property
    def given(self) -> list[str]:
        """Names of the models whose constants are given, not derived from others."""
        tables = {name: self.constants(name) for name in TABLES}
        return [
            name
            for name, table in tables.items()
            if table is not None and not _derived(table)
        ]

    def constants(self, model: str) -> Any:
        """Return the constants of a model by its name, None where there are none."""
        return getattr(self, _attribute(model), None)


def _derived(table: Sourced) -> bool:
    return any(source.startswith(_DERIVED) for source in table.sources.values())


def _attribute(model: str) -> str:
    return model.replace("-", "_")


def _table(model: str) -> Any:
    constants = TABLES[model]
    text = (constants.__doc__ or "").partition("\n")[0]
    return constants | None, Field(default=None, alias=model, description=text)


if TYPE_CHECKING:
    Material: TypeAlias = _Material
else:
    Material = create_model(
        "Material",
        __base__=_Material,
        __doc__=_Material.__doc__,
        **{_attribute(model): _table(model) for model in TABLES},
    )
