"""How well predictions of tests do: shares, confusion, areas under ROC curves."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.stats import rankdata

from mpisph.study.assess.outcome import Assessed

__all__ = [
    "CLASSES",
    "Confusion",
    "Score",
    "by_source",
    "by_velocity",
    "confusion",
    "misses",
    "roc_area",
    "score",
    "undecided",
]

CLASSES: dict[str, Callable[[float], bool]] = {
    "all": lambda _: True,
    "below 3 km/s": lambda v: v < 3e3,
    "3 to 6 km/s": lambda v: 3e3 <= v < 6e3,
    "6 km/s and above": lambda v: v >= 6e3,
}
"""Classes of impact velocities [m/s]."""


class Score(NamedTuple):
    """Shares of right predictions in some tests.

    Attributes
    ----------
    tests : int
        With a prediction, or ended without one.
    right, wrong, undecided : int
        By the computed verdicts; the three make `tests`.
    equation_right : int
        By Christiansen's equation.
    damage_area, equation_area : float
        Areas under the ROC curves of the damage measure and of d/d_c, both of the tests
        that have a damage measure; NaN where they are all of one result.
    measured : int
        Number of those.
    """

    tests: int
    right: int
    wrong: int
    undecided: int
    equation_right: int
    damage_area: float
    equation_area: float
    measured: int

    @property
    def share(self) -> float:
        """Share of right verdicts; what is undecided is not right."""
        return _share(self.right, self.tests)

    @property
    def share_of_decided(self) -> float:
        """Share of right verdicts among those that decide."""
        return _share(self.right, self.right + self.wrong)

    @property
    def equation_share(self) -> float:
        """Share of the tests that the equation has right."""
        return _share(self.equation_right, self.tests)


class Confusion(NamedTuple):
    """Numbers of tests by their result and what is predicted.

    Attributes
    ----------
    held, failed : tuple of int
        Tests that did: predicted to hold, to fail, undecided.
    """

    held: tuple[int, int, int]
    failed: tuple[int, int, int]


def _share(part: int, whole: int) -> float:
    return part / whole if whole else math.nan


def score(tests: Sequence[Assessed]) -> Score:
    """Return how well some tests are predicted; those that have not ended are left out.

    Parameters
    ----------
    tests : sequence of Assessed
    """
    ended = [test for test in tests if test.ended]
    decided = [test for test in ended if test.fails is not None]
    right = sum(test.fails == test.test.failed for test in decided)
    measured = [t for t in ended if t.damage is not None]
    results = [t.test.failed for t in measured]
    return Score(
        tests=len(ended),
        right=right,
        wrong=len(decided) - right,
        undecided=len(ended) - len(decided),
        equation_right=sum((t.test.ratio > 1.0) == t.test.failed for t in ended),
        damage_area=roc_area([t.damage or 0.0 for t in measured], results),
        equation_area=roc_area([t.test.ratio for t in measured], results),
        measured=len(measured),
    )


def by_velocity(tests: Sequence[Assessed]) -> dict[str, Score]:
    """Return the score of each of `CLASSES`."""
    return {
        name: score([t for t in tests if inside(t.test.velocity)])
        for name, inside in CLASSES.items()
    }


def by_source(tests: Sequence[Assessed]) -> dict[str, Score]:
    """Return the score of each report, that with the most tests first."""
    sources = dict.fromkeys(t.test.source for t in tests)
    found = {
        source: score([t for t in tests if t.test.source == source])
        for source in sources
    }
    ended = {source: score for source, score in found.items() if score.tests}
    return dict(sorted(ended.items(), key=lambda item: (-item[1].tests, item[0])))


def confusion(predictions: Iterable[tuple[bool, bool | None]]) -> Confusion:
    """Count predictions by what the tests gave.

    Parameters
    ----------
    predictions : iterable of tuple
        Whether the test failed, and whether it is predicted to; None where that is
        undecided.
    """
    counts = {False: [0, 0, 0], True: [0, 0, 0]}
    for failed, predicted in predictions:
        counts[failed][2 if predicted is None else int(predicted)] += 1
    held, fell = counts[False], counts[True]
    return Confusion((held[0], held[1], held[2]), (fell[0], fell[1], fell[2]))


def misses(tests: Sequence[Assessed]) -> list[Assessed]:
    """Return the tests whose verdicts are wrong, the farthest from the limit first."""
    wrong = [
        t for t in tests if t.ended and t.fails is not None
        and t.fails != t.test.failed
    ]  # fmt: skip
    return sorted(wrong, key=lambda t: (-t.distance, t.test.line))


def undecided(tests: Sequence[Assessed]) -> list[Assessed]:
    """Return the tests that have ended without a verdict, in the order of the file."""
    return [t for t in tests if t.ended and t.fails is None]


def roc_area(values: Sequence[float], failed: Sequence[bool]) -> float:
    """Return the area under a ROC curve.

    It is the chance that of one test that failed and one that held, the former has the
    larger value; of equal values half counts (Mann and Whitney's statistic by ranks).

    Parameters
    ----------
    values : sequence of float
        Larger where failure is likelier.
    failed : sequence of bool
        As many.

    Returns
    -------
    float
        NaN where all are of one result.
    """
    fell = np.asarray(failed, dtype=bool)
    n, m = int(fell.sum()), int((~fell).sum())
    if n == 0 or m == 0:
        return math.nan
    ranks = rankdata(values)
    return float((ranks[fell].sum() - n * (n + 1) / 2) / (n * m))
