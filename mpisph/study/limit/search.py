"""Where to look next for the limit between what holds and what fails.

A severity is the logarithm of the quantity that is sought, with the sign by which more
is harder to stop, so that one search serves diameters, velocities and thicknesses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

from mpisph.io.verdict import FAILED, Outcome

__all__ = [
    "MOST_TRIALS",
    "Bracket",
    "bracket",
    "next_severities",
    "severity",
    "value_of",
]

MOST_TRIALS = 16
"""Runs of one point, at most."""

_WIDEN = math.log(1.25)
"""First step beyond what was tried, where all of it holds or all fails; it doubles."""


class Bracket(NamedTuple):
    """Between which severities the limit lies.

    Attributes
    ----------
    holds, fails : float or None
        The hardest that holds below all that fail, and the easiest that fails; None
        where there is none.
    undecided : tuple of float
        Severities between them that are undecided, rising.
    holds_above : tuple of float
        Severities beyond the easiest that fails, which hold all the same.
    """

    holds: float | None
    fails: float | None
    undecided: tuple[float, ...]
    holds_above: tuple[float, ...]


def bracket(trials: Mapping[float, Outcome]) -> Bracket:
    """Return between which severities the limit lies.

    Parameters
    ----------
    trials : mapping of float to str
        Verdicts by severity.
    """
    failing = [x for x, outcome in trials.items() if outcome in FAILED]
    holding = [x for x, outcome in trials.items() if outcome == "holds"]
    fails = min(failing, default=None)
    below = [x for x in holding if fails is None or x < fails]
    holds = max(below, default=None)
    low = -math.inf if holds is None else holds
    high = math.inf if fails is None else fails
    undecided = [x for x, outcome in trials.items() if outcome == "undecided"]
    return Bracket(
        holds,
        fails,
        tuple(sorted(x for x in undecided if low < x < high)),
        tuple(sorted(set(holding) - set(below))),
    )


def next_severities(
    trials: Mapping[float, Outcome], guess: float, width: float, count: int = 1
) -> list[float]:
    """Return the severities to try next.

    Parameters
    ----------
    trials : mapping of float to str
        Verdicts by severity.
    guess : float
        Where to begin.
    width : float
        Width of the bracket that is wanted.
    count : int, optional
        How many can be tried side by side.

    Returns
    -------
    list of float
        Empty where the bracket is narrow enough, or nothing more can be found: up to an
        undecided severity on either side, or after `MOST_TRIALS`.
    """
    count = min(count, MOST_TRIALS - len(trials))
    if count <= 0:
        return []
    if not trials:
        return [guess]
    found = bracket(trials)
    if found.holds is None or found.fails is None:
        return _beyond(trials, found, count)
    edges = [found.holds, *found.undecided, found.fails]
    if len(edges) == 2:
        return _between(edges[0], edges[1], width, count)
    # What is undecided stays: the bracket closes in on it from both sides.
    below = _between(edges[0], edges[1], width, 1)
    above = _between(edges[-2], edges[-1], width, 1)
    return (below + above)[:count]


def _beyond(trials: Mapping[float, Outcome], found: Bracket, count: int) -> list[float]:
    """Return severities beyond all that were tried, where one side is missing."""
    ordered = sorted(trials)
    step = max(_WIDEN, 2.0 * (ordered[-1] - ordered[0]))
    low, high = [ordered[0] - step], [ordered[-1] + step]
    if found.fails is not None:
        return low
    if found.holds is not None:
        return high
    return (low + high)[:count]


def _between(low: float, high: float, width: float, count: int) -> list[float]:
    """Return places that divide a gap evenly, none where it is narrow enough."""
    if high - low <= width * (1.0 + 1e-9):
        return []
    step = (high - low) / (count + 1)
    return [low + step * (k + 1) for k in range(count)]


def severity(value: float, harder: int) -> float:
    """Return the severity of a positive value; `harder` is 1, or -1 where less is."""
    return harder * math.log(value)


def value_of(at: float, harder: int) -> float:
    """Return the value of a severity, to four digits."""
    return float(f"{math.exp(harder * at):.4g}")
