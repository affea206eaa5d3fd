"""R10: variable smoothing length."""

import math

import numpy as np
from oracles import approx

from mpisph.physics.smoothing import (
    AXISYMMETRIC,
    CLASSIC,
    FIXED,
    MODES,
    PRINTED,
    smoothing_rate,
)

H, DIV, HOOP, U_R, R = 2e-3, -3e5, 6e4, 400.0, 7e-3


def rate(mode, div=DIV, hoop=HOOP, u_r=U_R, r=R):
    return smoothing_rate(mode, H, div, hoop, u_r, r)


def test_modes_have_their_names():
    assert MODES == {
        "fixed": FIXED,
        "classic": CLASSIC,
        "axisymmetric": AXISYMMETRIC,
        "printed": PRINTED,
    }
    assert len(set(MODES.values())) == 4


def test_fixed_r10():
    assert rate(FIXED) == 0.0


def test_classic_r10_eq20():
    assert rate(CLASSIC) == approx(-300.0, rel=1e-15)


def test_axisymmetric_r10_follows_the_stretch_in_the_plane():
    assert rate(AXISYMMETRIC) == approx(-360.0, rel=1e-15)
    # u_r/r itself is of no account: a ring that flies alone keeps its h.
    assert rate(AXISYMMETRIC, 0.0, 0.0, U_R, 1e-9) == 0.0


def test_printed_r10_is_eq21_to_the_letter():
    want = H / 2.0 * (DIV - U_R / R)
    assert rate(PRINTED) == approx(want, rel=1e-15)
    # A ring that flies alone shrinks as r^(-1/2): dh/dt = -h u_r/(2 r).
    assert rate(PRINTED, 0.0, 0.0) == approx(-H * U_R / (2.0 * R), rel=1e-15)
    with np.errstate(divide="ignore"):  # where it is not compiled
        assert rate(PRINTED, r=np.float64(0.0)) == -math.inf


def test_all_agree_r10_on_plane_dilation_without_hoop_stretch():
    same = {rate(mode, DIV, 0.0, 0.0) for mode in (CLASSIC, AXISYMMETRIC, PRINTED)}
    assert same == {H / 2.0 * DIV}
