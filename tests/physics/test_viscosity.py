"""R5: artificial viscosity of two rings, against averages over the angle."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import approx, gaussian_3d, ring_points

from mpisph.physics.kernel import XI_FAR
from mpisph.physics.viscosity import (
    FAR_NODES,
    closing,
    hoop_approach,
    near_nodes,
    signal_speed,
    viscous_pressure,
)

H = 0.8
PAIRS = [
    # r_a, r_b, z, u_r,a, u_z,a, u_r,b, u_z,b
    (1.3, 0.9, 0.4, 2.0, -1.0, -3.0, 0.5),
    (0.02, 0.7, -0.9, -1.0, 4.0, 2.0, 1.0),
    (5.0, 5.5, 0.1, 0.3, 0.2, -0.7, 0.9),
    (2.0, 2.0, 0.0, -1.5, 0.7, -1.5, 0.7),
]


@pytest.mark.parametrize("pair", PAIRS)
def test_hoop_approach_r5_completes_the_mean_of_closing_times_distance(pair):
    r_a, r_b, z, ur_a, uz_a, ur_b, uz_b = pair
    x, y, cos, sin = ring_points(r_b, 4000)
    apart = np.array([r_a - x, -y, np.full_like(x, z)])
    speed = np.array([ur_a - ur_b * cos, -ur_b * sin, np.full_like(x, uz_a - uz_b)])
    W = gaussian_3d((apart**2).sum(0), H)
    N = ((speed * apart).sum(0) * W).mean() / W.mean()
    q = ((1.0 - cos) * W).mean() / W.mean()
    plane = (r_a - r_b) * (ur_a - ur_b) + z * (uz_a - uz_b)
    # The terms are below 30 and add up with a rounding of 1e-16 each.
    got = plane + hoop_approach(r_a, r_b, ur_a, ur_b, q, False)
    assert got == approx(N, rel=1e-13, abs=3e-15)


@pytest.mark.parametrize("pair", PAIRS)
def test_hoop_approach_r5_as_printed_has_the_other_products(pair):
    r_a, r_b, _, ur_a, _, ur_b, _ = pair
    got = hoop_approach(r_a, r_b, ur_a, ur_b, 0.37, True)
    assert got == approx((r_a * ur_a + r_b * ur_b) * 0.37, rel=1e-14)
    same = pair == PAIRS[-1]
    assert (got == hoop_approach(r_a, r_b, ur_a, ur_b, 0.37, False)) == same


def viscous_stress(hoop2, weights, power):
    """Return the viscous stress of a uniform strain, shape (strained, component).

    The averages of ``N^power x_j^2 / D^power`` with ``N = x_i^2``, for i and j along r,
    theta and z: distances in the plane by a fine sum, hoop distances at the nodes.
    Lengths are in units of h.
    """
    s = np.geomspace(1e-8, 45.0, 4000)
    ds = np.gradient(s) * np.exp(-s)
    phi = (np.arange(12) + 0.5) * np.pi / 24.0  # exact for powers up to 6
    plane = s[:, None, None] * np.ones((1, 12, hoop2.size))
    parts = [
        plane * np.cos(phi)[:, None] ** 2,
        np.broadcast_to(hoop2, plane.shape),
        plane * np.sin(phi)[:, None] ** 2,
    ]
    D = plane + hoop2
    return np.array(
        [
            [
                np.einsum("k,kpn,n->", ds, (N / D) ** power * x2, weights) / 12.0
                for x2 in parts
            ]
            for N in parts
        ]
    )


@pytest.mark.parametrize("power", [1, 2])
@pytest.mark.parametrize("xi", [0.01, 0.3, 1.0, 3.0, 8.0, 15.9, 16.1, 50.0, 1e3])
def test_nodes_r5_give_the_viscous_stress_of_the_cartesian_sum(xi, power):
    t = 1.0 - np.cos((np.arange(100) + 0.5) * min(np.pi, 9.0 / xi**0.5) / 100)
    w = np.exp(-xi * t)
    w /= w.sum()
    q = (w * t).sum()
    tau_1, tau_2, share = near_nodes(q) if xi < XI_FAR else FAR_NODES
    want = viscous_stress(xi * t, w, power)
    hoop2 = xi * q * np.array([tau_1, tau_2])
    got = viscous_stress(hoop2, np.array([share, 1.0 - share]), power)
    np.testing.assert_allclose(got, want, rtol=0.0, atol=2e-3 * want.max())


def test_far_nodes_r5_are_isotropic():
    """The averages of three Gaussian distances: a strain along z acts 3 to 1."""
    hoop2 = 0.5 * np.array([FAR_NODES.tau_1, FAR_NODES.tau_2])
    weights = np.array([FAR_NODES.w, 1.0 - FAR_NODES.w])
    linear = viscous_stress(hoop2, weights, 1)
    quadratic = viscous_stress(hoop2, weights, 2)
    eye = np.eye(3)
    np.testing.assert_allclose(linear, 0.1 + 0.2 * eye, rtol=0.0, atol=2e-6)
    np.testing.assert_allclose(
        quadratic, 3.0 / 70.0 + 12.0 / 70.0 * eye, rtol=0.0, atol=2e-6
    )


def test_near_nodes_r5_lie_on_the_ring():
    for q in np.linspace(0.0, 1.0, 101):
        tau_1, tau_2, w = near_nodes(q)
        assert 0.0 < w < 1.0
        assert 0.0 < tau_1 < tau_2
        assert tau_2 * q < 2.0
        assert w * tau_1 + (1.0 - w) * tau_2 == approx(1.0, rel=1e-14)
    assert near_nodes(0.0) == approx(tuple(FAR_NODES), rel=1e-15)


@pytest.mark.parametrize("N", [0.0, 1e-9, 3.0])
def test_viscosity_r5_is_zero_for_receding_points(N):
    assert closing(N) == 0.0
    assert closing(-N) == -N
    assert viscous_pressure(0.0, 2.5 * 5e3, 1.5) == 0.0


def test_viscous_pressure_r5_of_approaching_points():
    got = viscous_pressure(-420.0, 2.5 * 5350.0, 1.5)
    assert got == approx(2.5 * 5350.0 * 420.0 + 1.5 * 420.0**2, rel=1e-14)
    assert viscous_pressure(-420.0, 0.0, 0.0) == 0.0


def test_signal_speed_r5_grows_with_the_approach():
    assert signal_speed(0.0, 2.5 * 5350.0, 1.5) == 2.5 * 5350.0
    assert signal_speed(-420.0, 2.5 * 5350.0, 1.5) == 2.5 * 5350.0 + 1.5 * 420.0


def test_viscosity_r5_does_not_hide_what_is_not_a_number():
    assert np.isnan(closing(np.nan))
    assert np.isnan(viscous_pressure(np.nan, 2.5 * 5e3, 1.5))


@given(
    mu=st.floats(-1e9, 0.0), alpha=st.floats(0.0, 10.0), beta=st.floats(0.0, 10.0)
)  # fmt: skip
def test_viscous_pressure_r5_only_ever_resists(mu, alpha, beta):
    assert viscous_pressure(mu, alpha * 5e3, beta) >= 0.0
