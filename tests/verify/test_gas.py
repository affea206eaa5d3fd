"""What is measured on runs of a gas."""

import math

import numpy as np
import pytest

from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import (
    GasBody,
    gas_setup,
    mean_in,
    outermost_crossing,
    profile,
)


def test_a_gas_starts_in_its_state():
    rod = {"shape": "cylinder", "radius": 1.0, "length": 0.5}
    left = GasBody({**rod, "position": -0.5}, GasState(1.0, 0.5, 2.0))
    right = GasBody({**rod, "position": 0.0}, GasState(0.125, 0.0, 0.0))
    more = {"resolution": {"nph": 1.2}}
    made = gas_setup("1/8", "gas", [left, right], 0.125, [0.1, 0.2], 1.4, **more)
    assert made.case.resolution.nph == 1.2
    assert made.case.output_times == (1e-4, 2e-4)
    fields = made.particles
    energy = np.where(fields["z"] < 0.0, 5e6, 0.0)
    assert fields["E"] == pytest.approx(energy)
    assert fields["u_z"] == pytest.approx(np.where(fields["z"] < 0.0, 500.0, 0.0))
    assert fields["m"].sum() == pytest.approx(math.pi * 0.5 * 1.125)


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
