"""The search for a limit, against judges whose limits are known."""

import math

import pytest

from mpisph.study.limit.search import (
    MOST_TRIALS,
    bracket,
    next_severities,
    severity,
    value_of,
)

WIDTH = math.log(1.05)


def found_by(judge, guess=0.0, count=1, width=WIDTH):
    """Search until nothing is left to try; return the trials."""
    trials = {}
    while wanted := next_severities(trials, guess, width, count):
        assert len(wanted) <= count
        for at in wanted:
            assert at not in trials
            trials[at] = judge(at)
        assert len(trials) <= MOST_TRIALS
    return trials


def limit_at(edge):
    return lambda at: "holds" if at < edge else "perforated"


@pytest.mark.parametrize("edge", [-1.9, -0.3, 0.0, 0.01, 0.7, 2.5])
@pytest.mark.parametrize("count", [1, 2, 3])
def test_a_sharp_limit_is_bracketed(edge, count):
    trials = found_by(limit_at(edge), count=count)
    known = bracket(trials)
    assert known.holds < edge <= known.fails
    assert known.fails - known.holds <= WIDTH * (1 + 1e-6)
    assert known.undecided == known.holds_above == ()


def test_side_by_side_it_takes_fewer_rounds():
    rounds = {}
    for count in (1, 3):
        trials, rounds[count] = {}, 0
        while wanted := next_severities(trials, 0.0, WIDTH, count):
            trials |= {at: limit_at(0.77)(at) for at in wanted}
            rounds[count] += 1
    assert rounds[3] < rounds[1]


def test_what_is_undecided_stays_between_what_is_decided():
    def judge(at):
        if abs(at - 0.5) < 0.2:
            return "undecided"
        return "holds" if at < 0.5 else "detached spall"

    known = bracket(found_by(judge))
    assert known.undecided
    assert known.holds <= 0.3 < known.undecided[0]
    assert known.undecided[-1] < 0.7 <= known.fails
    # Both ends close in on what is undecided.
    assert known.undecided[0] - known.holds <= WIDTH * (1 + 1e-6)
    assert known.fails - known.undecided[-1] <= WIDTH * (1 + 1e-6)


@pytest.mark.parametrize("outcome", ["holds", "perforated", "undecided"])
def test_where_one_verdict_is_all_there_is_the_search_ends(outcome):
    trials = found_by(lambda _: outcome)
    assert len(trials) == MOST_TRIALS
    known = bracket(trials)
    assert (known.holds is None) == (outcome != "holds")
    assert (known.fails is None) == (outcome != "perforated")


def test_what_holds_beyond_a_failure_is_said():
    trials = {0.0: "holds", 0.5: "perforated", 0.8: "holds", 1.0: "perforated"}
    known = bracket(trials)
    assert (known.holds, known.fails) == (0.0, 0.5)
    assert known.holds_above == (0.8,)


def test_a_failure_of_all_but_one_far_above():
    known = bracket({0.0: "perforated", 1.0: "holds"})
    assert known.holds is None
    assert known.holds_above == (1.0,)


def test_thin_walls_are_the_harder_ones():
    assert severity(2e-3, -1) > severity(3e-3, -1)
    assert value_of(severity(2.5e-3, -1), -1) == 2.5e-3
    assert value_of(severity(6.7e3, 1), 1) == 6.7e3
