"""Depth of craters, in numbers and in the units of its source."""

import pytest

from mpisph.verify.exact.crater import crater_depth


def test_a_sphere_of_one_centimetre_at_the_speed_of_sound():
    """All factors but the first and the hardness are one."""
    assert crater_depth(0.01, 2.7e3, 5e3, 2.7e3, 16.0, 5e3) == pytest.approx(0.0262)


def test_depth_grows_a_little_faster_than_the_sphere():
    args = (2.79e3, 7e3, 2.7e3, 95.0, 5.05e3)
    ratio = crater_depth(0.02, *args) / crater_depth(0.01, *args)
    assert ratio == pytest.approx(2.0 * 2.0 ** (1.0 / 18.0))
    faster = crater_depth(0.01, 2.79e3, 8 * 7e3, *args[2:])
    assert faster == pytest.approx(4.0 * crater_depth(0.01, *args))
    heavier = crater_depth(0.01, 4 * 2.79e3, *args[1:])
    assert heavier == pytest.approx(2.0 * crater_depth(0.01, *args))
