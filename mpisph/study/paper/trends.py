"""Checks of figures along a parameter: whether they fall, grow, or hardly change."""

import itertools
import statistics
from collections.abc import Sequence
from typing import Any, NamedTuple

from mpisph.study.model import Study
from mpisph.study.paper.claims_file import Try, settings_of
from mpisph.study.paper.verdict import (
    Verdict,
    figure_of,
    is_stable,
    limit_of,
    span_text,
    unit_of,
    word_of,
)
from mpisph.study.table import Row


def check_falls(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns fall from each value of the parameter to the next.

    `limit` is the share of the steps that must fall. In part: more than half do.
    """
    return _monotone(attempt, rows, -1.0)


def check_grows(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns grow from each value of the parameter to the next.

    `limit` is the share of the steps that must grow. In part: more than half do.
    """
    return _monotone(attempt, rows, 1.0)


def _monotone(attempt: Try, rows: Sequence[Row], sign: float) -> Verdict:
    lines = _lines(attempt, rows, least=2)
    if not lines.whole:
        return lines.undecided()
    pairs = [pair for line in lines.whole for pair in itertools.pairwise(line)]
    good = sum(sign * (b - a) > 0.0 for a, b in pairs)
    changes = [100.0 * (line[-1] / line[0] - 1.0) for line in lines.whole if line[0]]
    share = good / len(pairs)
    verb = "grows" if sign > 0.0 else "falls"
    return Verdict(
        word_of(share >= limit_of(attempt) and not lines.short, share > 0.5),
        f"{verb} in {good} of {len(pairs)} steps; from the first value to the last by "
        f"{span_text(changes)} %{lines.shortage()}",
    )


def check_grows_by_less(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether the columns grow along the parameter, each time by less.

    In part: they grow from the first to the last, by less in the second half.
    """
    lines = _lines(attempt, rows, least=3)
    if not lines.whole:
        return lines.undecided()
    steps = [[b - a for a, b in itertools.pairwise(line)] for line in lines.whole]
    good = all(0.0 < b < a for line in steps for a, b in itertools.pairwise(line))
    partly = all(0.0 < sum(s[-(len(s) // 2) :]) < sum(s[: len(s) // 2]) for s in steps)
    texts = [", ".join(f"{step:+.2f}" for step in line) for line in steps]
    return Verdict(
        word_of(good and not lines.short, partly),
        f"steps of {'; '.join(texts)}{unit_of(attempt)}{lines.shortage()}",
    )


def check_step(attempt: Try, _: Study, rows: Sequence[Row]) -> Verdict:
    """Whether only the steps of the regions are unstable, and the step hardly matters.

    `limit` is the largest change of a column along the parameter [%], among the stable
    cases. In part: one of the two holds.
    """
    lines = _lines(attempt, rows, least=2)
    spreads = [
        100.0 * (max(line) / min(line) - 1.0) for line in lines.whole if min(line) > 0.0
    ]
    if not spreads:
        return lines.undecided()
    broken = [row for row in rows if not is_stable(row)]
    as_claimed = all(any(c.holds(row) for c in attempt.regions) for row in broken)
    middle, largest = statistics.median(spreads), max(spreads)
    little, some = middle <= limit_of(attempt), bool(broken) and as_claimed
    return Verdict(
        word_of(some and little and not lines.short, some or little),
        f"{len(broken)} of {len(rows)} cases are unstable, "
        f"{'none' if as_claimed else 'some'} at other steps than claimed; the step "
        f"moves the columns by {middle:.1f} % (median), {largest:.1f} % (largest)"
        f"{lines.shortage()}",
    )


class _Lines(NamedTuple):
    """Figures along a parameter, a line for each combination of the others.

    Attributes
    ----------
    whole : list of list of float
        The lines that have values enough.
    short : int
        How many have too few.
    least : int
        How many values are enough.
    """

    whole: list[list[float]]
    short: int
    least: int

    def shortage(self) -> str:
        """Return how many lines are too short, as the end of a sentence."""
        if not self.short:
            return ""
        lines, verb = len(self.whole) + self.short, "has" if self.short == 1 else "have"
        return f"; {self.short} of {lines} lines {verb} too few stable cases"

    def undecided(self) -> Verdict:
        """Return the verdict where no line has values enough."""
        least = {2: "two", 3: "three"}[self.least]
        return Verdict("undecided", f"fewer than {least} stable cases on every line")


def _lines(attempt: Try, rows: Sequence[Row], least: int) -> _Lines:
    """Return the columns along the parameter for each combination of the others."""
    rest = [name for name in settings_of(rows) if name != attempt.along]
    groups: dict[tuple[Any, ...], list[Row]] = {}
    for row in sorted(rows, key=lambda row: row[attempt.along or "case"]):
        groups.setdefault(tuple(row[name] for name in rest), []).append(row)
    lines = [
        [x for row in group if (x := figure_of(row, column)) is not None]
        for group in groups.values()
        for column in attempt.columns
    ]
    whole = [line for line in lines if len(line) >= least]
    return _Lines(whole, len(lines) - len(whole), least)
