"""The series of a run: their terms by hand, and how parts are joined."""

import math

import numpy as np
import pytest
from oracles import cloud

from mpisph.core.particles import Particles
from mpisph.diagnostics.cloud import (
    NEEDED,
    CloudDefinition,
    in_cloud,
    measure_arrays,
    shows_arrival,
)
from mpisph.diagnostics.series import (
    SERIES,
    Scales,
    Terms,
    bounds_of,
    joined,
    local_parts,
    terms_of,
)

EVERYWHERE = CloudDefinition(-1.0, -math.inf, 0.99)
SCALES = Scales(mass=1.0, speed=1e4)


def measured(parts, definition):
    """The series of particles that so many ranks own."""
    found = [local_parts(p, definition, bounds_of(SCALES)) for p in parts]
    sums, maxima = zip(*found, strict=True)
    return joined(sum(sums), np.max(maxima, axis=0), bounds_of(SCALES))


def test_terms_of_two_particles():
    p = Particles.zeros(2)
    p.m[:] = 2.0, 3.0
    p.r[:] = 0.1, 0.2
    p.z[:] = 5.0, -3.0
    p.u_r[:] = 3.0, 0.0
    p.u_z[:] = 4.0, -1.0
    p.E[:] = 10.0, 20.0
    d = CloudDefinition(1.0, 0.5, 0.99)
    each = [terms_of(p.labels, p.values, k, d) for k in range(2)]
    assert Terms(*map(list, zip(*each, strict=True)))._asdict() == {
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


def test_what_is_behind_or_before_the_next_body_shows_that_the_cloud_has_come():
    """Bodies: 0 before the next body, at rest 5 m on; 1 that body; 2 another."""
    d = CloudDefinition(
        1.0, 0.5, 0.99, behind=np.array([np.nan, -2.0, np.nan]),
        before=np.array([True, False, False]), stop=4.0, stirred=3.0,
    )  # fmt: skip
    p = Particles.zeros(6)
    p.body[:] = 0, 0, 1, 1, 2, 0
    p.z[:] = 4.9, 5.1, 6.0, 6.0, 9.0, 2.0
    p.u_z[:] = 1.0, 1.0, -2.0, 0.0, 7.0, 7.0
    p.u_r[:] = 0.0, 0.0, 3.1, 2.2, 7.0, 7.0
    p.m[:] = 1.0
    p.retired[5] = 1.0
    shown = shows_arrival(p.body, p.z, p.u_r, p.u_z, d)
    inside = in_cloud(p.body, p.z, p.u_z, d)
    assert shown.tolist() == [False, True, True, False, False, False]
    assert inside.tolist() == [True, True, False, False, True, True]
    each = [terms_of(p.labels, p.values, k, d) for k in range(6)]
    assert [t.cloud_arrived for t in each] == shown.tolist()
    assert [t.cloud_mass for t in each] == (inside & (p.retired == 0.0)).tolist()


def test_what_is_no_number_is_seen_in_an_extreme():
    p = cloud(10, 6)
    p.E[3] = math.nan
    assert math.isnan(measured([p], EVERYWHERE)["energy_min"])


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
    assert tuple(names) == Terms._fields, "a name of another order has another's terms"
    assert all(series.label for series in SERIES)
