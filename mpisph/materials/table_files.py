"""Files of tabulated equations of state, which cards and cases name (R20).

Two forms are read. A CSV file has a row for each density and temperature, below a
header with the units; SESAME's table 301 has the numbers of densities and temperatures,
both axes, and then pressures and energies, in its own units.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.printing import printable
from mpisph.inputs.quantities import si_value
from mpisph.physics.eos.table import LARGEST_CONTENT, States

TABLE = "table"
_LARGEST_FILE = 20_000_000
_LONGEST = 40

_UNITS = {"density": "kg/m^3", "temperature": "K", "pressure": "Pa", "energy": "J/kg"}
_HEADER = re.compile(r"([a-z]+)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?")

_SESAME_UNITS = (1e3, 1.0, 1e9, 1e6)
# Mg/m3, K, GPa and MJ/kg.

_DECIMAL = re.compile(
    r"[+-]?(?:[0-9]+\.[0-9]*|\.[0-9]+)(?:[EeDd][+-]?[0-9]+|[+-][0-9]{3}(?![0-9.]))?"
)
# Fortran leaves out the E before three digits, and the blank before a minus.

_FLAGS = re.compile(r"(?<=^.{75})[01]{5}\s*$")
# At the end of SESAME's lines of five words: which of them are there.

_RECORD = re.compile(r"\b301\b")


class _Table(NamedTuple):
    """A table as read: its states, and the lines on which their numbers stand."""

    states: States
    lines: States


class _MistakeError(Exception):
    """What is wrong with a file, and on which line."""

    def __init__(self, text: str, line: int | None = None) -> None:
        super().__init__(text)
        self.line = line


def embed_table(material: Any, folder: Path) -> Any:
    """Return a raw material with its table in the place of the file that it names.

    Parameters
    ----------
    material : mapping
        As read from TOML; what is malformed is left as it is.
    folder : Path
        From which the file counts.

    Raises
    ------
    CaseError
        If it cannot be read, or is no sound table; with file and line.
    """
    table = material.get(TABLE) if isinstance(material, Mapping) else None
    if not isinstance(table, Mapping):
        return material
    name = table.get("file")
    if not isinstance(name, str) or not name:
        return material
    states = read_table(folder / name)
    own = {key: value for key, value in table.items() if key not in {"file", "digest"}}
    sources = own.get("sources", {})
    if isinstance(sources, Mapping):
        own["sources"] = {"digest": Path(name).name[:_LONGEST], **sources}
    return {**material, TABLE: {**own, "content": states.packed()}}


def read_table(path: Path) -> States:
    """Read a table of pressures and energies.

    Parameters
    ----------
    path : Path
        A CSV file with a header, or SESAME's table 301 as text.

    Raises
    ------
    CaseError
        If it cannot be read, or is no sound table; with file and line.
    """
    try:
        table = _parse(_lines(path))
        mistake = table.states.mistake()
        if mistake is not None:
            text, place = mistake
            name = text.partition(":")[0]
            line = int(getattr(table.lines, name)[place]) if place else None
            raise _MistakeError(text, line)
        if len(table.states.packed()) > LARGEST_CONTENT:
            raise _MistakeError("is too large; leave out densities or temperatures")
    except _MistakeError as mistake:
        problem = Problem(str(mistake), file=str(path), line=mistake.line)
        raise CaseError([problem]) from None
    return table.states


def _lines(path: Path) -> list[str]:
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            content = file.read(_LARGEST_FILE + 1)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise _MistakeError(f"the table cannot be read: {reason}") from None
    if len(content) > _LARGEST_FILE:
        raise _MistakeError(f"is larger than {_LARGEST_FILE} bytes; expected a table")
    return content.decode("utf-8-sig", "replace").splitlines()


def _open_at_once(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK)  # a pipe would keep its reader


def _parse(lines: Sequence[str]) -> _Table:
    """Return the table of a text in either form."""
    numbered = [
        (number, line)
        for number, line in enumerate(lines, 1)
        if line.strip() and not line.lstrip().startswith("#")
    ]
    if not numbered:
        raise _MistakeError("holds no table")
    if "density" in numbered[0][1].lower():
        return _parse_csv(numbered)
    return _parse_sesame(numbered)


def _parse_csv(lines: Sequence[tuple[int, str]]) -> _Table:
    """Return the table of rows of density, temperature, pressure and energy."""
    columns = _columns(*lines[0])
    rows: list[list[float]] = []
    for number, line in lines[1:]:
        words = [word.strip() for word in line.split(",")]
        if len(words) != len(columns):
            text = f"expected {len(columns)} numbers with commas, found {len(words)}"
            raise _MistakeError(text, number)
        rows.append([_number(word, number) for word in words])
    if not rows:
        raise _MistakeError("no rows below the header", lines[0][0])
    table = dict(zip(columns, np.array(rows).T, strict=True))
    values = {name: table[name] * columns[name] for name in _UNITS}
    return _grid(values, np.array([number for number, _ in lines[1:]]))


def _columns(number: int, header: str) -> dict[str, float]:
    """Return the factors to SI of the columns, by their names in their order."""
    found: dict[str, float] = {}
    for word in header.split(","):
        match = _HEADER.fullmatch(word.strip().lower())
        name = match.group(1) if match else ""
        if match is None or name not in _UNITS or name in found:
            expected = ", ".join(f"{name} [{unit}]" for name, unit in _UNITS.items())
            raise _MistakeError(f"expected the columns {expected}", number)
        unit = word.strip()[match.start(2) : match.end(2)] if match.group(2) else ""
        try:
            found[name] = si_value(f"1 {unit}", _UNITS[name]) if unit else 1.0
        except ValueError as error:
            raise _MistakeError(f"{name}: {error}", number) from None
    missing = [name for name in _UNITS if name not in found]
    if missing:
        raise _MistakeError(f"no column {', '.join(missing)}", number)
    return found


def _number(word: str, line: int) -> float:
    try:
        return float(word)
    except ValueError:
        text = f"expected a number, found {printable(word, _LONGEST)!r}"
        raise _MistakeError(text, line) from None


def _grid(values: Mapping[str, Any], numbers: Any) -> _Table:
    """Put rows into a grid; they must be whole, and sorted."""
    starts = [0, *(np.flatnonzero(np.diff(values["density"])) + 1)]
    size = starts[1] if len(starts) > 1 else len(numbers)
    temperature = values["temperature"][:size]
    for first, end in zip(starts, [*starts[1:], len(numbers)], strict=True):
        theirs = values["temperature"][first:end]
        common = min(size, theirs.size)
        other = np.flatnonzero(theirs[:common] != temperature[:common])
        if other.size or theirs.size != size:
            at = int(other[0]) if other.size else common
            row = min(first + at, len(numbers) - 1)
            want = f"{temperature[at]:g} K" if at < size else "another density"
            found = f"{theirs[at]:g} K" if at < theirs.size else "another density"
            text = (
                f"the table has a hole: at {values['density'][first]:g} kg/m3 expected "
                f"{want}, found {found}"
            )
            raise _MistakeError(text, int(numbers[row]))
    shape = (len(starts), size)
    states = States(
        values["density"][starts],
        temperature,
        values["pressure"].reshape(shape),
        values["energy"].reshape(shape),
    )
    every = numbers.reshape(shape)
    return _Table(states, States(every[:, 0], every[0], every, every))


def _parse_sesame(lines: Sequence[tuple[int, str]]) -> _Table:
    """Return table 301: NR, NT, densities, temperatures, pressures, energies."""
    found = [pair for number, line in _record(lines) for pair in _words(number, line)]
    if len(found) < 2:
        raise _MistakeError("holds no numbers of densities and temperatures")
    words = np.array([word for word, _ in found])
    numbers = np.array([number for _, number in found])
    (n, m), places = words[:2], numbers
    if not (n == int(n) and m == int(m) and n > 0 and m > 0):
        text = f"expected the numbers of densities and temperatures, found {n:g}, {m:g}"
        raise _MistakeError(text, int(places[0]))
    n, m = int(n), int(m)
    least = 2 + n + m + 2 * n * m
    if not (words.size in range(least, least + 5) or words.size >= least + n * m):
        text = (
            f"{n} densities and {m} temperatures take {least} words, or "
            f"{least + n * m} with free energies; found {words.size}"
        )
        raise _MistakeError(text, int(places[-1]))
    ends = np.cumsum([2, n, m, n * m, n * m])

    def parts(values: Any) -> list[Any]:
        density, temperature, pressure, energy = (
            values[a:b] for a, b in pairwise(ends)
        )
        # The density runs fastest.
        return [
            density,
            temperature,
            pressure.reshape(m, n).T,
            energy.reshape(m, n).T,
        ]

    units = _SESAME_UNITS
    scaled = [part * unit for part, unit in zip(parts(words), units, strict=True)]
    return _Table(States(*scaled), States(*parts(numbers)))


def _record(lines: Sequence[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    """Return the lines of table 301; all, where none is named."""
    headers = [line for _, line in lines if not _DECIMAL.search(line)]
    named = any(_RECORD.search(line) for line in headers)
    inside = not named
    for number, line in lines:
        if not _DECIMAL.search(line) and (named or re.search("[A-Za-z]", line)):
            if "*" in line or re.search(r"\b(?:nan|inf)", line, re.I):
                raise _MistakeError("expected numbers", number)
            inside = bool(_RECORD.search(line)) if named else inside
        elif inside:
            yield number, line


def _words(number: int, line: str) -> Iterator[tuple[float, int]]:
    """Return the numbers of a line of SESAME, each with the number of the line."""
    line = _FLAGS.sub("", line)
    left = _DECIMAL.sub(" ", line).strip()
    if left:
        text = f"expected decimal numbers, found {printable(left, _LONGEST)!r}"
        raise _MistakeError(text, number)
    for word in _DECIMAL.findall(line):
        mantissa = re.sub("[Dd]", "E", word)
        yield float(re.sub(r"(?<=[0-9.])(?=[+-])", "E", mantissa)), number
