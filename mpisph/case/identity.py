"""When two cases are the same: what they compute is, bit by bit."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import cache
from typing import Any

from pydantic import BaseModel

from mpisph.case.model import Case
from mpisph.inputs.quantities import is_prose

__all__ = ["HARMLESS", "case_key", "differences"]

HARMLESS = ("checkpoints.", "parallel.", "output.figures", "initial.file")
"""Beginnings of the keys that may change while a run is under way: no bit of what it
computes depends on them. So may prose: the title, descriptions and sources. Of initial
particles the digest counts, not where they lie."""

KEY_DIGITS = 12
"""Hexadecimal digits of a case's key: two of a million cases share one with a chance of
1 in 500."""


def differences(old: Case, new: Case) -> list[str]:
    """Return what differs between two cases and matters, as ``key: old, now new``.

    Parameters
    ----------
    old, new : Case

    Returns
    -------
    list of str
        Empty where the cases compute the same.
    """
    before, now = _essence(old), _essence(new)
    keys = dict.fromkeys((*before, *now))
    return [
        f"{key}: {before.get(key, 'none')}, now {now.get(key, 'none')}"
        for key in keys
        if before.get(key) != now.get(key)
    ]


def case_key(case: Case) -> str:
    """Return a digest of all that a case computes depends on.

    Parameters
    ----------
    case : Case

    Returns
    -------
    str
        `KEY_DIGITS` hexadecimal digits; cases without `differences` have the same.
    """
    text = json.dumps(_essence(case), sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:KEY_DIGITS]


def _essence(case: Case) -> dict[str, Any]:
    """Return the dotted keys that matter, with their values."""
    leaves: dict[str, Any] = {}
    _add_leaves(case, "", leaves)
    return {key: value for key, value in leaves.items() if not key.startswith(HARMLESS)}


def _add_leaves(value: Any, prefix: str, leaves: dict[str, Any]) -> None:
    """Add the dotted keys and the values of nested tables and arrays, less prose."""
    items: Any
    if isinstance(value, BaseModel):
        names = _matter(type(value))
        items = [(shown, getattr(value, name)) for name, shown in names]
    elif isinstance(value, Mapping):
        items = value.items()
    elif isinstance(value, list | tuple):
        items = enumerate(value)
    else:
        leaves[prefix[:-1]] = value
        return
    for name, inner in items:
        _add_leaves(inner, f"{prefix}{name}.", leaves)


@cache
def _matter(model: type[BaseModel]) -> list[tuple[str, str]]:
    """Return the fields of a model that are no prose, and their keys in a file."""
    fields = model.model_fields.items()
    return [
        (name, field.alias or name) for name, field in fields if not is_prose(field)
    ]
