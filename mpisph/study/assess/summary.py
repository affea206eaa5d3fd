"""The tables of an assessment, for terminal and page alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from mpisph.materials.alloys import Alloy, alloys
from mpisph.study.assess.outcome import Assessed
from mpisph.study.assess.scores import (
    Confusion,
    Score,
    by_source,
    by_velocity,
    confusion,
    misses,
    undecided,
)

__all__ = [
    "Sheet",
    "all_sheet",
    "alloy_sheet",
    "as_text",
    "confusion_sheet",
    "misses_sheet",
    "shares_sheet",
    "sources_sheet",
    "stand_in_sheet",
    "summary_text",
    "undecided_sheet",
]

_NONE = "–"


class Sheet(NamedTuple):
    """A table of words.

    Attributes
    ----------
    title : str
    heads : tuple of str
    rows : sequence of tuple of str
    words : tuple of int
        Columns that hold words, besides the first.
    caption : str, optional
    """

    title: str
    heads: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    words: tuple[int, ...] = ()
    caption: str = ""


def shares_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return the shares of right verdicts by velocity, beside the equation's.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    rows = [(name, *_shares(found)) for name, found in by_velocity(tests).items()]
    return Sheet(
        "Share right",
        (
            "velocity", "tests", "right", "of the decided", "undecided",
            "equation right", "ROC area", "equation’s",
        ),
        rows,
        caption="Undecided counts as wrong in “right”. The equation is Christiansen’s "
        "(1993). ROC area: the chance that of a failed and a held test the failed one "
        "has the larger damage, or the larger d/d_c by the equation; 1 is perfect, "
        "0.5 is chance.",
    )  # fmt: skip


def _shares(found: Score) -> tuple[str, ...]:
    return (
        f"{found.tests}",
        _percent(found.share),
        _percent(found.share_of_decided),
        f"{found.undecided}",
        _percent(found.equation_share),
        _area(found.damage_area),
        _area(found.equation_area),
    )


def sources_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return the number of right verdicts by report, beside the equation's.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    rows = [
        (
            source or _NONE,
            f"{found.tests}",
            f"{found.right}",
            f"{found.undecided}",
            f"{found.equation_right}",
        )
        for source, found in by_source(tests).items()
    ]
    heads = ("report", "tests", "right", "undecided", "equation right")
    return Sheet("By report", heads, rows)


def confusion_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return how often what was predicted for which result.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    ended = [t for t in tests if t.ended]
    ours = confusion((t.test.failed, t.fails) for t in ended)
    theirs = confusion((t.test.failed, t.test.ratio > 1.0) for t in ended)
    rows = [
        ("held (NP)", *_counts(ours, theirs, failed=False)),
        ("failed (P)", *_counts(ours, theirs, failed=True)),
    ]
    heads = (
        "test", "holds", "fails", "undecided", "equation: holds", "equation: fails",
    )  # fmt: skip
    return Sheet("Verdicts by result", heads, rows)


def _counts(ours: Confusion, theirs: Confusion, failed: bool) -> tuple[str, ...]:
    mine = ours.failed if failed else ours.held
    other = theirs.failed if failed else theirs.held
    return tuple(map(str, (*mine, *other[:2])))


_TEST_HEADS = (
    "row", "test", "d [mm]", "v [km/s]", "bumper [mm]", "standoff [mm]", "wall [mm]",
    "result", "verdict", "damage", "d/d_c",
)  # fmt: skip


def _test_cells(item: Assessed) -> tuple[str, ...]:
    test, shield = item.test, item.test.shield
    return (
        test.row,
        test.name,
        f"{1e3 * test.diameter:.3g}",
        f"{1e-3 * test.velocity:.2f}",
        f"{1e3 * shield.bumper_thickness:.3g}",
        f"{1e3 * shield.standoff:.3g}",
        f"{1e3 * shield.wall_thickness:.3g} {test.wall.name}",
        "P" if test.failed else "NP",
        _verdict(item),
        _NONE if item.damage is None else f"{item.damage:.2f}",
        f"{test.ratio:.2f}",
    )


def _verdict(item: Assessed) -> str:
    """Return the verdict, or how the run stands where it can have none."""
    if item.standing in {"completed", "unstable"}:
        return item.outcome
    return item.standing


def misses_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return the tests whose verdicts are wrong, the worst first.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    rows = [_test_cells(item) for item in misses(tests)]
    caption = "The farther the damage from 1, the worse the miss."
    return Sheet("Misses", _TEST_HEADS, rows, (1, 6, 7, 8), caption)


def all_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return all tests, in the order of the file.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    rows = [_test_cells(item) for item in tests]
    return Sheet("All tests", _TEST_HEADS, rows, (1, 6, 7, 8))


def undecided_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return the tests without a verdict, and why.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    rows = [
        (t.test.row, t.test.name, "P" if t.test.failed else "NP", t.standing, t.reason)
        for t in undecided(tests)
    ]
    heads = ("row", "test", "result", "run", "why")
    return Sheet("Undecided", heads, rows, (1, 2, 3, 4))


def alloy_sheet() -> Sheet:
    """Return the table of alloys with the cards that stand for them."""
    return _alloys("Alloys of tests", alloys())


def stand_in_sheet(tests: Sequence[Assessed]) -> Sheet:
    """Return those alloys of some tests for which another card stands.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    used = {a for t in tests for a in (t.test.projectile, t.test.bumper, t.test.wall)}
    return _alloys("Stand-ins", sorted(alloy for alloy in used if alloy.stand_in))


def _alloys(title: str, listed: Sequence[Alloy]) -> Sheet:
    rows = [
        (
            alloy.name,
            alloy.card,
            _NONE
            if alloy.yield_strength is None
            else f"{1e-6 * alloy.yield_strength:.0f}",
            alloy.stand_in or "its own card",
        )
        for alloy in listed
    ]
    heads = ("alloy", "card", "yield [MPa]", "why")
    return Sheet(title, heads, rows, (1, 2, 3))


def _percent(share: float) -> str:
    return _NONE if math.isnan(share) else f"{100.0 * share:.1f} %"


def _area(area: float) -> str:
    return _NONE if math.isnan(area) else f"{area:.3f}"


def as_text(sheet: Sheet, columns: Sequence[int] | None = None) -> str:
    """Return a table for a terminal: the title and aligned columns.

    Parameters
    ----------
    sheet : Sheet
    columns : sequence of int, optional
        Those that are shown; by default all.
    """
    chosen = range(len(sheet.heads)) if columns is None else columns
    left = {0, *sheet.words}
    lines = [[row[k] for k in chosen] for row in [sheet.heads, *sheet.rows]]
    widths = [max(map(len, cells)) for cells in zip(*lines, strict=True)]
    texts = [
        "  ".join(
            cell.ljust(width) if k in left else cell.rjust(width)
            for k, cell, width in zip(chosen, cells, widths, strict=True)
        ).rstrip()
        for cells in lines
    ]
    return "\n".join([sheet.title, *(f"  {text}" for text in texts)])


def summary_text(tests: Sequence[Assessed], most: int) -> str:
    """Return what a terminal shows of an assessment.

    Parameters
    ----------
    tests : sequence of Assessed
    most : int
        Misses and undecided tests that are named one by one.
    """
    parts = [
        as_text(sheet)
        for sheet in (confusion_sheet(tests), shares_sheet(tests), sources_sheet(tests))
    ]
    wrong, open_ = misses_sheet(tests), undecided_sheet(tests)
    for sheet, columns in ((wrong, _BRIEF), (open_, None)):
        if sheet.rows:
            shown = sheet._replace(rows=sheet.rows[:most])
            more = len(sheet.rows) - most
            rest = f"\n  and {more} more: see assess.html" if more > 0 else ""
            parts.append(as_text(shown, columns) + rest)
    return "\n\n".join(parts)


_BRIEF = (0, 1, 3, 7, 8, 9, 10)
# Columns of the misses on a terminal.
