"""Profiles along a line."""

import math

import numpy as np
import pytest

from mpisph.verify.profiles import mean_in, outermost_crossing, profile


def test_means_are_by_mass_and_none_where_nothing_is():
    x, m = np.array([0.1, 0.2, 0.9]), np.array([1.0, 3.0, 5.0])
    assert mean_in(np.array([1.0, 2.0, 7.0]), m, x, 0.0, 0.5) == pytest.approx(1.75)
    assert math.isnan(mean_in(x, m, x, 0.3, 0.5))


def test_a_profile_leaves_out_empty_layers():
    place = np.array([-0.95, 0.05, 0.06, 0.95])
    middles, means = profile(place, place**2, 0.1)
    assert middles == pytest.approx([-0.95, 0.055, 0.95])
    assert means == pytest.approx([0.9025, 0.00305, 0.9025])


def test_the_outermost_fall_counts():
    x = np.arange(6.0)
    assert outermost_crossing(x, np.array([5, 1, 5, 4, 2, 1]), 3.0) == 3.5
    assert math.isnan(outermost_crossing(x, x, 3.0))
    assert outermost_crossing(x, np.array([1, 0, 3, 3, 1, 0.0]), 2.0) == pytest.approx(
        3.5
    )
    assert math.isnan(outermost_crossing(x, np.zeros(6), 2.0))
    assert math.isnan(outermost_crossing(x, np.full(6, 3.0), 2.0))
