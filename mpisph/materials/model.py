"""The constants of one material, each with the source it was taken from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from mpisph.inputs.quantities import (
    Density,
    Description,
    FrozenModel,
    NonNegativePressure,
    Positive,
    PositivePressure,
    Pressure,
    Quantity,
    SoundSpeed,
    Source,
    SpecificEnergy,
)

__all__ = ["Material", "Sourced", "Tillotson"]


class Sourced(FrozenModel):
    """A table of numbers that remembers where each number comes from.

    A number may be given bare, or as ``{ value = ..., source = "..." }``; the
    second form is split into the number and an entry of `sources`.
    """

    sources: dict[str, Source] = Field(default_factory=dict, max_length=100)
    """Where each number comes from, by key."""

    @model_validator(mode="before")
    @classmethod
    def _split_sources(cls, data: Any) -> Any:
        """Move the source of every sourced number into `sources`."""
        if not isinstance(data, Mapping):
            return data
        given = data.get("sources", {})
        if not isinstance(given, Mapping):
            return data
        numbers, sources = {}, dict(given)
        for key, entry in data.items():
            if isinstance(entry, Mapping) and set(entry) == {"value", "source"}:
                numbers[key], sources[key] = entry["value"], entry["source"]
            else:
                numbers[key] = entry
        return {**numbers, "sources": sources}

    @classmethod
    def __get_pydantic_json_schema__(
        cls, core_schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        """Describe the sourced form, and that a card may supply what is left out."""
        schema = handler.resolve_ref_schema(handler(core_schema))
        schema.pop("required", None)
        for field in schema["properties"].values():
            if "unit" in field:
                number = {"anyOf": list(field["anyOf"])}
                source = {"type": "string"}
                pair = {"value": number, "source": source}
                field["anyOf"].append({"type": "object", "properties": pair})
        return schema


class Tillotson(Sourced):
    """Constants of the Tillotson equation of state (R8)."""

    a: Positive
    """Coefficient a, the thermal coefficient at high energy."""
    b: Positive
    """Coefficient b, added to a at low energy."""
    A: PositivePressure
    """Linear coefficient of the cold compression curve."""
    B: Pressure
    """Quadratic coefficient of the cold compression curve."""
    E0: SpecificEnergy
    """Energy that sets the fall of the b term."""
    Es: SpecificEnergy
    """Energy of incipient vaporisation."""
    Es_prime: SpecificEnergy
    """Energy of complete vaporisation."""
    alpha: Positive
    """Exponent of the expanded, vaporised branch."""
    beta: Positive
    """Exponent of the cold pressure in the expanded, vaporised branch."""

    @model_validator(mode="after")
    def _check_energies(self) -> Tillotson:
        """Require the two vaporisation energies in their order."""
        if self.Es_prime <= self.Es:
            raise ValueError(
                f"Es_prime must exceed Es = {self.Es:g} J/kg, got {self.Es_prime:g}"
            )
        return self


class Material(Sourced):
    """Constants of one material (source paper, tables 2 and 3)."""

    name: str = Field(default="", max_length=80)
    """Name by which bodies refer to the material."""
    description: Description = ""
    """What the material is, in words."""
    rho0: Density
    """Reference density."""
    c0: SoundSpeed
    """Bulk sound speed, the intercept of the shock velocity line."""
    hugoniot_slope: Annotated[float, Field(gt=0, le=20), Quantity("")]
    """Slope k of shock velocity against particle velocity."""
    gamma0: Annotated[float, Field(ge=0, le=20), Quantity("")]
    """Grueneisen parameter at the reference density."""
    shear_modulus: NonNegativePressure
    """Shear modulus."""
    yield_strength: NonNegativePressure
    """Yield strength, constant; at most the shear modulus, unless that is zero."""
    bulk_modulus: PositivePressure
    """Bulk modulus of the linear equation of state."""
    tillotson: Tillotson | None = None
    """Constants of the Tillotson equation of state, where they are known."""

    @model_validator(mode="after")
    def _check_strength(self) -> Material:
        """Require that a solid yields before it is sheared by its own size."""
        if 0.0 < self.shear_modulus < self.yield_strength:
            raise ValueError(
                f"yield_strength must not exceed shear_modulus = "
                f"{self.shear_modulus:g} Pa, got {self.yield_strength:g}"
            )
        return self
