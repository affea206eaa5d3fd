"""Where to look next for the limit between what holds and what fails.

A severity is the logarithm of the quantity that is sought, with the sign by which more
is harder to stop, so that one search serves diameters, velocities and thicknesses.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from mpisph.io.verdict import FAILED, Outcome

__all__ = [
    "MOST_TRIALS",
    "REACH",
    "Bracket",
    "bracket",
    "next_severities",
    "severity",
    "value_of",
]

MOST_TRIALS = 16
"""Runs of one point, at most."""

_WIDEN = math.log(1.25)
"""First step beyond what was tried, where all of it holds or all fails; further ones
are twice the way from the first value."""

REACH = 5.0
"""Nothing is tried beyond so many times the first value, or below its fraction."""


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
    trials: Mapping[float, Outcome],
    guess: float,
    width: float,
    count: int = 1,
    refused: Sequence[float] = (),
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
    refused : sequence of float, optional
        Severities that cannot be tried.

    Returns
    -------
    list of float
        Empty where the bracket is narrow enough, or nothing more can be found: up to
        what is undecided or refused on either side, at the end of the `REACH`, or after
        `MOST_TRIALS`.
    """
    count = min(count, MOST_TRIALS - len(trials))
    if count <= 0:
        return []
    if not trials:
        sides = [] if refused else [guess + _WIDEN, guess - _WIDEN]
        return [guess, *sides][:count]
    found = bracket(trials)
    low, high = found.holds, found.fails
    if low is None or high is None:
        return _beyond(sorted(trials), found, guess, width, refused)[:count]
    closed = [*found.undecided, *(x for x in refused if low < x < high)]
    edges = [low, *sorted(closed), high]
    if len(edges) == 2:
        return _between(edges[0], edges[1], width, count)
    # What is undecided or refused stays: the bracket closes in on it from both sides.
    below = _between(edges[0], edges[1], width, 1)
    above = _between(edges[-2], edges[-1], width, 1)
    return (below + above)[:count]


def _beyond(
    tried: Sequence[float],
    found: Bracket,
    guess: float,
    width: float,
    refused: Sequence[float],
) -> list[float]:
    """Return severities beyond all that were tried, on the sides that are missing."""
    places = []
    for side, is_missing in ((-1, found.holds is None), (1, found.fails is None)):
        edge = side * max(side * x for x in tried)
        away = side * (edge - guess)
        gaps = [max(_WIDEN, 2.0 * away), math.log(REACH) - away]
        # Half of the way to what is refused.
        gaps += [0.5 * g for x in refused if (g := side * (x - edge)) > 0.0]
        gap = min(gaps)
        if is_missing and gap > 0.5 * width:
            places.append(edge + side * gap)
    return places


def _between(low: float, high: float, width: float, count: int) -> list[float]:
    """Return places that divide a gap evenly, none where it is narrow enough."""
    parts = math.ceil((high - low) / width - 1e-9)
    parts = min(parts, count + 1)
    step = (high - low) / max(parts, 1)
    return [low + step * k for k in range(1, parts)]


def severity(value: float, harder: int) -> float:
    """Return the severity of a positive value; `harder` is 1, or -1 where less is."""
    return harder * math.log(value)


def value_of(at: float, harder: int) -> float:
    """Return the value of a severity, to four digits."""
    return float(f"{math.exp(harder * at):.4g}")
