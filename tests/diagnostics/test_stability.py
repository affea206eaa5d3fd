"""Signs of an unstable run."""

import numpy as np
import pytest
from oracles import ALUMINIUM, COPPER, cloud, table_of

from mpisph.core.particles import VALUES, Particles
from mpisph.diagnostics.stability import (
    CROWDED,
    DENSITY,
    ENERGY,
    NEGATIVE,
    NON_FINITE,
    REASONS,
    SMOOTHING,
    STABLE,
    Bounds,
    first_fault,
)

BOUNDS = Bounds(
    density_min=0.01, density_max=5.0, energy_min=-2e7, energy_max=1e8,
    crowding_max=10.0, h_min=1e-6, h_max=1e3,
)  # fmt: skip
TABLE = table_of(ALUMINIUM, COPPER)


def sound(n=40):
    return cloud(n, 1, n_materials=2)


def test_a_sound_state_has_no_fault():
    for p in (sound(), Particles.zeros(0)):
        assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (STABLE, -1)


@pytest.mark.parametrize("name", VALUES)
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_a_field_that_is_not_finite(name, value):
    p = sound()
    getattr(p, name)[5] = value
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (NON_FINITE, p.id[5])


@pytest.mark.parametrize("h", [0.0, -1e-3])
def test_a_smoothing_length_that_is_not_positive(h):
    p = sound()
    p.h[5] = h
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (NON_FINITE, p.id[5])


@pytest.mark.parametrize("material", [0, 1])
def test_density_is_bounded_relative_to_the_own_material(material):
    rho0 = [ALUMINIUM.rho0, COPPER.rho0][material]
    for eta, fault in ((0.0099, DENSITY), (0.0101, STABLE), (4.99, STABLE)):
        p = sound()
        p.material[7] = material
        p.rho[7] = eta * rho0
        assert first_fault(p.labels, p.values, TABLE, BOUNDS)[0] == fault
    for rho in (5.01 * rho0, -rho0, 0.0):
        p.rho[7] = rho
        assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (DENSITY, p.id[7])


@pytest.mark.parametrize(("E", "fault"), [(1.01e8, ENERGY), (-2.02e7, NEGATIVE)])
def test_energy_is_bounded_on_both_sides(E, fault):
    p = sound()
    p.E[7] = E
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (fault, p.id[7])
    p.E[7] = 0.98 * E
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (STABLE, -1)


def test_the_kernel_sum_is_bounded_relative_to_the_density():
    p = sound()
    p.crowding[7] = 10.1
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (CROWDED, p.id[7])
    p.crowding[7] = 9.9
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (STABLE, -1)


@pytest.mark.parametrize("h", [0.9e-6, 1.1e3])
def test_smoothing_length_is_bounded_on_both_sides(h):
    p = sound()
    p.h[7] = h
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (SMOOTHING, p.id[7])
    p.h[7] = {0.9e-6: 1.1e-6, 1.1e3: 0.9e3}[h]
    assert first_fault(p.labels, p.values, TABLE, BOUNDS) == (STABLE, -1)


def test_the_faulty_particle_of_smallest_id_is_named_in_any_order():
    p = sound()
    by_id = np.argsort(p.id)
    p.E[by_id[9]] = 1e9
    p.rho[by_id[4]] = -1.0
    p.u_r[by_id[20]] = np.nan
    for seed in range(5):
        shuffled = p.take(np.random.default_rng(seed).permutation(p.n))
        assert first_fault(shuffled.labels, shuffled.values, TABLE, BOUNDS) == (
            DENSITY,
            4,
        )


def test_every_fault_has_a_reason():
    assert set(REASONS) == {
        NON_FINITE,
        DENSITY,
        ENERGY,
        NEGATIVE,
        CROWDED,
        SMOOTHING,
    }
