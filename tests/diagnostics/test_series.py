"""The series of a run: their terms by hand, and how parts are joined."""

import math

import numpy as np
import pytest
from oracles import cloud

from mpisph.core.particles import Particles
from mpisph.diagnostics.cloud import NEEDED, CloudDefinition, measure_arrays
from mpisph.diagnostics.series import (
    SERIES,
    Sample,
    Scales,
    bounds_of,
    joined,
    local_parts,
)

EVERYWHERE = CloudDefinition(-1.0, -math.inf, 0.99)
SCALES = Scales(mass=1.0, speed=1e4)


def measured(parts, definition):
    """The series of particles that so many ranks own."""
    found = [local_parts(p, definition, bounds_of(SCALES)) for p in parts]
    sums, maxima = (np.array(x) for x in zip(*found, strict=True))
    return joined(sums, maxima, bounds_of(SCALES))


def test_terms_of_two_particles():
    p = Particles.zeros(2)
    p.m[:] = 2.0, 3.0
    p.r[:] = 0.1, 0.2
    p.z[:] = 5.0, -3.0
    p.u_r[:] = 3.0, 0.0
    p.u_z[:] = 4.0, -1.0
    p.E[:] = 10.0, 20.0
    sample = Sample(p, CloudDefinition(1.0, 0.5, 0.99))
    terms = {series.name: series.terms(sample).tolist() for series in SERIES}
    assert terms == {
        "mass": [2.0, 3.0],
        "momentum_z": [8.0, -3.0],
        "kinetic_energy": [25.0, 1.5],
        "internal_energy": [20.0, 60.0],
        "energy_min": [10.0, 20.0],
        "cloud_radius": [0.1, 0.0],
        "cloud_length": [4.0, 0.0],
        "cloud_mass": [2.0, 0.0],
        "cloud_arrived": [0.0, 0.0],
    }


def test_series_are_sums_and_maxima_whoever_owns_what():
    p = cloud(300, 5)
    d = CloudDefinition(rear=1e-3, min_velocity=500.0, quantile=0.99)
    want = measure_arrays({name: getattr(p, name) for name in NEEDED}, d)
    owner = np.random.default_rng(1).integers(0, 3, p.n)
    whole = measured([p], d)
    assert whole == measured([p.take(owner == k) for k in range(4)], d)
    assert whole["mass"] == math.fsum(p.m)
    assert whole["internal_energy"] == math.fsum(p.m * p.E)
    assert whole["cloud_mass"] == pytest.approx(want.mass, rel=1e-14)
    assert (whole["cloud_radius"], whole["cloud_length"]) == (want.radius, want.length)


def test_no_particles_give_zero():
    assert set(measured([Particles.zeros(0)], EVERYWHERE).values()) == {0.0}


def test_a_term_beyond_its_bound_makes_the_sum_no_number():
    p = cloud(10, 6)
    p.E[3] = 1e30
    found = measured([p], EVERYWHERE)
    assert math.isnan(found["internal_energy"])
    assert not math.isnan(found["mass"])


def test_names_are_unique_and_every_series_is_described():
    names = [series.name for series in SERIES]
    assert len(set(names)) == len(names)
    assert all(series.label for series in SERIES)
