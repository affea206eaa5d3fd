"""Noh's problem, against printed values and the conservation of mass and energy."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from mpisph.verify.exact.noh import noh, noh_shock


def test_a_sphere_of_monatomic_gas_is_compressed_64_times():
    rho, u, P = noh([0.1, 0.3], 0.6, 5.0 / 3.0, 3)
    assert noh_shock(5.0 / 3.0) * 0.6 == pytest.approx(0.2)
    assert rho == pytest.approx([64.0, 9.0])
    assert u == pytest.approx([0.0, -1.0])
    assert P == pytest.approx([64.0 / 3.0, 0.0])


@pytest.mark.parametrize("dimensions", [1, 2, 3])
def test_mass_and_energy_are_conserved(dimensions):
    """What was within 1 at the start is within 1 - t."""
    t = 0.6
    x = np.linspace(0.0, 1.0 - t, 400001)
    rho, u, P = noh(x, t, 1.4, dimensions)
    shells = dimensions * x ** (dimensions - 1)
    assert trapezoid(rho * shells, x) == pytest.approx(1.0, rel=1e-4)
    energy = 0.5 * rho * u**2 + P / 0.4
    assert trapezoid(energy * shells, x) == pytest.approx(0.5, rel=1e-4)
