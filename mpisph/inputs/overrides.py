"""Changes of single keys from the command line, ``--set key=value``."""

from __future__ import annotations

import tomllib
from typing import Any

from mpisph.core.errors import Problem
from mpisph.inputs.findings import Key, override_place
from mpisph.inputs.printing import printable
from mpisph.inputs.spelling import nearest
from mpisph.inputs.toml_lines import deep_line

_LONGEST_OVERRIDE = 100_000
_MOST_PARTS = 20
_LONGEST_SENTENCE = 500


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
    try:
        parts, value = _split(text)
        return _assign(data, parts, value), None
    except _OverrideError as error:
        problem = Problem(
            file=override_place(text),
            expected=printable(error.expected, _LONGEST_SENTENCE),
            suggestion=error.suggestion,
        )
        return (), problem


def _split(text: str) -> tuple[list[str], str]:
    """Return the parts of the key, and the value as it stands."""
    if len(text) > _LONGEST_OVERRIDE:
        raise _OverrideError(f"expected at most {_LONGEST_OVERRIDE} characters")
    try:
        text.encode("utf-8")
    except UnicodeEncodeError:
        raise _OverrideError("expected UTF-8") from None
    name, separator, value = text.partition("=")
    parts = [part.strip() for part in name.split(".")]
    if not separator or not all(parts):
        raise _OverrideError("expected key=value, such as time.end=6us")
    if len(parts) > _MOST_PARTS:
        raise _OverrideError(f"expected a key of at most {_MOST_PARTS} parts")
    return parts, value


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
    indices = list(map(str, range(len(table))))
    if part in indices:
        return indices.index(part)
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
    document = f"value = {text.strip()}"
    if deep_line(document) is not None:
        raise _OverrideError("arrays or tables are nested too deeply")
    try:
        parsed = tomllib.loads(document)
    except (ValueError, RecursionError):  # a ValueError may be a number too long
        return text.strip()
    return parsed["value"] if len(parsed) == 1 else text.strip()
