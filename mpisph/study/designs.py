"""Designs of a study: a CSV file whose rows are cases, a column for each key."""

import csv
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import MOST_MISTAKES
from mpisph.inputs.printing import printable

MOST_ROWS = 10_000
"""More designs than this are taken for a slip."""

_HEAD = re.compile(r"(?P<key>[A-Za-z][A-Za-z0-9_.-]*)\s*(?:\[(?P<unit>[^\[\]]*)\])?")
_LONGEST = 200


class Design(NamedTuple):
    """A column of the file.

    Attributes
    ----------
    name : str
        The end of the key, as long as it takes to differ from the other columns.
    key : str
        Key of the case.
    unit : str
        Of the numbers; empty for SI.
    values : tuple
        Of all rows, numbers and words as a case file would give them; empty where the
        row leaves the key as it is.
    """

    name: str
    key: str
    unit: str
    values: tuple[bool | int | float | str, ...]


class Designs(NamedTuple):
    """All columns, and the line of each row.

    Attributes
    ----------
    path : Path
    columns : tuple of Design
    lines : tuple of int
    """

    path: Path
    columns: tuple[Design, ...]
    lines: tuple[int, ...]


def read_designs(path: Path) -> Designs:
    """Read a file of designs.

    Its first line has the keys of the case, each with a unit in brackets where its
    numbers have one: ``bodies.plate.thickness [mm]``. Cells are separated by commas,
    semicolons or tabs. Empty lines, and lines that begin with ``#``, are left out.

    Parameters
    ----------
    path : Path

    Returns
    -------
    Designs

    Raises
    ------
    CaseError
        If it cannot be read, with all that is wrong and where.
    """
    lines = csv_lines(path)
    problems: list[Problem] = []
    first, head = next(lines, (1, []))
    keys, units = [], []
    for cell in head:
        found = _HEAD.fullmatch(cell)
        if found is None:
            text = "expected a key of the case, such as bodies.plate.thickness [mm]"
            problems.append(_problem(path, first, cell, text))
        elif found["key"] in keys:
            problems.append(_problem(path, first, cell, "this key has two columns"))
        else:
            keys.append(found["key"])
            units.append(found["unit"] or "")
    numbers, rows = [], []
    for number, cells in lines:
        if len(cells) != len(head):
            text = f"expected {len(head)} cells, as in line {first}; found {len(cells)}"
            problems.append(Problem(text, file=str(path), line=number))
        numbers.append(number)
        rows.append(cells)
    if not rows and not problems:
        problems.append(Problem("expected a line of keys and rows", file=str(path)))
    if len(rows) > MOST_ROWS:
        text = f"{len(rows)} rows; expected at most {MOST_ROWS}"
        problems.append(Problem(text, file=str(path)))
    if problems:
        raise CaseError(problems[:MOST_MISTAKES])
    values = [tuple(map(_value, cells)) for cells in zip(*rows, strict=True)]
    columns = map(Design, _names(keys), keys, units, values)
    return Designs(path, tuple(columns), tuple(numbers))


def _problem(path: Path, line: int, cell: str, expected: str) -> Problem:
    shown = printable(cell, _LONGEST)
    return Problem(expected, file=str(path), line=line, value=f'"{shown}"')


def csv_lines(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Return the lines of a table that hold anything, with their numbers, as cells.

    Cells are separated by commas, semicolons or tabs, whichever the first line has most
    of; lines that begin with ``#`` are left out.

    Raises
    ------
    CaseError
        If the file cannot be read.
    """
    try:
        if path.exists() and not path.is_file():
            raise CaseError([Problem("is no file", file=str(path))])
        text = path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise CaseError([Problem("no such file", file=str(path))]) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "it is no UTF-8"
        raise CaseError(
            [Problem(f"cannot be read: {reason}", file=str(path))]
        ) from None
    lines = text.splitlines()
    kept = [
        (k, line)
        for k, line in enumerate(lines, 1)
        if line.strip() and not line.startswith("#")
    ]
    head = kept[0][1] if kept else ""
    separator = max(",;\t", key=head.count)
    for number, line in kept:
        try:
            (cells,) = csv.reader([line], delimiter=separator)
        except csv.Error as error:
            raise CaseError([Problem(str(error), str(path), number)]) from None
        yield number, [cell.strip() for cell in cells]


def _value(cell: str) -> bool | int | float | str:
    """Return a cell as a case file would give it."""
    if cell in {"true", "false"}:
        return cell == "true"
    for kind in (int, float):
        try:
            value = kind(cell)
        except ValueError:
            continue
        if math.isfinite(value):
            return value
    return cell


def _names(keys: list[str]) -> list[str]:
    """Return the shortest ends of keys by which they differ, as names."""
    parts = [key.split(".") for key in keys]
    longest = max(map(len, parts), default=1)
    names = keys
    for k in range(1, longest + 1):
        names = ["_".join(part[-k:]) for part in parts]
        if len(set(names)) == len(names) and all(n[:1].isalpha() for n in names):
            break
    return names
