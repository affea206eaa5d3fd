"""R10: variable smoothing length."""

import math

from oracles import approx

from mpisph.physics.smoothing import (
    AXIS_SOFTENING,
    AXISYMMETRIC,
    CLASSIC,
    DIMENSIONS,
    FIXED,
    MODES,
    smoothing_rate,
)

H, DIV, U_R, R = 2e-3, -3e5, 400.0, 7e-3


def test_modes_have_their_names():
    assert MODES == {"fixed": FIXED, "classic": CLASSIC, "axisymmetric": AXISYMMETRIC}
    assert len(set(MODES.values())) == 3


def test_fixed_r10():
    assert smoothing_rate(FIXED, H, DIV, U_R, R) == 0.0


def test_classic_r10_eq20():
    assert smoothing_rate(CLASSIC, H, DIV, U_R, R) == approx(-300.0, rel=1e-15)


def test_axisymmetric_r10_eq21():
    got = smoothing_rate(AXISYMMETRIC, H, DIV, U_R, R)
    eq21 = H / 2.0 * (DIV - U_R / R)
    softening = (0.01 * H / R) ** 2  # of u_r/r, to first order
    assert got == approx(eq21, rel=softening)
    exact = H / 2.0 * (DIV - U_R / (R + (0.01 * H) ** 2 / R))
    assert got == approx(exact, rel=1e-15)


def test_axisymmetric_r10_is_classic_without_radial_motion():
    got = smoothing_rate(AXISYMMETRIC, H, DIV, 0.0, R)
    assert got == smoothing_rate(CLASSIC, H, DIV, 0.0, R)


def test_axisymmetric_r10_of_plane_dilation_follows_the_plane_only():
    """A field u = (g r, g z) widens the r-z plane at 2 g: h grows at g h."""
    g = 1e5
    got = smoothing_rate(AXISYMMETRIC, H, 3.0 * g, g * R, R)
    assert got == approx(g * H, rel=(0.01 * H / R) ** 2)
    # A pure hoop stretch at a fixed place in the plane leaves h alone.
    rate = smoothing_rate(AXISYMMETRIC, H, U_R / R, U_R, R)
    assert abs(rate) < H * U_R / R * (0.01 * H / R) ** 2


def test_axisymmetric_r10_is_bounded_at_the_axis():
    assert smoothing_rate(AXISYMMETRIC, H, 0.0, U_R, 0.0) == 0.0
    bound = H / DIMENSIONS * U_R / (2.0 * AXIS_SOFTENING * H)
    rates = [
        abs(smoothing_rate(AXISYMMETRIC, H, 0.0, U_R, 10.0**k)) for k in range(-12, 0)
    ]
    assert max(rates) <= bound
    assert all(math.isfinite(rate) for rate in rates)
    # On the first ring of a lattice, r = dx/2 and h = 2 dx, by no more than 0.2 %.
    first = smoothing_rate(AXISYMMETRIC, H, 0.0, U_R, H / 4.0)
    assert first == approx(-H / 2.0 * U_R / (H / 4.0), rel=2e-3)
