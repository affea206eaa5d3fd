"""Tables of numbers that remember where each number comes from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from mpisph.inputs.quantities import FrozenModel, Source


class Sourced(FrozenModel):
    """A table of numbers that remembers where each number comes from.

    A number may be given bare, or as ``{ value = ..., source = "..." }``; the
    second form is split into the number and an entry of `sources`.
    """

    DERIVED: ClassVar[tuple[str, ...]] = ()
    """Properties that follow from the numbers, for those who calculate with them."""

    ARRAYS: ClassVar[Mapping[str, tuple[int, ...]]] = {}
    """Shapes of the arrays of a table, for those who calculate with them."""

    sources: dict[str, Source] = Field(default_factory=dict, max_length=100)
    """Where each number comes from, by key."""

    def arrays(self, rho0: float) -> dict[str, Any]:
        """Return the values of `ARRAYS` for a reference density [kg/m3]."""
        return {}

    @property
    def needs_temperature(self) -> bool:
        """Whether what they describe depends on the temperature."""
        return False

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
