"""What is wrong with a file, and where: keys, findings, and sentences of them."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, NamedTuple

from pydantic import ValidationError

from mpisph.core.errors import Problem
from mpisph.inputs.printing import printable
from mpisph.inputs.quantities import IDENTIFIER_RULE

Key = tuple[str | int, ...]


class Finding(NamedTuple):
    """A broken rule: the key to blame, what was expected, and a guess."""

    key: Key
    expected: str
    suggestion: str | None = None


BOUNDS = {
    "greater_than": ("gt", "more than"),
    "greater_than_equal": ("ge", "at least"),
    "less_than": ("lt", "less than"),
    "less_than_equal": ("le", "at most"),
}
"""Of pydantic's errors: the key of the bound, and what is expected of a number."""

BEYOND_64_BITS = "a whole number beyond the 64 bits of TOML"
_LONGEST_VALUE = 60
_LONGEST_KEY = 200
_LONGEST_SENTENCE = 2000

MOST_MISTAKES = 1000
"""More than these are only counted: a text that is no case could make any number."""


class Origins(NamedTuple):
    """Where the keys of a case come from.

    Attributes
    ----------
    file : str or None
        The case file, for people.
    lines : dict
        Line of each key of the file.
    overrides : dict
        Override, as the user typed it, of each key that was overridden.
    elsewhere : dict, optional
        Origins of tables that come from files of their own, by their keys.
    """

    file: str | None
    lines: Mapping[Key, int]
    overrides: Mapping[Key, str]
    elsewhere: Mapping[Key, Origins] = {}

    def place(self, key: Key) -> tuple[str | None, int | None]:
        """Return file and line of the nearest enclosing key.

        An override stands for the file, and has no line.
        """
        for table, origins in self.elsewhere.items():
            if key[: len(table)] == table:
                return origins.place(key[len(table) :])
        if key not in self.lines:
            for changed, text in self.overrides.items():
                # The override has made this table on the way to its own key.
                if changed[: len(key)] == key:
                    return override_place(text), None
        for length in range(len(key), 0, -1):
            prefix = key[:length]
            if prefix in self.overrides:
                return override_place(self.overrides[prefix]), None
            if prefix in self.lines:
                return self.file, self.lines[prefix]
        return self.file, None


def integer_problems(data: Mapping[str, Any], origins: Origins) -> list[Problem]:
    """Return the whole numbers of a raw case that are no legal TOML.

    Neither pydantic nor `str` is fit for those that are very long.

    Parameters
    ----------
    data : mapping
        The case as read from TOML, with overrides applied.
    origins : Origins
        Where the keys come from.

    Returns
    -------
    list of Problem
        One for each such number, without the number.
    """
    keys: list[Key] = []
    nodes: list[tuple[Key, Any]] = [((), data)]
    while nodes:
        key, node = nodes.pop()
        if isinstance(node, Mapping):
            nodes += [((*key, step), child) for step, child in node.items()]
        elif isinstance(node, list | tuple):
            nodes += [((*key, step), child) for step, child in enumerate(node)]
        elif isinstance(node, int) and not -(2**63) <= node < 2**63:
            keys.append(key)
    findings = [Finding(key, BEYOND_64_BITS) for key in keys[:MOST_MISTAKES]]
    return as_problems(findings, {}, origins)


def as_problems(
    findings: list[Finding], data: Mapping[str, Any], origins: Origins
) -> list[Problem]:
    """Return the problems of all findings, by line."""
    problems = [_as_problem(finding, data, origins) for finding in findings]
    return sorted(problems, key=lambda problem: problem.line or 0)


def _as_problem(finding: Finding, data: Any, origins: Origins) -> Problem:
    file, line = origins.place(finding.key)
    return Problem(
        expected=printable(finding.expected, _LONGEST_SENTENCE),
        file=file,
        line=line,
        key=printable(".".join(map(str, finding.key)), _LONGEST_KEY),
        value=_value_text(data, finding.key),
        suggestion=finding.suggestion and printable(finding.suggestion, _LONGEST_KEY),
    )


def _value_text(data: Any, key: Key) -> str | None:
    """Return the value at a key as it stands in the file; None for a whole table."""
    for step in key:
        try:
            data = data[step]
        except (KeyError, IndexError, TypeError):
            return None
    if isinstance(data, Mapping | list | tuple):
        return None
    if isinstance(data, str | bool):
        text = json.dumps(data, ensure_ascii=False)
    else:
        text = str(data)
    return printable(text, _LONGEST_VALUE)


_LONGEST_PLACE = 200


def override_place(text: str) -> str:
    """Return how messages name an override, in the place of file and line."""
    return f"--set {printable(text, _LONGEST_PLACE)}"


def model_problems(error: ValidationError, origins: Origins) -> list[Problem]:
    """Return what is wrong with a file of a simple model, each with its line.

    Parameters
    ----------
    error : ValidationError
    origins : Origins
        Where the keys come from.
    """
    problems = []
    for detail in error.errors():
        key = detail["loc"]
        file, line = origins.place(key)
        kind, context = detail["type"], detail.get("ctx", {})
        expected = {
            "missing": "required",
            "extra_forbidden": "unknown key",
            "string_pattern_mismatch": IDENTIFIER_RULE,
        }.get(kind, detail["msg"].removeprefix("Value error, "))
        if kind in BOUNDS:
            bound, words = BOUNDS[kind]
            expected = f"expected {words} {context[bound]:g}"
        elif kind == "literal_error":
            expected = f"expected {context['expected']}"
        value = None if kind == "missing" else _value_text(detail["input"], ())
        name = ".".join(map(str, key))
        problems.append(Problem(expected, file=file, line=line, key=name, value=value))
    return sorted(problems, key=lambda problem: problem.line or 0)
