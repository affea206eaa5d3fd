"""Christiansen's equation against hand values and Cour-Palais' form of it."""

import math

import numpy as np
import pytest

from mpisph.analysis.ballistic import (
    BALLISTIC_VELOCITY,
    HYPERVELOCITY,
    Whipple,
    critical_diameter,
)
from mpisph.materials.alloys import KSI

RYAN = Whipple(
    bumper_thickness=0.787e-3,
    bumper_density=2700.0,
    standoff=50.8e-3,
    wall_thickness=3.18e-3,
    wall_yield=40.0 * KSI,
    projectile_density=2800.0,
)
"""The shield of Ryan et al. (2011) with its thinner wall."""


def test_a_whole_projectile_by_hand():
    # ((0.318 + 0.0787)/(0.6 * 1.67332 * 1.587401))^(18/19) cm at 2 km/s
    found = float(critical_diameter(RYAN, 2000.0))
    by_hand = (0.3967 / 1.593754) ** (18 / 19) * 1e-2
    assert found == pytest.approx(by_hand, rel=1e-5)
    assert found == pytest.approx(2.678e-3, rel=1e-3)


@pytest.mark.parametrize("velocity", [7000.0, 8200.0, 12000.0])
def test_a_shattered_projectile_is_the_thickness_of_cour_palais(velocity):
    d = float(critical_diameter(RYAN, velocity)) * 100.0  # [cm]
    mass = math.pi / 6.0 * 2.8 * d**3
    wall = (
        0.16 * d**0.5 * (2.8 * 2.7) ** (1 / 6) * mass ** (1 / 3)
        * velocity / 1000.0 / 5.08**0.5 * (70.0 / 40.0) ** 0.5
    )  # fmt: skip
    assert wall == pytest.approx(0.318, rel=2e-4)  # 3.918 has four digits


def test_it_is_continuous_and_straight_between():
    for velocity in (BALLISTIC_VELOCITY, HYPERVELOCITY):
        below, at, above = critical_diameter(
            RYAN, velocity * np.array([1 - 1e-9, 1, 1 + 1e-9])
        )
        assert below == pytest.approx(at, rel=1e-7)
        assert above == pytest.approx(at, rel=1e-7)
    ends = critical_diameter(RYAN, [3000.0, 7000.0])
    between = critical_diameter(RYAN, [4000.0, 5000.0, 6000.0])
    assert between == pytest.approx(
        ends[0] + np.array([0.25, 0.5, 0.75]) * (ends[1] - ends[0])
    )


def test_each_part_acts_by_its_power():
    """What a part twice as large does, below 3 and above 7 km/s."""
    slow, fast = critical_diameter(RYAN, [2000.0, 9000.0])

    def ratios(**parts):
        changed = RYAN._replace(**parts)
        return critical_diameter(changed, [2000.0, 9000.0]) / (slow, fast)

    assert ratios(standoff=2 * RYAN.standoff) == pytest.approx((1, 2 ** (1 / 3)))
    assert ratios(projectile_density=5600.0) == pytest.approx(
        (2 ** (-9 / 19), 2 ** (-1 / 3))
    )
    assert ratios(bumper_density=5400.0) == pytest.approx((1, 2 ** (-1 / 9)))
    assert ratios(wall_yield=4 * RYAN.wall_yield)[1] == pytest.approx(4 ** (1 / 3))
    stronger = ((2 * 3.18 + 0.787) / (3.18 + 0.787)) ** (18 / 19)
    assert ratios(wall_yield=4 * RYAN.wall_yield)[0] == pytest.approx(stronger)
    assert ratios(wall_thickness=2 * RYAN.wall_thickness) == pytest.approx(
        (stronger, 2 ** (2 / 3))
    )
    faster = critical_diameter(RYAN, [1000.0, 18000.0]) / (slow, fast)
    assert faster == pytest.approx((2 ** (12 / 19), 2 ** (-2 / 3)))
