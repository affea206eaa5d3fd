"""Changes of single keys from the command line, ``--set key=value``."""

from __future__ import annotations

import tomllib
from typing import Any

from mpisph.case.checks import Key
from mpisph.errors import Problem
from mpisph.materials.library import nearest

__all__ = ["apply_override"]


class _OverrideError(Exception):
    """An override that cannot be applied: what was expected, and a guess."""

    def __init__(self, expected: str, suggestion: str | None = None) -> None:
        super().__init__(expected)
        self.expected = expected
        self.suggestion = suggestion


def apply_override(data: dict[str, Any], text: str) -> tuple[Key, Problem | None]:
    """Change one key of a raw case in place.

    Parameters
    ----------
    data : dict
        The case as read from TOML; changed in place.
    text : str
        ``key=value``. The key is dotted; a body is meant by its index or by its
        name. The value is TOML, or a bare string such as ``6 km/s``; an empty
        value removes the key.

    Returns
    -------
    key : tuple
        The key that was changed, with indices for array elements.
    problem : Problem or None
        Why the override could not be applied.
    """
    name, separator, value = text.partition("=")
    key = name.strip()
    try:
        if not separator or not all(part.strip() for part in key.split(".")):
            raise _OverrideError("expected key=value, such as time.end=6us")
        return _assign(data, [part.strip() for part in key.split(".")], value), None
    except _OverrideError as error:
        problem = Problem(
            file=f"--set {text}",
            expected=error.expected,
            suggestion=error.suggestion,
        )
        return (), problem


def _assign(data: dict[str, Any], parts: list[str], value: str) -> Key:
    """Walk down to the last key, making missing tables on the way, and set it."""
    path: Key = ()
    table: Any = data
    for part in parts[:-1]:
        step = _step(table, part, path)
        if isinstance(table, dict):
            table.setdefault(step, {})
        table = table[step]
        path = (*path, step)
    step = _step(table, parts[-1], path)
    if value.strip():
        table[step] = _parse_value(value)
    else:
        _remove(table, step)
    return (*path, step)


def _step(table: Any, part: str, path: Key) -> str | int:
    """Return the key or index that `part` means in a table or array."""
    if isinstance(table, dict):
        return part
    where = ".".join(map(str, path))
    if not isinstance(table, list):
        raise _OverrideError(f"{where} is no table, so it has no key {part}")
    if part.isdecimal() and int(part) < len(table):
        return int(part)
    names = [e["name"] for e in table if isinstance(e, dict) and "name" in e]
    if part in names:
        return names.index(part)
    listed = f" or a name ({', '.join(map(str, names))})" if names else ""
    raise _OverrideError(
        f"{where} has no element {part}: expected an index below {len(table)}{listed}",
        nearest(part, [str(name) for name in names]),
    )


def _remove(table: Any, step: str | int) -> None:
    if isinstance(table, dict):
        table.pop(str(step), None)
    else:
        del table[step]


def _parse_value(text: str) -> Any:
    try:
        parsed = tomllib.loads(f"value = {text.strip()}")
    except tomllib.TOMLDecodeError:
        return text.strip()
    return parsed["value"] if len(parsed) == 1 else text.strip()
