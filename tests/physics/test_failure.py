"""R9: failure models."""

import math

from material_point import Point, models

from mpisph.physics.failure.minimum_pressure import (
    CLAMP,
    OFF,
    ZERO,
    MinimumPressure,
    minimum_pressure,
)
from mpisph.physics.models import record


def test_broken_matter_r9_bears_no_tension_down_to_the_minimum():
    limit = {"value": -1e9, "mode": "clamp"}
    matter = models({"failure": "minimum-pressure"}, minimum_pressure=limit)
    for damage, P in ((0.0, -1e9), (0.25, -0.75e9), (1.0, 0.0)):
        point = Point(matter, damage=damage)
        point.set(rho=0.95 * 2700.0)
        point.respond(1e-9)
        assert point.get("P") == P


def test_minimum_pressure_r9():
    for mode in (OFF, CLAMP, ZERO):
        assert minimum_pressure(5e9, -1.2e9, mode) == 5e9
        assert minimum_pressure(-1.2e9, -1.2e9, mode) == -1.2e9
    assert minimum_pressure(-3e9, -1.2e9, OFF) == -3e9
    assert minimum_pressure(-3e9, -1.2e9, CLAMP) == -1.2e9
    assert minimum_pressure(-3e9, -1.2e9, ZERO) == 0.0
    for mode in (CLAMP, ZERO):
        assert minimum_pressure(-3e9, -math.inf, mode) == -3e9
        assert minimum_pressure(-3e9, 0.0, mode) == 0.0


def test_modes_r9_have_the_numbers_of_the_equation():
    modes = {"clamp": CLAMP, "zero": ZERO, "off": OFF}
    for mode, number in modes.items():
        assert record(MinimumPressure(value=-1e9, mode=mode)) == (-1e9, number)
