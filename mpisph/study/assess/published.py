"""Published tests of Whipple shields: a CSV file, a test in each row."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from pydantic_core import PydanticCustomError

from mpisph.analysis.ballistic import Whipple, critical_diameter
from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import MOST_MISTAKES
from mpisph.inputs.printing import printable
from mpisph.inputs.quantities import is_quantity, si_value
from mpisph.inputs.spelling import nearest
from mpisph.materials.alloys import KSI, Alloy, alloys, find_alloy
from mpisph.materials.library import load_card
from mpisph.study.designs import MOST_ROWS, csv_lines

__all__ = ["PublishedTest", "chosen_tests", "read_tests"]

_LONGEST = 80


class PublishedTest(NamedTuple):
    """A test of a shield of one bumper, at normal incidence.

    Attributes
    ----------
    line : int
        In the file.
    row, source, shot : str
        Its number, the report, and the number that the report gives it.
    projectile, bumper, wall : Alloy
    diameter : float
        Of the projectile [m].
    velocity : float
        Of the impact [m/s].
    shield : Whipple
    failed : bool
        Whether the wall was perforated or lost spall (P), or held (NP).
    """

    line: int
    row: str
    source: str
    shot: str
    projectile: Alloy
    bumper: Alloy
    wall: Alloy
    diameter: float
    velocity: float
    shield: Whipple
    failed: bool

    @property
    def name(self) -> str:
        """Source and shot, for people."""
        return " ".join(part for part in (self.source, self.shot) if part) or self.row

    @property
    def ratio(self) -> float:
        """Diameter over the critical one by Christiansen's equation; > 1 fails."""
        return self.diameter / float(critical_diameter(self.shield, self.velocity))


class _Quantity(NamedTuple):
    """What a column of numbers holds."""

    unit: str
    si: str
    low: float
    high: float


_LENGTH = _Quantity("cm", "m", 1e-6, 10.0)
_DENSITY = _Quantity("g/cm^3", "kg/m^3", 100.0, 30e3)

_QUANTITIES = {
    "proj_density": _DENSITY,
    "proj_diam": _LENGTH,
    "velocity": _Quantity("km/s", "m/s", 50.0, 100e3),
    "bumper_density": _DENSITY,
    "bumper_thick": _LENGTH,
    "standoff": _LENGTH,
    "wall_density": _DENSITY,
    "wall_yield": _Quantity("ksi", "Pa", 1e6, 10e9),
    "wall_thick": _LENGTH,
}
"""Columns of numbers, with the unit where the head gives none, and bounds in SI that
keep out slips of units."""

_ALLOYS = ("proj_mat", "bumper_mat", "wall_mat")
_NAMES = ("row", "source", "shotid")
_RESULTS = {"np": False, "holds": False, "p": True, "fails": True}

_OPTIONAL = {
    *_NAMES,
    "proj_density",
    "bumper_density",
    "wall_density",
    "wall_yield",
}

_ANGLES = re.compile(r"(?:impact[ _]?)?angle|obliquity|theta|incidence")
_FURTHER = re.compile(r"bumper[ _]?\d.*|second[ _]bumper.*")
_SOFT = re.compile(
    r"nextel|kevlar|fabric|cloth|mesh|mli|foam|honeycomb|ceramic|composite|cfrp", re.I
)
_HEAD = re.compile(r"(?P<name>[^\[\]]*?)\s*(?:\[(?P<unit>[^\[\]]*)\])?")

_DENSITY_MARGIN = 0.1
"""Greatest relative difference of a density from that of the card."""


class _Row:
    """The cells of a line by column, and what is wrong with them."""

    def __init__(
        self,
        path: Path,
        line: int,
        cells: Mapping[str, str],
        units: Mapping[str, str],
    ) -> None:
        self._place: dict[str, Any] = {"file": str(path), "line": line}
        self._cells = cells
        self._units = units
        self.problems: list[Problem] = []
        self.names_unknown_alloys = False

    def refuse(self, name: str, expected: str, guess: str | None = None) -> None:
        """Note what is wrong with a cell."""
        shown = f'"{printable(self._cells.get(name, ""), _LONGEST)}"'
        self.problems.append(
            Problem(expected, key=name, value=shown, suggestion=guess, **self._place)
        )

    def text(self, name: str) -> str:
        """Return a cell as it stands; empty where there is none."""
        return self._cells.get(name, "")

    def number(self, name: str) -> float | None:
        """Return a number in SI; None where there is none or it is refused."""
        cell, kind = self.text(name), _QUANTITIES[name]
        if not cell:
            if name not in _OPTIONAL:
                self.refuse(name, f"expected a number, in {self._unit(name)}")
            return None
        try:
            has_unit = is_quantity(cell) and not _is_number(cell)
            written = cell if has_unit else f"{cell} {self._unit(name)}"
            value = si_value(written, kind.si)
        except PydanticCustomError:
            expected = f"expected a number, in {self._unit(name)}"
            self.refuse(name, expected)
            return None
        if not kind.low <= value <= kind.high:
            text = f"{value:g} {kind.si}: expected {kind.low:g} to {kind.high:g}"
            self.refuse(name, f"{text}; is the unit {self._unit(name)}?")
            return None
        return value

    def _unit(self, name: str) -> str:
        return self._units.get(name) or _QUANTITIES[name].unit

    def alloy(self, name: str) -> Alloy | None:
        """Return the alloy that a cell names; None where it is refused."""
        cell = self.text(name)
        alloy = find_alloy(cell) if cell else None
        if alloy is None:
            if _SOFT.search(cell):
                text = "no plate of metal: fabrics, foams and the like have no card"
            else:
                text = "expected an alloy or a material card, listed below"
            guess = nearest(cell, [a.name for a in alloys()])
            self.refuse(name, text, guess)
            self.names_unknown_alloys = True
        return alloy

    def density(self, name: str, alloy: Alloy | None) -> float:
        """Return a density [kg/m^3]; that of the card where none is given."""
        value = self.number(name)
        if alloy is None:
            return value or 1.0
        card = load_card(alloy.card).rho0
        if value is None:
            return card
        if abs(value / card - 1.0) > _DENSITY_MARGIN:
            self.refuse(name, f"{alloy.name} has {card:g} kg/m^3")
        return value

    def strength(self, alloy: Alloy | None) -> float:
        """Return the yield of the wall [Pa]; that of its alloy where none is given."""
        value = self.number("wall_yield")
        if value is None and alloy is not None:
            value = alloy.yield_strength
            if value is None and not self.text("wall_yield"):
                self.refuse("wall_yield", f"expected a number: none is listed for "
                            f"{alloy.name}")  # fmt: skip
        return value or KSI

    def result(self) -> bool:
        """Return whether the wall failed."""
        found = _RESULTS.get(self.text("result").casefold())
        if found is None:
            self.refuse("result", "expected P (failed) or NP (held)")
        return bool(found)

    def refuse_what_is_not_computed(self) -> None:
        """Note oblique impacts and further bumpers."""
        for name, cell in self._cells.items():
            if _ANGLES.fullmatch(name) and cell and not _is_zero(cell):
                text = "oblique: expected 0; only impacts along the axis are computed"
                self.refuse(name, text)
            if _FURTHER.fullmatch(name) and cell and not _is_zero(cell):
                self.refuse(name, "expected a shield of one bumper")


def read_tests(path: Path) -> tuple[PublishedTest, ...]:
    """Read a file of tests.

    Its first line names the columns, in any order: ``row``, ``source``, ``shotID``,
    ``proj_mat``, ``proj_density``, ``proj_diam``, ``velocity``, ``bumper_mat``,
    ``bumper_density``, ``bumper_thick``, ``standoff``, ``wall_mat``, ``wall_density``,
    ``wall_yield``, ``wall_thick`` and ``result`` (P: failed, NP: held). Numbers are in
    cm, g/cm3, km/s and ksi, or in the unit that the name has in brackets:
    ``velocity [m/s]``. The first three, the densities and the yield may be left out.
    Other columns are ignored, but for angles, which must be zero, and second bumpers.

    Parameters
    ----------
    path : Path

    Returns
    -------
    tuple of PublishedTest

    Raises
    ------
    CaseError
        With all that is wrong, by line and column.
    """
    lines = list(csv_lines(path))
    if len(lines) < 2:
        raise CaseError([Problem("expected a line of names and tests", str(path))])
    if len(lines) > MOST_ROWS + 1:
        text = f"{len(lines) - 1} tests; expected at most {MOST_ROWS}"
        raise CaseError([Problem(text, str(path))])
    names, units = _columns(path, *lines[0])
    tests, problems, seen = [], [], dict[str, int]()
    unknown_alloys = False
    for number, (line, cells) in enumerate(lines[1:], 1):
        if len(cells) != len(names):
            text = f"expected {len(names)} cells, found {len(cells)}"
            problems.append(Problem(text, file=str(path), line=line))
            continue
        row = _Row(path, line, dict(zip(names, cells, strict=True)), units)
        test = _test(row, line, number)
        if test.row in seen:
            row.refuse("row", f"line {seen[test.row]} has the same number")
        seen[test.row] = line
        problems += row.problems
        unknown_alloys |= row.names_unknown_alloys
        tests.append(test)
    if problems:
        more = len(problems) - MOST_MISTAKES
        if more > 0:
            rest = Problem(f"{more} more mistakes", file=str(path))
            problems = [*problems[:MOST_MISTAKES], rest]
        if unknown_alloys:
            listed = ", ".join(alloy.name for alloy in alloys())
            text = f"alloys are {listed}; cards: see mpisph materials"
            problems.append(Problem(text))
        raise CaseError(problems)
    return tuple(tests)


def _columns(
    path: Path, line: int, head: Sequence[str]
) -> tuple[list[str], dict[str, str]]:
    """Return the names of the columns, and the units that they give."""
    names, units, problems = [], {}, []
    known = [*_NAMES, *_ALLOYS, *_QUANTITIES, "result"]
    for cell in head:
        found = _HEAD.fullmatch(cell)
        name = (found["name"] if found else cell).strip().casefold()
        shown = f'"{printable(cell, _LONGEST)}"'
        place: dict[str, Any] = {"file": str(path), "line": line, "value": shown}
        if name in names and name in known:
            problems.append(Problem("this column stands there twice", **place))
        names.append(name)
        unit = found["unit"] if found else None
        if unit is None or name not in _QUANTITIES:
            continue
        units[name] = unit
        try:
            si_value(f"1 {unit}", _QUANTITIES[name].si)
        except PydanticCustomError as error:
            problems.append(Problem(error.message(), **place))
    for name in known:
        if name not in names and name not in _OPTIONAL:
            guess = nearest(name, [n for n in names if n not in known])
            text = f"expected a column {name}"
            problems.append(
                Problem(text, file=str(path), line=line, suggestion=None)
                if guess is None
                else Problem(f"{text}; is {guess} that?", file=str(path), line=line)
            )
    if problems:
        raise CaseError(problems)
    return names, units


def _test(row: _Row, line: int, number: int) -> PublishedTest:
    """Return the test of a line; its figures mean nothing where it has problems."""
    row.refuse_what_is_not_computed()
    projectile, bumper, wall = (row.alloy(name) for name in _ALLOYS)
    shield = Whipple(
        bumper_thickness=row.number("bumper_thick") or 1.0,
        bumper_density=row.density("bumper_density", bumper),
        standoff=row.number("standoff") or 1.0,
        wall_thickness=row.number("wall_thick") or 1.0,
        wall_yield=row.strength(wall),
        projectile_density=row.density("proj_density", projectile),
    )
    row.density("wall_density", wall)
    unknown = Alloy("", "", "", None)
    return PublishedTest(
        line=line,
        row=printable(row.text("row"), _LONGEST) or str(number),
        source=printable(row.text("source"), _LONGEST),
        shot=printable(row.text("shotid"), _LONGEST),
        projectile=projectile or unknown,
        bumper=bumper or unknown,
        wall=wall or unknown,
        diameter=row.number("proj_diam") or 1.0,
        velocity=row.number("velocity") or 1.0,
        shield=shield,
        failed=row.result(),
    )


def chosen_tests(
    tests: Sequence[PublishedTest], rows: str | None
) -> tuple[PublishedTest, ...]:
    """Return the tests of some numbers, in the order of the file.

    Parameters
    ----------
    tests : sequence of PublishedTest
    rows : str or None
        Such as ``2,4,13`` or ``10-20``; None takes all.

    Raises
    ------
    CaseError
        If a number is none of the file.
    """
    if rows is None:
        return tuple(tests)
    wanted: set[str] = set()
    known = {test.row for test in tests}
    problems = []
    for part in filter(None, (part.strip() for part in rows.split(","))):
        span = re.fullmatch(r"(\d+)-(\d+)", part)
        inside = _numbered(known, int(span[1]), int(span[2])) if span else {part}
        if not inside & known:
            text = "expected numbers of the column row, such as 2,4,13 or 10-20"
            problems.append(Problem(text, value=f'"{printable(part, _LONGEST)}"'))
        wanted |= inside
    if problems or not wanted:
        raise CaseError(problems or [Problem("expected numbers of rows, such as 2,4")])
    return tuple(test for test in tests if test.row in wanted)


def _numbered(names: set[str], low: int, high: int) -> set[str]:
    return {n for n in names if n.isdecimal() and low <= int(n) <= high}


def _is_number(cell: str) -> bool:
    return _converts(cell, float) is not None


def _is_zero(cell: str) -> bool:
    value = _converts(cell.split()[0], float)
    return value == 0.0


def _converts(cell: str, kind: Callable[[str], float]) -> float | None:
    try:
        return kind(cell)
    except ValueError:
        return None
