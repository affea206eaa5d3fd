"""RingSections of rings: the volume that they sweep out, by Pappus and by cylinders."""

import numpy as np
import pytest

from mpisph.analysis.ring_sections import ring_sections
from mpisph.case import case_from_dict
from mpisph.case.discretise import discretise
from mpisph.case.shapes.section import ring_shift


def rings(r, volume, rho=2700.0):
    r = np.atleast_1d(np.asarray(r, float))
    return {
        "r": r,
        "m": np.broadcast_to(rho * volume, r.shape),
        "rho": np.full(r.shape, rho),
    }


def test_the_section_turned_about_the_axis_holds_the_mass():
    rng = np.random.default_rng(1)
    arrays = {
        "r": rng.uniform(0.0, 3e-3, 500),
        "m": rng.uniform(1e-9, 1e-6, 500),
        "rho": rng.uniform(50.0, 4000.0, 500),
    }
    ring = ring_sections(arrays)
    volume = np.pi * (ring.outer**2 - ring.inner**2) * ring.side
    assert (ring.inner == 0.0).sum() > 20, "discs are among them"
    assert (ring.inner > 0.0).sum() > 20
    np.testing.assert_allclose(arrays["rho"] * volume, arrays["m"], rtol=1e-12)
    np.testing.assert_allclose(ring.outer - ring.inner, ring.side, rtol=1e-12)


def test_away_from_the_axis_the_section_is_a_square_around_the_particle():
    shift = 0.5e-3**2 / (24.0 * 7e-3)
    ring = ring_sections(rings(7e-3 + shift, 2 * np.pi * 7e-3 * 0.5e-3**2))
    assert ring.side[0] == pytest.approx(0.5e-3)
    assert ring.inner[0] == pytest.approx(6.75e-3)


def test_the_rings_of_a_plate_fill_it():
    """At the start of a run they touch, from the axis on."""
    dx = 0.3e-3
    plate = {"shape": "plate", "name": "plate", "material": "al-lee2003"}
    case = case_from_dict(
        {
            "title": "t",
            "bodies": [plate | {"thickness": 2 * dx, "radius": 30 * dx}],
            "time": {"end": 1e-6},
            "resolution": {"spacing": dx, "nph": 1.5},
        }
    )
    p = discretise(case)
    ring = ring_sections({"m": p.m, "r": p.r, "rho": p.rho})
    column = np.argsort(np.argsort(p.r, kind="stable"), kind="stable") // 2
    np.testing.assert_allclose(ring.inner, column * dx, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(ring.side, dx, rtol=1e-9)


def test_at_the_axis_it_is_a_disc_as_high_as_its_radius():
    ring = ring_sections(rings([0.0, 0.1e-3], np.pi * 1e-9))
    assert ring.inner.tolist() == [0.0, 0.0]
    assert ring.side == pytest.approx([1e-3, 1e-3])
    assert ring.outer == pytest.approx([1e-3, 1e-3])


def test_disc_and_square_meet():
    innermost = 0.5e-3 + ring_shift(np.array(0.5e-3), 1e-3)
    near = ring_sections(rings([innermost - 1e-12, innermost + 1e-12], np.pi * 1e-9))
    assert near.side == pytest.approx([1e-3, 1e-3], rel=1e-8)
    assert near.outer == pytest.approx([1e-3, 1e-3], rel=1e-8)
