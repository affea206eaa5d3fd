"""Waves against closed forms: the Hugoniot and the elastic precursor."""

import numpy as np
import pytest
from plates import front, plate_impact, states_at

pytestmark = pytest.mark.slow

# Symmetric impact of 6061-T6 aluminium, c0 = 5240 m/s, s = 1.40, rho0 = 2703 kg/m3.
C0, SLOPE, RHO0 = 5240.0, 1.40, 2703.0
SHEAR, YIELD = 27.6e9, 0.29e9


@pytest.mark.parametrize("velocity", [1e3, 3e3, 6e3])
def test_symmetric_impact_meets_the_hugoniot(velocity):
    u_p = velocity / 2
    U_s = C0 + SLOPE * u_p
    thickness = 5e-3
    t_1, t_2 = 0.4 * thickness / U_s, 0.8 * thickness / U_s
    case = plate_impact(velocity, thickness, 6e-3, 1e-4, strength="none")
    states = states_at(case, (t_1, t_2))
    z_1 = front(next(states), u_p / 2)
    sim = next(states)
    z_2 = front(sim, u_p / 2)
    assert (z_2 - z_1) / (t_2 - t_1) == pytest.approx(U_s, rel=0.02)

    p = sim.particles
    behind = (p.r < 1e-3) & (np.abs(p.z - u_p * t_2) < 1.5e-3)
    assert behind.sum() > 100
    assert np.median(p.u_z[behind]) == pytest.approx(u_p, rel=0.02)
    assert np.median(p.P[behind]) == pytest.approx(RHO0 * U_s * u_p, rel=0.02)


@pytest.mark.parametrize(
    ("velocity", "alpha", "regime"), [(50.0, 1.0, "elastic"), (400.0, 0.5, "plastic")]
)
def test_elastic_precursor_runs_at_the_longitudinal_speed(velocity, alpha, regime):
    longitudinal_modulus = RHO0 * C0**2 + 4 / 3 * SHEAR
    c_L = np.sqrt(longitudinal_modulus / RHO0)
    u_elastic = YIELD * longitudinal_modulus / (2 * SHEAR) / (RHO0 * c_L)
    assert (velocity / 2 > u_elastic) == (regime == "plastic")
    level = min(velocity / 2, u_elastic) / 2
    thickness = 7e-3
    t_1, t_2 = 0.4 * thickness / c_L, 0.85 * thickness / c_L
    case = plate_impact(
        velocity, thickness, 8e-3, 1e-4, viscosity={"alpha": alpha, "beta": alpha}
    )
    z_1, z_2 = (front(sim, level) for sim in states_at(case, (t_1, t_2)))
    # The bulk wave, 18 % slower, is far outside.
    assert (z_2 - z_1) / (t_2 - t_1) == pytest.approx(c_L, rel=0.02)
