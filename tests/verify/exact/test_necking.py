"""The neck of a bar in tension, against the maximum of its load."""

import math

import pytest
from scipy.optimize import minimize_scalar

from mpisph.verify.exact.necking import (
    Hardening,
    fracture_strain,
    nominal_stress,
    onset_of_neck,
)

LAW = Hardening(2e8, 4e8, 0.5)


@pytest.mark.parametrize("law", [LAW, Hardening(1e8, 3e8, 0.2), Hardening(0, 1e9, 0.4)])
def test_the_neck_begins_at_the_greatest_load(law):
    found = minimize_scalar(
        lambda x: -nominal_stress(law, x) / 1e8,
        bounds=(1e-6, 2.0),
        method="bounded",
        options={"xatol": 1e-10},
    )
    assert onset_of_neck(law) == pytest.approx(found.x, rel=1e-5)


def test_the_neck_of_a_power_law_begins_at_its_exponent():
    assert onset_of_neck(Hardening(0.0, 5e8, 0.3)) == pytest.approx(0.3, rel=1e-12)
    assert onset_of_neck(LAW) == pytest.approx(0.25, rel=1e-12)
    assert nominal_stress(LAW, 0.25) == pytest.approx(4e8 * math.exp(-0.25), rel=1e-12)


def test_the_strain_to_fracture_is_that_at_a_third():
    assert fracture_strain(0.1, 0.6, -1.2) == pytest.approx(0.1 + 0.6 * math.exp(-0.4))
