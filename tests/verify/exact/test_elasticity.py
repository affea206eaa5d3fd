"""Linear elasticity, against printed roots, balances and brute force."""

import math

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import eigh
from scipy.special import spherical_jn

from mpisph.verify.exact.elasticity import (
    Elastic,
    bar_frequency,
    bar_stress,
    ring_frequency,
    sphere_displacement,
    sphere_wavenumber,
    spun_cylinder,
    spun_section,
)

SOLID = Elastic(2700.0, 76e9, 26e9)
EQUAL = Elastic(1.0, 5 / 3, 1.0)  # lambda = mu, nu = 1/4


def test_constants_belong_together():
    E, nu, G, K = SOLID.young, SOLID.poisson, SOLID.shear_modulus, SOLID.bulk_modulus
    assert pytest.approx(E) == 2 * G * (1 + nu)
    assert pytest.approx(E) == 3 * K * (1 - 2 * nu)
    modulus = E * (1 - nu) / ((1 + nu) * (1 - 2 * nu))
    assert SOLID.longitudinal_modulus == pytest.approx(modulus)
    assert SOLID.longitudinal_speed == pytest.approx(math.sqrt(modulus / 2700))
    assert SOLID.bar_speed == pytest.approx(math.sqrt(E / 2700))


def test_the_sphere_has_the_root_of_lamb():
    # Love (1927), section 196: k a/pi = .8160 for a Poisson's ratio of 1/4.
    assert sphere_wavenumber(EQUAL, 1.0) / math.pi == pytest.approx(0.8160, abs=5e-5)


@pytest.mark.parametrize("solid", [SOLID, EQUAL])
def test_the_sphere_s_surface_is_free(solid):
    a, k = 0.01, sphere_wavenumber(solid, 0.01)
    slope = k * spherical_jn(1, k * a, derivative=True)
    hoop = spherical_jn(1, k * a) / a
    lame = solid.bulk_modulus - 2 / 3 * solid.shear_modulus
    stress = lame * (slope + 2 * hoop) + 2 * solid.shear_modulus * slope
    assert stress == pytest.approx(0.0, abs=1e-9 * abs(lame * hoop))


def test_the_displacement_is_a_bessel_function():
    x = np.array([0.0, 1e-6, 9e-4, 1.1e-3, 0.5, 2.0, 4.0])
    assert sphere_displacement(x) == pytest.approx(spherical_jn(1, x), rel=1e-8)


def test_a_bar_vibrates_as_finite_elements_with_lateral_inertia_do():
    a, length, n = 0.1, 2.0, 200
    h = length / n
    ends = np.arange(n)
    stiff, mass = np.zeros((n + 1, n + 1)), np.zeros((n + 1, n + 1))
    # Love's rod: energy E u'^2/2, inertia rho (u^2 + (nu a)^2 u'^2/2)/2.
    slope = np.array([[1.0, -1.0], [-1.0, 1.0]]) / h
    value = np.array([[2.0, 1.0], [1.0, 2.0]]) * h / 6
    lateral = 0.5 * (SOLID.poisson * a) ** 2
    for i in ends:
        at = np.ix_([i, i + 1], [i, i + 1])
        stiff[at] += SOLID.young * slope
        mass[at] += SOLID.density * (value + lateral * slope)
    frequency = math.sqrt(eigh(stiff, mass, eigvals_only=True)[1])
    assert bar_frequency(SOLID, a, length) == pytest.approx(frequency, rel=2e-5)
    assert frequency < SOLID.bar_speed * math.pi / length


def test_a_ring_is_a_mass_on_a_spring():
    # Hoop stress E u/R on the area A gives the force 2 pi E A u/R outward.
    R, A = 0.3, 1e-4
    stiffness = 2 * math.pi * SOLID.young * A / R
    mass = 2 * math.pi * R * A * SOLID.density
    assert ring_frequency(SOLID, R) == pytest.approx(math.sqrt(stiffness / mass))


def test_a_stretched_bar_is_a_sum_of_its_modes():
    length, rate, c = 2.0, 3.0, SOLID.bar_speed
    z = np.linspace(-0.9, 0.9, 7)
    for time in np.array([0.05, 0.3, 0.5, 0.8, 1.3, 2.1]) * length / c:
        strain = np.zeros_like(z)
        for n in range(1, 40001, 2):
            k = n * math.pi / length
            # Mode sin(k z) of the velocity rate z, between -length/2 and length/2.
            part = 4 * rate * (-1) ** ((n - 1) // 2) / (length * k**2)
            strain += part * np.cos(k * z) * math.sin(k * c * time) / c
        exact = bar_stress(SOLID, rate, length, z, time)
        assert exact == pytest.approx(SOLID.young * strain, abs=1e-4 * SOLID.young / c)


def test_a_spun_cylinder_is_in_equilibrium():
    a, w = 0.01, 2e4
    s = np.linspace(1e-4, a, 4001)
    stress = spun_cylinder(SOLID, a, w, s)
    force = (
        np.gradient(stress.radial, s, edge_order=2) + (stress.radial - stress.hoop) / s
    )
    assert force == pytest.approx(-SOLID.density * w**2 * s, rel=1e-6)
    assert stress.radial[-1] == pytest.approx(0.0, abs=1e-9 * stress.radial[0])
    # One displacement u gives both strains, and none along the axis.
    E, nu = SOLID.young, SOLID.poisson
    radial, hoop, axial = stress
    assert (axial - nu * (radial + hoop)) == pytest.approx(0.0, abs=1e-6)
    u = s * (hoop - nu * (radial + axial)) / E
    strain = (radial - nu * (hoop + axial)) / E
    tiny = 1e-6 * np.abs(strain).max()
    assert np.gradient(u, s, edge_order=2) == pytest.approx(strain, abs=tiny)


def test_a_spun_section_keeps_its_energy():
    ring, a, w = 1.0, 0.01, 2e4
    time = 0.7 * 2 * math.pi / w
    angle, rate = spun_section(SOLID, ring, w, time)

    def stretch(s, phi):
        """Mean square over a circle of the hoop strain."""
        return quad(
            lambda t: (s * (math.cos(t + angle) - math.cos(t)) / ring) ** 2,
            0,
            2 * math.pi,
        )[0] / (2 * math.pi)

    # Both energies for each volume, means over the section.
    elastic = quad(lambda s: SOLID.young * stretch(s, angle) * s / a**2, 0, a)[0]
    kinetic = SOLID.density * a**2 / 4
    assert kinetic * rate**2 + elastic == pytest.approx(kinetic * w**2, rel=1e-9)
    # Without a hoop to stretch it turns evenly.
    angle, rate = spun_section(SOLID, 1e6, w, time)
    assert angle == pytest.approx(w * time, rel=1e-9)
