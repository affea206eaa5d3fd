"""Scores of predictions, against counting by hand and over all pairs."""

import itertools
import math
import random
from pathlib import Path

import pytest

from mpisph.analysis.ballistic import Whipple
from mpisph.materials.alloys import find_alloy
from mpisph.study.assess.outcome import Assessed
from mpisph.study.assess.published import PublishedTest
from mpisph.study.assess.scores import (
    by_source,
    by_velocity,
    confusion,
    misses,
    roc_area,
    score,
    undecided,
)

ALLOY = find_alloy("AA6061-T6")
SHIELD = Whipple(0.787e-3, 2700.0, 50.8e-3, 3.18e-3, 276e6, 2800.0)


def assessed(outcome, failed, damage=1.0, velocity=6.5e3, line=2, **more):
    alloys = (ALLOY, ALLOY, ALLOY)
    source, standing = more.get("source", "A"), more.get("standing", "completed")
    test = PublishedTest(
        line, f"{line}", source, "1", *alloys, 3e-3, velocity, SHIELD, failed
    )
    return Assessed(test, standing, outcome, "", Path("x"), damage)


SIX = [
    assessed("holds", False, 0.5, 2e3, line=2),
    assessed("holds", True, 0.2, 2.9e3, line=3),
    assessed("perforated", True, 1.5, 3e3, line=4, source="B"),
    assessed("detached spall", False, 1.1, 5.9e3, line=5),
    assessed("undecided", True, 1.0, 6e3, line=6),
    assessed("undecided", False, None, 7e3, standing="refused", line=7),
]
TO_COME = assessed("undecided", False, None, standing="to do", line=8)


def test_shares_by_hand():
    found = score([*SIX, TO_COME])
    assert (found.tests, found.right, found.wrong, found.undecided) == (6, 2, 2, 2)
    assert found.share == pytest.approx(2 / 6)
    assert found.share_of_decided == pytest.approx(2 / 4)
    ratios = [t.test.ratio > 1.0 for t in SIX]
    right = sum(a == t.test.failed for a, t in zip(ratios, SIX, strict=True))
    assert found.equation_right == right
    assert found.measured == 5


def test_classes_have_their_lower_end():
    found = by_velocity(SIX)
    assert [found[name].tests for name in found] == [6, 2, 2, 2]
    assert found["below 3 km/s"].right == 1
    assert found["3 to 6 km/s"].right == 1
    assert found["6 km/s and above"].undecided == 2
    assert math.isnan(score([]).share)


def test_sources_are_told_apart_the_largest_first():
    found = by_source(SIX)
    assert list(found) == ["A", "B"]
    assert (found["A"].tests, found["B"].tests, found["B"].right) == (5, 1, 1)


def test_the_confusion_by_hand():
    pairs = [(t.test.failed, t.fails) for t in SIX]
    assert confusion(pairs) == ((1, 1, 1), (1, 1, 1))
    assert confusion([(True, False), (True, False)]) == ((0, 0, 0), (2, 0, 0))


def test_the_worst_miss_is_first():
    zero = assessed("holds", True, 0.0, line=9)
    assert misses(SIX) == [SIX[1], SIX[3]]  # |log 0.2| > |log 1.1|
    assert misses([*SIX, zero])[0] == zero
    assert undecided([*SIX, TO_COME]) == SIX[4:]


@pytest.mark.parametrize("seed", range(5))
def test_the_area_is_the_share_of_pairs_in_order(seed):
    draw = random.Random(seed)
    values = [draw.randint(0, 6) / 2 for _ in range(40)]  # with ties
    failed = [draw.random() < 0.4 for _ in values]
    fell = [v for v, f in zip(values, failed, strict=True) if f]
    held = [v for v, f in zip(values, failed, strict=True) if not f]
    pairs = list(itertools.product(fell, held))
    wanted = sum((a > b) + 0.5 * (a == b) for a, b in pairs) / len(pairs)
    assert roc_area(values, failed) == pytest.approx(wanted)


def test_an_area_takes_both_results():
    assert math.isnan(roc_area([1.0, 2.0], [True, True]))
    assert math.isnan(roc_area([], []))
    assert roc_area([1.0, 2.0], [False, True]) == 1.0
