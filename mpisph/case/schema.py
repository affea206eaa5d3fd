"""The JSON schema of a case, and how to find a key in it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from mpisph.case.model import Case
from mpisph.inputs.findings import Key

__all__ = ["case_schema", "field_schema"]


@lru_cache(maxsize=1)
def case_schema() -> dict[str, Any]:
    """Return the JSON schema of case files.

    Returns
    -------
    dict
        Schema in which every field has a description, and every quantity its SI
        unit under the key ``unit`` (``"1"`` for pure numbers).
    """
    schema = Case.model_json_schema()
    for part in schema["$defs"].values():
        material = part.get("properties", {}).get("material", {})
        if "pattern" in material:  # of a body; loading a case puts a name for a file
            material["pattern"] += r"|\.toml$"
    for part in (schema, *schema["$defs"].values()):
        for field in part.get("properties", {}).values():
            _hoist_unit(field)
            # Pydantic drops a description that equals the one of the type.
            name = field.get("$ref", "").rpartition("/")[2]
            if name:
                field.setdefault("description", schema["$defs"][name]["description"])
    return schema


def _hoist_unit(field: dict[str, Any]) -> None:
    """Give an optional quantity its unit where a plain one has it."""
    for option in field.get("anyOf", ()):
        if "unit" in option:
            field["unit"] = option["unit"]


def field_schema(key: Key, data: Any) -> dict[str, Any]:
    """Return the schema of one key, or an empty dict where there is none.

    Parameters
    ----------
    key : tuple
        Table keys and array indices.
    data : object
        The raw case, which tells the shapes of the bodies.

    Returns
    -------
    dict
        The field's own schema, with its description, over that of its type.
    """
    node = case_schema()
    for step in key:
        node = _resolve(node, data)
        properties = node.get("properties", {})
        if isinstance(step, int):
            node = node.get("items", {})
        else:
            node = properties.get(step, _any_property(node))
        data = _child(data, step)
    return {**_resolve(node, data), **node}


def _any_property(node: dict[str, Any]) -> dict[str, Any]:
    """Return the schema of a table's entries whose names the user chooses."""
    patterns = list(node.get("patternProperties", {}).values())
    return patterns[0] if patterns else node.get("additionalProperties") or {}


def _resolve(node: dict[str, Any], data: Any) -> dict[str, Any]:
    """Follow references, optional values and the shape of a body."""
    if "discriminator" in node:
        shape = data.get("shape") if isinstance(data, Mapping) else None
        mapping = node["discriminator"]["mapping"]
        known = isinstance(shape, str) and shape in mapping
        return _resolve({"$ref": mapping[shape]}, data) if known else {}
    if "$ref" in node:
        name = node["$ref"].rpartition("/")[2]
        return _resolve(case_schema()["$defs"][name], data)
    references = [option for option in node.get("anyOf", ()) if "$ref" in option]
    return _resolve(references[0], data) if references else node


def _child(data: Any, step: str | int) -> Any:
    try:
        return data[step]
    except (KeyError, IndexError, TypeError):
        return None
