"""R6: artificial heat conduction."""

import numpy as np
from oracles import approx, gaussian_3d, ring_points

from mpisph.physics.heat import diffusivity, heat_flow


def test_diffusivity_r6():
    g1, g2, h, c = 0.5, 1.0, 2e-3, 5350.0
    assert diffusivity(g1, g2, h, c, 3e5) == approx(5.35, rel=1e-15)
    # In compression |div| - div is twice the magnitude: 2 h^2 3e5 = 2.4.
    assert diffusivity(g1, g2, h, c, -3e5) == approx(5.35 + 2.4, rel=1e-15)
    assert diffusivity(g1, 0.5, h, c, -3e5) == approx(5.35 + 1.2, rel=1e-15)
    assert diffusivity(0.0, 0.0, h, c, -3e5) == 0.0


def test_heat_flow_r6_is_the_mean_of_the_cartesian_form():
    """2 zeta/rho (E_a - E_b) x . grad W / x^2, averaged over the ring."""
    r_a, r_b, z, h = 1.3, 0.9, 0.4, 0.8
    zeta, rho, E_a, E_b = 5.0, 2700.0, 1e6, 4e6
    x, y, _, _ = ring_points(r_b, 2000)
    apart = np.array([r_a - x, -y, np.full_like(x, z)])
    W = gaussian_3d((apart**2).sum(0), h)
    grad = -2.0 / h**2 * apart * W
    cartesian = 2.0 * zeta / rho * (E_a - E_b) * (apart * grad).sum(0)
    want = (cartesian / (apart**2).sum(0)).mean()
    got = heat_flow(2.0 * zeta, E_a, E_b) / rho * -2.0 / h**2 * W.mean()
    assert got == approx(want, rel=1e-13)
    # Four over h^2, and from the hotter ring to the colder.
    assert got == approx(4.0 / h**2 * zeta / rho * 3e6 * W.mean(), rel=1e-14)


def test_heat_flow_r6_is_antisymmetric():
    there = heat_flow(10.0, 1e6, 4e6)
    assert there < 0.0
    assert heat_flow(10.0, 4e6, 1e6) == -there
    assert heat_flow(10.0, 4e6, 4e6) == 0.0
