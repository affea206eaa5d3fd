"""What a search has found: the limit at each point, and its tables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from rich.table import Table

from mpisph.io.verdict import FAILED
from mpisph.study.limit.plan import Plan, equation_limit
from mpisph.study.limit.run import Judged, Search
from mpisph.study.limit.search import bracket, severity, value_of
from mpisph.study.table import Row

__all__ = ["LIMIT_FILE", "TRIES_FILE", "Limit", "limit_rows", "limit_table", "limits"]

LIMIT_FILE = "limit.csv"
TRIES_FILE = "tries.csv"


class Limit(NamedTuple):
    """The limit at a point, in SI.

    Attributes
    ----------
    at : float or None
        Value along the axis; None for that of the case.
    holds, fails : float or None
        The hardest that holds and the easiest that fails, next to the limit; None
        where none was found.
    undecided : tuple of float
        What is undecided between them.
    holds_beyond : tuple of float
        What holds beyond the easiest that fails.
    equation : float or None
        By Christiansen's equation.
    tries : list of Judged
    """

    at: float | None
    holds: float | None
    fails: float | None
    undecided: tuple[float, ...]
    holds_beyond: tuple[float, ...]
    equation: float | None
    tries: list[Judged]

    @property
    def middle(self) -> float | None:
        """Between what holds and what fails, in the middle by their ratio."""
        if self.holds is None or self.fails is None:
            return None
        return float((self.holds * self.fails) ** 0.5)

    def note(self) -> str:
        """Return what has to be said of it; empty for a plain limit."""
        if not self.tries:
            return "not run"
        if self.holds is None and self.fails is None:
            return "nothing is decided"
        if self.holds is None:
            return "nothing holds"
        if self.fails is None:
            return "nothing fails"
        if self.holds_beyond:
            return "holds beyond a failure too"
        return "undecided between" if self.undecided else ""


def limits(plan: Plan, found: Search) -> list[Limit]:
    """Return the limit at each point.

    Parameters
    ----------
    plan : Plan
    found : Search
    """
    return [_limit(plan, k, tries) for k, tries in enumerate(found.tries)]


def _limit(plan: Plan, point: int, tries: list[Judged]) -> Limit:
    harder = plan.find.harder
    values = {severity(j.trial.value, harder): j.trial.value for j in tries}
    known = bracket({severity(j.trial.value, harder): j.outcome for j in tries})
    return Limit(
        at=plan.points[point].at,
        holds=None if known.holds is None else values[known.holds],
        fails=None if known.fails is None else values[known.fails],
        undecided=tuple(value_of(x, harder) for x in known.undecided),
        holds_beyond=tuple(value_of(x, harder) for x in known.holds_above),
        equation=equation_limit(plan, point),
        tries=sorted(tries, key=lambda j: j.trial.value),
    )


def limit_rows(plan: Plan, found: Sequence[Limit]) -> tuple[list[Row], list[Row]]:
    """Return the tables of the limits and of all tries, in the units of their names.

    Parameters
    ----------
    plan : Plan
    found : sequence of Limit
    """
    find, along = plan.find, plan.along
    unit = find.unit.replace("/", "_per_")
    rows, tries = [], []
    for limit in found:
        place: Row = {}
        if along is not None and limit.at is not None:
            name = f"{along.name}_{along.unit.replace('/', '_per_')}"
            place[name] = _scaled(limit.at, along.scale)
        numbers = {
            "limit": limit.middle,
            "holds": limit.holds,
            "fails": limit.fails,
            "equation": limit.equation,
        }
        row = place | {
            f"{find.name}_{name}_{unit}": _scaled(value, find.scale)
            for name, value in numbers.items()
        }
        undecided = [_scaled(x, find.scale) for x in limit.undecided]
        row["undecided"] = " ".join(f"{x:g}" for x in undecided if x is not None)
        rows.append(row | {"runs": len(limit.tries), "note": limit.note()})
        tries += [
            place
            | {
                f"{find.name}_{unit}": _scaled(j.trial.value, find.scale),
                "verdict": j.outcome,
                "damage": j.damage,
                "reason": j.reason,
                "run": j.trial.key,
            }
            for j in limit.tries
        ]
    return rows, tries


def _scaled(value: float | None, scale: float) -> float | None:
    return None if value is None else float(f"{value / scale:.6g}")


def limit_table(plan: Plan, found: Sequence[Limit]) -> Table:
    """Return the limits for a terminal.

    Parameters
    ----------
    plan : Plan
    found : sequence of Limit
    """
    find, along = plan.find, plan.along
    table = Table(title=f"Limit: {find.label}, in {find.unit}")
    if along is not None:
        table.add_column(f"{along.label}, {along.unit}", justify="right")
    for name in ("holds", "fails", "equation"):
        table.add_column(name, justify="right")
    table.add_column("verdicts")
    table.add_column("note")
    for limit in found:
        values = (limit.holds, limit.fails, limit.equation)
        cells = ["-" if x is None else f"{x / find.scale:.4g}" for x in values]
        if along is not None and limit.at is not None:
            cells.insert(0, f"{limit.at / along.scale:g}")
        table.add_row(*cells, _counted(limit.tries), limit.note())
    return table


def _counted(tries: Sequence[Judged]) -> str:
    kinds = Counter("fail" if j.outcome in FAILED else j.outcome for j in tries)
    words = {"holds": "hold", "fail": "fail", "undecided": "undecided"}
    return ", ".join(f"{kinds[k]} {word}" for k, word in words.items() if kinds[k])
