"""Sections of particles: lattice cells, areas by Pappus, matter that is spread."""

import subprocess
import sys

import numpy as np
import pytest

from mpisph.case import case_from_dict
from mpisph.case.discretise import discretise
from mpisph.figures.sections import section_area

RHO = 2710.0
"""Density at rest of al-lee2003 [kg/m3]."""

GAS = {"rho0": 2.0, "strength": "none", "eos": "ideal-gas"}
GAS |= {"ideal-gas": {"gamma": 1.4, "c0": 1.0}}


def make_case(*bodies, spacing=0.1e-3):
    return case_from_dict(
        {
            "title": "t",
            "bodies": list(bodies),
            "materials": {"gas": GAS},
            "time": {"end": 1e-6},
            "resolution": {"spacing": spacing},
        }
    )


def ball(**changes):
    body = {"shape": "sphere", "name": "ball", "radius": 1e-3, "position": -2e-3}
    return {**body, "material": "al-lee2003", **changes}


def particles(mass, r, rho, body=0):
    shape = np.broadcast_shapes(*map(np.shape, (mass, r, rho)))
    fields = {"m": mass, "r": r, "rho": rho}
    arrays = {name: np.full(shape, x, float) for name, x in fields.items()}
    return {**arrays, "body": np.full(shape, body)}


@pytest.mark.parametrize("filling", ["square", "hexagonal"])
def test_at_the_start_it_is_the_cell_of_the_lattice(filling):
    case = make_case(ball(filling=filling))
    p = discretise(case)
    arrays = {name: getattr(p, name) for name in ("m", "r", "rho", "body")}
    area = section_area(arrays, case)
    assert area.shape == p.r.shape
    outside = p.r > 2.5 * case.spacing  # at the axis cells may be cut by it
    assert outside.sum() > 100
    np.testing.assert_allclose(area[outside], case.spacing**2, rtol=3e-3)
    assert area.sum() == pytest.approx(0.5 * np.pi * 1e-6, rel=0.02)


def test_away_from_the_axis_it_is_that_of_pappus():
    r, rho, mass = 5e-3, np.array([RHO, 1.5 * RHO, 3.0 * RHO]), 1e-7
    area = section_area(particles(mass, r, rho), make_case(ball()))
    np.testing.assert_allclose(area * 2.0 * np.pi * r * rho, mass, rtol=1e-3)


def test_matter_that_flies_apart_gets_thin():
    radii = np.array([2e-3, 4e-3, 8e-3])
    area = section_area(particles(1e-8, radii, RHO), make_case(ball()))
    np.testing.assert_allclose(area[:-1] / area[1:], 2.0, rtol=1e-3)


def test_matter_below_the_density_at_rest_has_the_section_at_rest():
    case = make_case(ball())
    rho = RHO * np.array([1.0, 0.9, 1e-3, 1e-9])
    area = section_area(particles(1e-8, 5e-3, rho), case)
    assert np.unique(area).size == 1
    assert area[0] == pytest.approx(1e-8 / (2.0 * np.pi * 5e-3 * RHO), rel=1e-3)


def test_it_is_bounded_at_the_axis():
    mass = 1e-8
    area = section_area(
        particles(mass, np.array([0.0, 1e-9, 1e-5]), RHO), make_case(ball())
    )
    # A disc as high as its radius holds the mass.
    np.testing.assert_allclose(np.pi * area**1.5 * RHO, mass, rtol=1e-9)


@pytest.mark.parametrize(
    ("density", "least"),
    [(None, 2.0), (0.5, 0.5), (3.0, 2.0), ("1 - 0.5*s/1e-3", 0.5)],
)
def test_a_body_is_at_rest_at_its_own_density(density, least):
    given = {} if density is None else {"density": density}
    case = make_case(ball(), ball(name="gas", material="gas", position=2e-3, **given))
    area = section_area(particles(1e-11, 5e-3, np.array([1e-3, 1e-6]), body=1), case)
    assert area[0] == area[1]
    assert 1e-11 / (2.0 * np.pi * 5e-3 * area[0]) == pytest.approx(least, rel=0.15)


def test_it_loads_nothing_that_draws():
    code = "import sys, mpisph.figures.sections; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
