"""What the runs of tests have come to, and the table of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from mpisph.case.plausibility import find_warnings
from mpisph.io.verdict import FAILED, Outcome, WallRecord
from mpisph.study.assess.cases import Assessment
from mpisph.study.assess.published import PublishedTest
from mpisph.study.columns import WALL_FIGURES
from mpisph.study.store import Standing, case_folder, look_up
from mpisph.study.table import Row, run_result, wall_columns

__all__ = ["TABLE_FILE", "Assessed", "assess", "table_rows"]

TABLE_FILE = "assess.csv"

_ENDED = ("completed", "unstable", "failed")


class Assessed(NamedTuple):
    """A test with what its run says of it.

    Attributes
    ----------
    test : PublishedTest
    standing : str
        Of the run, as studies have it; ``refused`` where there can be none.
    outcome : str
        The verdict; ``undecided`` without one.
    reason : str
        What decides it, or why there is none.
    folder : Path or None
        Of the run; None where there can be none.
    damage : float or None
        The figure that decides over its critical value; None without a completed run.
    wall : WallRecord or None
        The wall at the end.
    rest_time : float or None
        Time at which it has come to rest [s].
    seconds : float or None
        Wall time of the run [s].
    version, revision : str or None
        Of the program that made the run.
    warnings : tuple of str
        What makes the case doubtful, as before any run.
    """

    test: PublishedTest
    standing: Standing | str
    outcome: Outcome
    reason: str
    folder: Path | None
    damage: float | None = None
    wall: WallRecord | None = None
    rest_time: float | None = None
    seconds: float | None = None
    version: str | None = None
    revision: str | None = None
    warnings: tuple[str, ...] = ()

    @property
    def ended(self) -> bool:
        """Whether the run has come to an end, or can never be."""
        return self.standing in (*_ENDED, "refused")

    @property
    def fails(self) -> bool | None:
        """Whether the wall fails by the verdict; None where it is undecided."""
        return None if self.outcome == "undecided" else self.outcome in FAILED

    @property
    def distance(self) -> float:
        """How far the damage is from its critical value, as the logarithm's size."""
        if self.damage is None:
            return 0.0
        return math.inf if self.damage <= 0.0 else abs(math.log(self.damage))


def assess(assessment: Assessment, root: Path) -> list[Assessed]:
    """Return what has become of each test, as far as the runs have come.

    Parameters
    ----------
    assessment : Assessment
    root : Path
        See `store`.

    Raises
    ------
    MpisphError
        If a file of a run cannot be understood.
    OSError
        If it cannot be read.
    """
    computed = iter(assessment.study.cases)
    found = []
    for test in assessment.tests:
        why = assessment.refused.get(test.row)
        if why is None:
            case = next(computed)
            item = _assessed(test, case_folder(root, case))
            found.append(item._replace(warnings=tuple(find_warnings(case.case))))
        else:
            found.append(_without(test, "refused", why, None))
    return found


def _without(
    test: PublishedTest, standing: str, why: str, folder: Path | None
) -> Assessed:
    return Assessed(test, standing, "undecided", why, folder)


def _assessed(test: PublishedTest, folder: Path) -> Assessed:
    place = look_up(folder)
    if place.standing not in {"completed", "unstable"}:
        return _without(test, place.standing, place.reason, folder)
    result = run_result(folder)
    verdict = result.verdict
    if verdict is None:
        return _without(test, place.standing, "the run has no verdict", folder)
    complete = place.standing == "completed" and verdict.wall is not None
    return Assessed(
        test=test,
        standing=place.standing,
        outcome=verdict.outcome,
        reason=verdict.reason,
        damage=verdict.damage if complete else None,
        wall=verdict.wall,
        rest_time=verdict.rest_time,
        seconds=result.timing.wall,
        version=result.versions.get("mpisph"),
        revision=result.revision,
        folder=folder,
    )


def table_rows(tests: Sequence[Assessed]) -> list[Row]:
    """Return the table of tests, a row for each, as it is written as CSV.

    Lengths are in mm, masses in g, times in us; a column's name ends with its unit.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    return [_table_row(test) for test in tests]


def _table_row(item: Assessed) -> Row:
    test, shield, wall = item.test, item.test.shield, item.wall
    row: Row = {
        "row": test.row,
        "source": test.source,
        "shot": test.shot,
        "projectile": test.projectile.card,
        "bumper": test.bumper.card,
        "wall": test.wall.card,
        "diameter_mm": _rounded(1e3 * test.diameter),
        "velocity_km_per_s": _rounded(1e-3 * test.velocity),
        "bumper_mm": _rounded(1e3 * shield.bumper_thickness),
        "standoff_mm": _rounded(1e3 * shield.standoff),
        "wall_mm": _rounded(1e3 * shield.wall_thickness),
        "result": _letters(test.failed),
        "verdict": item.outcome if item.ended else None,
        "computed": _letters(item.fails) if item.ended else None,
        "damage": item.damage,
        "d_over_dc": test.ratio,
        "equation": _letters(test.ratio > 1.0),
        "status": item.standing,
        "reason": item.reason or None,
    }
    figures: Row = dict.fromkeys(_WALL)
    if wall is not None:
        figures = {**wall_columns(wall, _WALL)}
    rest = None if item.rest_time is None else 1e6 * item.rest_time
    folder = None if item.folder is None else item.folder.name
    end = {
        "wall_rest_us": rest,
        "wall_s": item.seconds,
        "run": folder,
        "warnings": "; ".join(item.warnings) or None,
    }
    return row | figures | end


_WALL = {
    **WALL_FIGURES,
    "wall_detached_kg_m_per_s": ("detached_momentum", 1.0),
    "wall_velocity_m_per_s": ("velocity", 1.0),
    "wall_time_us": ("time", 1e6),
}
"""Columns of the wall at the end of a run: the field of its record, and the factor."""


def _letters(failed: bool | None) -> str:
    """Return a result as reports of tests give it."""
    if failed is None:
        return "undecided"
    return "P" if failed else "NP"


def _rounded(value: float) -> float:
    return float(f"{value:.12g}")
