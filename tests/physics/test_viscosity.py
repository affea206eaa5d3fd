"""R5: artificial viscosity of two rings, against averages over the angle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import approx, gaussian_3d, ring_points

from mpisph.physics.viscosity import approach, separation2, viscous_pressure

H = 0.8
PAIRS = [
    # r_a, r_b, z, u_r,a, u_z,a, u_r,b, u_z,b
    (1.3, 0.9, 0.4, 2.0, -1.0, -3.0, 0.5),
    (0.02, 0.7, -0.9, -1.0, 4.0, 2.0, 1.0),
    (5.0, 5.5, 0.1, 0.3, 0.2, -0.7, 0.9),
    (2.0, 2.0, 0.0, -1.5, 0.7, -1.5, 0.7),
]


def angular_means(r_a, r_b, z, ur_a, uz_a, ur_b, uz_b):
    """Return <closing . apart>, <apart^2> and <1 - cos>, each weighted with W."""
    x, y, cos, sin = ring_points(r_b, 4000)
    apart = np.array([r_a - x, -y, np.full_like(x, z)])
    closing = np.array([ur_a - ur_b * cos, -ur_b * sin, np.full_like(x, uz_a - uz_b)])
    W = gaussian_3d((apart**2).sum(0), H)
    weighted = [(closing * apart).sum(0), (apart**2).sum(0), 1.0 - cos]
    return [(value * W).mean() / W.mean() for value in weighted]


@pytest.mark.parametrize("pair", PAIRS)
def test_approach_r5_is_the_mean_of_closing_times_distance(pair):
    r_a, r_b, z, ur_a, uz_a, ur_b, uz_b = pair
    N, _, q = angular_means(*pair)
    got = approach(
        r_a - r_b, z, ur_a - ur_b, uz_a - uz_b, r_a, r_b, ur_a, ur_b, q, False
    )
    # The terms are below 30 and add up with a rounding of 1e-16 each.
    assert got == approx(N, rel=1e-13, abs=3e-15)


@pytest.mark.parametrize("pair", PAIRS)
def test_approach_r5_as_printed_has_the_other_products(pair):
    r_a, r_b, z, ur_a, uz_a, ur_b, uz_b = pair
    q = 0.37
    arguments = (r_a - r_b, z, ur_a - ur_b, uz_a - uz_b, r_a, r_b, ur_a, ur_b, q)
    plane = (r_a - r_b) * (ur_a - ur_b) + z * (uz_a - uz_b)
    want = plane + (r_a * ur_a + r_b * ur_b) * q
    assert approach(*arguments, True) == approx(want, rel=1e-14)
    same = pair == PAIRS[-1]
    assert (approach(*arguments, True) == approach(*arguments, False)) == same


@pytest.mark.parametrize("pair", PAIRS)
def test_separation_r5_is_the_mean_squared_distance_softened(pair):
    r_a, r_b, z, *_ = pair
    _, D, q = angular_means(*pair)
    d2 = (r_a - r_b) ** 2 + z**2
    ratio = 2.0 * r_a * r_b / H**2 * q
    assert separation2(d2, ratio, 0.0, H) == approx(D, rel=1e-13)
    softened = separation2(d2, ratio, 0.25, H)
    assert softened == approx(D + 0.25 * H**2, rel=1e-13)


@pytest.mark.parametrize("N", [0.0, 1e-9, 3.0])
def test_viscous_pressure_r5_is_zero_for_receding_rings(N):
    assert viscous_pressure(N, 0.5, 0.3, 2.5 * 5e3, 1.5, 1.0 / 2.7e3) == 0.0


def test_viscous_pressure_r5_of_approaching_rings():
    h, D, N, c, rho = 0.3, 0.5, -700.0, 5350.0, 2710.0
    mu = -420.0
    got = viscous_pressure(N, 1.0 / D, h, 2.5 * c, 1.5, 1.0 / rho)
    want = (2.5 * 5350.0 * 420.0 + 1.5 * 420.0**2) / 2710.0
    assert h * N / D == approx(mu, rel=1e-15)
    assert got == approx(want, rel=1e-14)
    assert viscous_pressure(N, 1.0 / D, h, 0.0, 0.0, 1.0 / rho) == 0.0


def test_viscous_pressure_r5_does_not_hide_what_is_not_a_number():
    assert np.isnan(viscous_pressure(np.nan, 2.0, 0.3, 2.5 * 5e3, 1.5, 1.0 / 2.7e3))


@given(
    N=st.floats(-1e9, 1e9), D=st.floats(1e-12, 1e3), alpha=st.floats(0.0, 10.0),
    beta=st.floats(0.0, 10.0),
)  # fmt: skip
def test_viscous_pressure_r5_only_ever_resists(N, D, alpha, beta):
    Pi = viscous_pressure(N, 1.0 / D, 1e-3, alpha * 5e3, beta, 1.0 / 2.7e3)
    assert Pi >= 0.0
