"""Mistakes in a case, turned into sentences with a place and a suggestion."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter, ValidationError
from pydantic_core import ErrorDetails

from mpisph.case.bodies import Body
from mpisph.case.checks import find_problems
from mpisph.case.model import MOST, Case, merge_materials
from mpisph.case.partial_case import Parts
from mpisph.case.schema import field_schema
from mpisph.case.shield import of_shield
from mpisph.core.errors import Problem
from mpisph.inputs.findings import (
    BOUNDS,
    MOST_MISTAKES,
    Finding,
    Key,
    Origins,
    as_problems,
)
from mpisph.inputs.quantities import IDENTIFIER_RULE, Identifier
from mpisph.inputs.spelling import nearest, nearest_quoted
from mpisph.materials import Material, card_names

_LENGTHS = {"string_too_long": "characters", "too_long": "elements"}
_TYPES = {
    "bool_type": "expected true or false",
    "int_type": "expected a whole number",
    "string_type": "expected a string",
    "tuple_type": "expected an array",
    "dict_type": "expected a table",
    "model_type": "expected a table",
    "model_attributes_type": "expected a table",
    "string_pattern_mismatch": IDENTIFIER_RULE,
}
_BODY: TypeAdapter[Any] = TypeAdapter(Body)
_MATERIAL = TypeAdapter(Material)
_IDENTIFIER: TypeAdapter[str] = TypeAdapter(Identifier)


def case_problems(
    data: Mapping[str, Any], error: ValidationError, origins: Origins
) -> list[Problem]:
    """Return everything that is wrong with a raw case.

    Parameters
    ----------
    data : mapping
        The case as read from TOML, with overrides applied.
    error : ValidationError
        What the case model found.
    origins : Origins
        Where the keys come from.

    Returns
    -------
    list of Problem
        Mistakes in single fields and broken rules between the parts, by line.
    """
    everything = error.errors()
    details = [detail for detail in everything if detail["loc"]]
    findings = _field_findings(details[:MOST_MISTAKES], data)
    findings += find_problems(_valid_parts(data))
    # The model applies the same rules; what it alone has found is said in its words.
    findings = findings or [Finding((), detail["msg"]) for detail in everything]
    if "shield" in data:
        findings = of_shield(findings, data)
    problems = as_problems(findings, data, origins)
    if len(details) > MOST_MISTAKES:
        text = f"and {len(details) - MOST_MISTAKES} more mistakes"
        problems.append(Problem(text, file=origins.file))
    return problems


def _field_findings(details: list[ErrorDetails], data: Any) -> list[Finding]:
    """Translate the model's errors; an incomplete material makes one finding."""
    findings: dict[Key, Finding] = {}
    missing: dict[str, list[str]] = {}
    for detail in details:
        finding = _translate(detail, data)
        key = finding.key
        if detail["type"] == "missing" and key[0] == "materials" and len(key) > 2:
            missing.setdefault(str(key[1]), []).append(".".join(map(str, key[2:])))
        else:
            findings.setdefault(key, finding)
    incomplete = [_incomplete_material(name, keys) for name, keys in missing.items()]
    return [*findings.values(), *incomplete]


def _incomplete_material(name: str, missing: list[str]) -> Finding:
    return Finding(
        ("materials", name),
        f"{', '.join(missing)} missing; only a table with the name of a card "
        f"({', '.join(card_names())}) may leave constants out",
        nearest_quoted(name, card_names()),
    )


def _translate(detail: ErrorDetails, data: Any) -> Finding:
    """Turn one error of the model into a finding."""
    kind, context = detail["type"], detail.get("ctx", {})
    key = _raw_key(detail["loc"])
    if kind == "missing":
        return Finding(key, _required(field_schema(key, data)))
    if kind == "extra_forbidden":
        known = field_schema(key[:-1], data).get("properties", {})
        guess = _in_a_table(key, data, known) or nearest(str(key[-1]), known)
        listed = "" if guess else f"; expected one of {', '.join(known)}"
        return Finding(key, f"unknown key{listed}", guess)
    if kind in {"union_tag_not_found", "union_tag_invalid"}:
        return _shape_finding(key, data, context.get("tag"))
    if kind == "literal_error":
        choices = re.findall(r"'([^']*)'", context["expected"])
        guess = nearest_quoted(str(detail["input"]), choices)
        return Finding(key, f"expected {_choice(choices)}", guess)
    if kind in BOUNDS:
        name, words = BOUNDS[kind]
        unit = field_schema(key, data).get("unit", "1")
        bound = f"{context[name]:g}" + ("" if unit == "1" else f" {unit}")
        return Finding(key, f"expected {words} {bound}")
    if kind in _LENGTHS:
        most = context["max_length"]
        return Finding(key, f"expected at most {most} {_LENGTHS[kind]}")
    if kind == "value_error":
        return Finding(key, str(context["error"]))
    given = _at(data, key)
    if kind == "quantity" and key[0] == "materials" and isinstance(given, Mapping):
        return _sourced_finding(key, given)
    return Finding(key, _TYPES.get(kind, detail["msg"]))


def _at(data: Any, key: Key) -> Any:
    """Return what stands at a key of the raw case; None where nothing does."""
    for step in key:
        try:
            data = data[step]
        except (KeyError, IndexError, TypeError):
            return None
    return data


def _sourced_finding(key: Key, given: Mapping[str, Any]) -> Finding:
    """Return what is wrong with a number that is given as a table."""
    known = ("value", "source")
    form = "{ value = ..., source = ... }"
    for name in given:
        if name not in known:
            return Finding(
                (*key, name), f"unknown key; expected {form}", nearest(name, known)
            )
    missing = next((name for name in known if name not in given), "value")
    return Finding((*key, missing), f"required; expected {form}")


def _in_a_table(key: Key, data: Any, known: Mapping[str, Any]) -> str | None:
    """Return where a key would be known that stands a table too high."""
    for name in known:
        inner = field_schema((*key[:-1], name), data).get("properties", {})
        if key[-1] in inner:
            return f"{name}.{key[-1]}"
    return None


def _raw_key(location: tuple[int | str, ...]) -> Key:
    """Drop what pydantic adds: the shape of a body, and the mark of a bad key."""
    if location[:1] == ("bodies",) and len(location) > 2:
        return (*location[:2], *location[3:])
    if location[-1] == "[key]":
        return location[:-1]
    return location


def _required(field: Mapping[str, Any]) -> str:
    description = field.get("description", "").rstrip(".")
    unit = field.get("unit")
    text = f"required: {description}" if description else "required"
    return text if unit in {None, "1"} else f"{text} [{unit}]"


def _shape_finding(key: Key, data: Any, shape: object) -> Finding:
    mapping = field_schema(("bodies",), data)["items"]["discriminator"]["mapping"]
    expected = f"expected {_choice(list(mapping))}"
    if shape is None:
        return Finding((*key, "shape"), f"required: {expected}")
    return Finding((*key, "shape"), expected, nearest_quoted(str(shape), mapping))


def _choice(choices: list[str]) -> str:
    return " or ".join(f'"{choice}"' for choice in choices)


def _valid_parts(data: Mapping[str, Any]) -> Parts:
    """Return the parts of a raw case that are valid by themselves."""
    bodies = data.get("bodies")
    if not isinstance(bodies, list | tuple) or len(bodies) > MOST:
        bodies = [None]
    measured = _section(data, "measured")
    gauges = data.get("gauges", ())
    if not isinstance(gauges, list | tuple) or len(gauges) > MOST:
        gauges = ()
    return Parts(
        names=[_identifier(body, "name") for body in bodies],
        material_names=[_identifier(body, "material") for body in bodies],
        bodies=[_valid(_BODY, body) for body in bodies],
        resolution=_section(data, "resolution"),
        scheme=_section(data, "scheme"),
        output=_section(data, "output"),
        measured=measured,
        time=_section(data, "time"),
        materials=_valid_materials(data),
        measured_invalid="measured" in data and measured is None,
        gauge_names=[_identifier(gauge, "name") for gauge in gauges],
        boundary=_section(data, "boundary"),
    )


def _valid_materials(data: Mapping[str, Any]) -> dict[str, Material | None]:
    materials = merge_materials(data)
    if not isinstance(materials, Mapping):
        return {}
    if len(materials) > MOST:
        return dict.fromkeys(materials)
    return {name: _valid(_MATERIAL, table) for name, table in materials.items()}


def _section(data: Mapping[str, Any], name: str) -> Any:
    field = Case.model_fields[name]
    if name not in data:
        return None if field.is_required() else field.get_default()
    annotation: Any = field.annotation
    return _valid(TypeAdapter(annotation), data[name])


def _valid(adapter: TypeAdapter[Any], value: Any) -> Any:
    try:
        return adapter.validate_python(value)
    except ValidationError:
        return None


def _identifier(table: Any, key: str) -> str | None:
    value = table.get(key) if isinstance(table, Mapping) else None
    name: str | None = _valid(_IDENTIFIER, value)
    return name
