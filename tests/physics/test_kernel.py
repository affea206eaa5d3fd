"""R1: the kernel averaged over the angle, against 50 digits, scipy and quadrature."""

import ast
import inspect
import runpy
from decimal import Decimal

import numpy as np
import pytest
from launch import TOP
from oracles import (
    PI,
    approx,
    gaussian_3d,
    ring_averages_decimal,
    ring_points,
    scaled_bessel,
)
from scipy.special import ive

from mpisph.physics import kernel
from mpisph.physics.kernel import (
    PI_POW,
    XI_FAR,
    exp_minus,
    i0_far,
    i0_near,
    i1_near,
    ratio_far,
    ring_averages,
    ring_averages_far,
)

ACCURACY = 4e-12
"""What the kernel states: the polynomials are good to 1e-12 each. Near xi = 16, where
q = 1 - A1/A0 is 0.03, the errors of the near form are magnified 30 times."""

EVERYWHERE = np.concatenate(
    [
        np.logspace(-10, 6, 97),
        XI_FAR + np.linspace(-2.0, 2.0, 9),
        [np.nextafter(XI_FAR, 0.0), np.nextafter(XI_FAR, 99.0)],
    ]
).tolist()
FAR = [xi for xi in EVERYWHERE if xi >= XI_FAR]


def averages(xi, d2=0.7, h=0.3):
    """Return A0, A1, s2 and q; xi q stands beside it and must agree."""
    root = xi**-0.5 / h
    *all_four, ratio = ring_averages(d2, h**-2, root, 1.0 / xi, xi, 1.0 / h)
    assert ratio == approx(xi * all_four[-1], rel=3e-16)
    return all_four


def averages_far(xi, d2=0.7, h=0.3):
    root = xi**-0.5 / h
    *all_four, ratio = ring_averages_far(d2, h**-2, root, 1.0 / xi)
    assert ratio == approx(xi * all_four[-1], rel=3e-16)
    return all_four


def relative_errors(got, want):
    return [abs(float(g / float(w) - 1.0)) for g, w in zip(got, want, strict=True)]


@pytest.mark.parametrize("xi", [1e-3, 0.5, 15.0, 17.0, 300.0, 1.9e3, 2.1e3, 1e5])
def test_the_decimal_oracle_agrees_with_scipy(xi):
    i0, i1, _ = scaled_bessel(xi)
    # scipy documents ive to a few units in the last place.
    assert float(i0) == approx(ive(0, xi), rel=1e-15 * 8)
    assert float(i1) == approx(ive(1, xi), rel=1e-15 * 8)


def test_the_two_series_of_the_decimal_oracle_meet():
    """At 2000 one ends and the other begins: q' = -q/xi within 1e-6 of that."""
    below, above = (scaled_bessel(xi) for xi in (2000.0, np.nextafter(2000.0, 3e3)))
    for one, other in zip(below, above, strict=True):
        assert abs(float(other / one) - 1.0) < 3e-16


@pytest.mark.parametrize("xi", EVERYWHERE)
@pytest.mark.parametrize("d2", [0.0, 0.7, 9.0])
def test_ring_averages_r1_at_any_xi(xi, d2):
    want = ring_averages_decimal(d2, 0.3, xi)
    assert max(relative_errors(averages(xi, d2), want)) < ACCURACY


@pytest.mark.parametrize("xi", FAR)
@pytest.mark.parametrize("d2", [0.0, 0.7, 9.0, 31.0])
def test_ring_averages_far_r1(xi, d2):
    want = ring_averages_decimal(d2, 0.3, xi)
    assert max(relative_errors(averages_far(xi, d2), want)) < ACCURACY


@pytest.mark.parametrize("xi", EVERYWHERE)
def test_ring_averages_r1_against_scipy(xi):
    h, d2 = 0.3, 0.7
    A0, A1, s2, _ = averages(xi, d2, h)
    G = np.exp(-d2) / (np.pi**1.5 * h**3)
    assert A0 == approx(G * ive(0, xi), rel=ACCURACY)
    assert A1 == approx(G * ive(1, xi), rel=ACCURACY)
    assert s2 == approx(G * ive(1, xi) / xi, rel=ACCURACY)


@pytest.mark.parametrize(
    ("r_a", "r_b", "z", "h"),
    [
        (0.001, 0.002, 0.5, 1.0),
        (0.7, 1.1, -0.4, 0.5),
        (2.0, 2.0, 0.0, 0.7),
        (2.9, 2.8, 0.3, 1.0),
        (40.0, 41.0, 1.0, 0.8),
        (90.0, 90.5, 0.0, 0.2),
    ],
)
def test_ring_averages_r1_are_angular_means_of_the_gaussian(r_a, r_b, z, h):
    """The trapezoid rule converges exponentially: 8000 points resolve the rings."""
    x, y, cos, sin = ring_points(r_b, 8000)
    W = gaussian_3d((r_a - x) ** 2 + y**2 + z**2, h)
    less_than_one = 2.0 * np.sin(np.pi * np.arange(8000) / 8000) ** 2  # 1 - cos
    xi = 2.0 * r_a * r_b / h**2
    d2 = ((r_a - r_b) ** 2 + z**2) / h**2
    A0, A1, s2, q = averages(xi, d2, h)
    rel = ACCURACY
    noise = 2e-16 * A0  # where the mean of cos nearly cancels
    assert A0 == approx(W.mean(), rel)
    assert A1 == approx((W * cos).mean(), rel, noise)
    assert s2 == approx((W * sin**2).mean(), rel)
    assert A0 - s2 == approx((W * cos**2).mean(), rel)
    assert q == approx((W * less_than_one).mean() / W.mean(), rel)


@pytest.mark.parametrize("junk", [0.0, 1.0, 1e290])
def test_ring_averages_r1_on_the_axis(junk):
    h, d2 = 0.3, 0.7
    A0, A1, s2, q, ratio = ring_averages(d2, h**-2, junk**0.5, junk, 0.0, 1.0 / h)
    G = gaussian_3d(d2 * h**2, h)
    assert A0 == approx(G, rel=ACCURACY)
    assert A1 == 0.0
    assert s2 == approx(0.5 * G, rel=ACCURACY)
    assert q == approx(1.0, rel=ACCURACY)
    assert ratio == 0.0


def test_q_r1_has_no_cancellation_at_large_xi():
    """1/(2 xi) + 1/(8 xi^2) + 1/(8 xi^3) + 25/(128 xi^4) + 13/(32 xi^5) + ..."""
    for xi in np.logspace(3, 9, 13):
        series = sum(
            c / xi**k for k, c in enumerate([0.5, 0.125, 0.125, 25 / 128, 13 / 32], 1)
        )
        for q in (averages(xi)[3], averages_far(xi)[3]):
            # The next term is below 2/xi^6, 4e-15 of q at xi = 1000.
            assert q == approx(series, rel=6e-13)
            assert q > 0.0


def test_ring_averages_r1_are_the_same_from_both_forms():
    for xi in FAR:
        np.testing.assert_allclose(averages(xi), averages_far(xi), rtol=ACCURACY)


def test_exp_minus_r1():
    # Every power of two, the places where the whole number n changes among them.
    x = np.concatenate(
        [np.linspace(0.0, 32.0, 4001), np.arange(1, 92) * 0.5 * np.log(2.0), [700.0]]
    )
    got = np.array([exp_minus(value) for value in x])
    np.testing.assert_allclose(got, np.exp(-x), rtol=1.2e-12)
    assert got[0] == 1.0


def test_exp_minus_keeps_nan_visible():
    assert np.isnan(exp_minus(np.nan))


def test_polynomials_r1_are_as_good_as_they_state():
    """Each alone, where a slip in its small coefficients is not hidden by others."""
    for xi in np.linspace(0.01, XI_FAR, 150).tolist():
        i0, i1, _ = scaled_bessel(xi)
        scale = Decimal(xi).exp()
        w = 0.25 * xi * xi
        assert i0_near(w) == approx(float(i0 * scale), rel=6e-14)
        assert i1_near(w) == approx(float(i1 * scale / Decimal(xi)), rel=8e-14)
    for xi in (XI_FAR / np.linspace(1e-6, 1.0, 150)).tolist():
        i0, _, q = scaled_bessel(xi)
        assert i0_far(1.0 / xi) == approx(
            PI_POW * float(i0 * Decimal(xi).sqrt()), rel=3e-13
        )
        assert ratio_far(1.0 / xi) == approx(float(q * Decimal(xi)), rel=6e-13)


# What exp_minus holds besides: 1/ln 2, ln 2, and the number that rounds.
REDUCTION = {1.4426950408889634, 0.6931471805599453, 6755399441055744.0}


@pytest.mark.parametrize(
    "name", ["exp_minus", "i0_far", "ratio_far", "i0_near", "i1_near"]
)
def test_coefficients_are_those_that_the_script_makes(name):
    """To the last digit; their signs and places are tested by the accuracy above."""
    script = runpy.run_path(str(TOP / "scripts" / "kernel_coefficients.py"))
    wanted, error = script["fit"](name)
    module = ast.parse(inspect.getsource(kernel))
    (function,) = (n for n in module.body if getattr(n, "name", None) == name)
    constants = [n.value for n in ast.walk(function) if isinstance(n, ast.Constant)]
    held = [c for c in constants if isinstance(c, float) and c not in REDUCTION]
    assert sorted(held) == sorted(abs(c) for c in wanted)
    assert error < 1.2e-12


def test_the_gaussian_has_unit_volume():
    assert approx(float(1 / (PI * PI.sqrt())), rel=2e-16) == PI_POW
