"""Work of the ranks, and when to look for a better cut."""

import numpy as np
from oracles import approx

from mpisph.parallel.load_balance import (
    FADING,
    LONGEST_BACKOFF,
    NOTABLE_GROWTH,
    PARTICLE_WORK,
    Backoff,
    PairCost,
    imbalance,
    relative_pair_costs,
    work_of,
)


def test_work_is_that_of_the_pairs_and_a_constant():
    work = work_of(np.array([0.0, 30.0]))
    assert work.tolist() == [PARTICLE_WORK, 30.0 + PARTICLE_WORK]
    assert float(PARTICLE_WORK).is_integer()


def test_the_cost_of_a_pair_is_a_fading_mean():
    pair_cost = PairCost()
    assert pair_cost.value == 0.0
    pair_cost.note(6.0, 3.0)
    assert pair_cost.value == 2.0
    pair_cost.note(1.0, 1.0)
    assert pair_cost.value == approx((FADING * 6.0 + 1.0) / (FADING * 3.0 + 1.0))
    for _ in range(500):
        pair_cost.note(1.0, 0.0)
        pair_cost.note(9.0, 2.0)
    assert pair_cost.value == approx(5.0, rel=0.05)


def test_relative_costs_of_a_pair():
    assert relative_pair_costs(np.zeros(3)).tolist() == [1.0] * 3
    assert relative_pair_costs(np.array([4e-9, 4e-9])).tolist() == [1.0, 1.0]
    # 0.75 and 1.25 of the mean; a rank that has measured nothing counts as average.
    assert relative_pair_costs(np.array([3e-9, 5e-9, 0.0])).tolist() == [
        0.75,
        1.25,
        1.0,
    ]
    # In sixteenths, so that noise changes nothing.
    assert relative_pair_costs(np.array([1.0, 1.01])).tolist() == [1.0, 1.0]
    assert relative_pair_costs(np.array([1.0, 99.0, 1.0])).tolist() == [0.5, 2.0, 0.5]


def test_imbalance():
    assert imbalance(np.array([1.0, 1.0, 4.0])) == approx(1.0)
    assert imbalance(np.array([2.0, 2.0])) == 0.0
    assert imbalance(np.zeros(3)) == 0.0


def looks(backoff, imbalances, in_vain=True):
    """Return at which occasions was looked for a better cut."""
    found = []
    for k, imbalance_now in enumerate(imbalances):
        if backoff.due(imbalance_now):
            backoff.note(imbalance_now, in_vain)
            found.append(k)
    return found


def test_the_backoff_doubles_while_looking_is_in_vain():
    assert looks(Backoff(), [0.1] * 30) == [0, 2, 6, 14]
    many = looks(Backoff(), [0.1] * 300)
    assert max(np.diff(many)) == LONGEST_BACKOFF + 1
    assert looks(Backoff(), [0.1] * 5, in_vain=False) == [0, 1, 2, 3, 4]


def test_the_backoff_ends_when_the_imbalance_grows_or_something_helped():
    grown = 0.1 + 1.01 * NOTABLE_GROWTH
    backoff = Backoff()
    assert looks(backoff, [0.1] * 8) == [0, 2, 6]
    assert looks(backoff, [0.1 + 0.9 * NOTABLE_GROWTH, grown]) == [1]
    backoff.note(grown, in_vain=False)
    assert backoff.due(0.1)
