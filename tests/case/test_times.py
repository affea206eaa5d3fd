import pytest

from mpisph.case.times import merge_times, periodic_times


def test_multiples_are_clean_and_reach_the_end():
    assert periodic_times(1e-6, 5e-6) == [1e-6, 2e-6, 3e-6, 4e-6, 5e-6]
    assert periodic_times(0.1e-6, 0.3e-6) == [1e-7, 2e-7, 3e-7]
    assert periodic_times(2e-6, 1e-6) == []
    assert periodic_times(None, 1e-6) == []


def test_times_that_agree_to_rounding_are_merged():
    assert merge_times([0.1 + 0.2, 0.3, 0.7], 1.0) == pytest.approx((0.3, 0.7, 1.0))


def test_only_times_within_the_run_are_kept():
    assert merge_times([-1.0, 0.0, 0.5, 1.0 - 1e-15, 2.0], 1.0) == (0.5, 1.0)
