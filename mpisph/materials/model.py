"""The constants of one material, each with the source it was taken from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from pydantic import Field, create_model

from mpisph.inputs.quantities import Density, Description
from mpisph.inputs.sourced import Sourced
from mpisph.physics.response import KINDS

if TYPE_CHECKING:
    EquationOfState: TypeAlias = str
    Strength: TypeAlias = str
    Failure: TypeAlias = str
else:
    EquationOfState = Literal[tuple(KINDS["eos"])]
    Strength = Literal[tuple(KINDS["strength"])]
    Failure = Literal[tuple(KINDS["failure"])]

TABLES = {
    model.name: model.constants
    for models in KINDS.values()
    for model in models.values()
    if model.constants is not None
}
"""Constants of every model that has any, by its name."""


class _Material(Sourced):
    """Constants of one material: a table for each model that it may be used with."""

    name: str = Field(default="", max_length=80)
    """Name by which bodies refer to the material."""
    description: Description = ""
    """What the material is, in words."""
    rho0: Density
    """Reference density."""
    eos: EquationOfState | None = None
    """Equation of state (R8); the scheme's, if left out."""
    strength: Strength | None = None
    """Strength model (R7); the scheme's, if left out."""
    failure: Failure | None = None
    """Failure model (R9); the scheme's, if left out."""

    @property
    def sound_speed(self) -> float:
        """Largest bulk sound speed of its equations of state [m/s]; 0 without any."""
        tables = [self.constants(model) for model in KINDS["eos"]]
        return max((t.bulk_sound_speed(self.rho0) for t in tables if t), default=0.0)

    def constants(self, model: str) -> Any:
        """Return the constants of a model by its name, None where there are none."""
        return getattr(self, _attribute(model))


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
