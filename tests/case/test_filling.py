"""How bodies are divided among particles: square, hexagonal and polar."""

import math
from itertools import product

import numpy as np
import pytest
from scipy.spatial import cKDTree

from mpisph.case import case_from_dict
from mpisph.case.bodies import particle_count
from mpisph.case.discretise import discretise, initial_count
from mpisph.core.errors import CaseError

RHO = 2710.0
BODIES = {
    "sphere": ({"radius": 5e-3}, 4 / 3 * math.pi * 5e-3**3),
    "spherical_shell": (
        {"outer_radius": 5e-3, "inner_radius": 3e-3},
        4 / 3 * math.pi * (5e-3**3 - 3e-3**3),
    ),
    "plate": (
        {"thickness": 2e-3, "radius": 20e-3, "inner_radius": 1e-3},
        math.pi * (20e-3**2 - 1e-3**2) * 2e-3,
    ),
    "cylinder": ({"length": 20e-3, "radius": 4e-3}, math.pi * 4e-3**2 * 20e-3),
}
EACH = [
    *product(("sphere", "spherical_shell"), ("hexagonal", "polar")),
    *product(("plate", "cylinder"), ("square", "hexagonal")),
]
each = pytest.mark.parametrize(("shape", "filling"), EACH)


def make(shape, filling="square", spacing=2.7e-4, **changes):
    body = {"shape": shape, "name": "body", "material": "al-lee2003"}
    body |= {**BODIES[shape][0], "filling": filling, **changes}
    data = {"title": "t", "bodies": [body], "time": {"end": 1e-6}}
    return case_from_dict({**data, "resolution": {"spacing": spacing, "nph": 1.5}})


@each
@pytest.mark.parametrize("spacing", [1e-4, 2.7e-4, 1.9e-3])
def test_the_mass_is_exact(shape, filling, spacing):
    p = discretise(make(shape, filling, spacing))
    assert p.m.sum() == pytest.approx(RHO * BODIES[shape][1], rel=1e-13)
    assert p.m.min() > 0.0


@each
def test_particles_lie_within_and_are_counted(shape, filling):
    case = make(shape, filling, position=0.3)
    p, section = discretise(case), case.bodies[0].section
    inner, outer = section.radii(p.z)
    assert ((inner < p.r) & (p.r < outer)).all()
    assert initial_count(case) == p.id.size
    assert particle_count(case.bodies, case.spacing) == pytest.approx(
        p.id.size, rel=0.02
    )
    if shape in {"plate", "cylinder"}:
        assert particle_count(case.bodies, case.spacing) == p.id.size


@each
def test_a_body_is_the_same_seen_from_above(shape, filling):
    case = make(shape, filling, position=0.0)
    p, middle = discretise(case), case.bodies[0].section.middle
    up = np.lexsort((p.r, p.z - middle))
    down = np.lexsort((p.r, middle - p.z))
    for name in ("r", "m", "h"):
        values = getattr(p, name)
        np.testing.assert_allclose(values[up], values[down], rtol=1e-12)
    np.testing.assert_allclose(p.z[up] - middle, middle - p.z[down], atol=1e-17)


@each
def test_a_share_has_the_same_bits(shape, filling):
    case = make(shape, filling)
    everything = discretise(case).fields()
    n = initial_count(case)
    for first, end in [(0, 1), (5, 5), (n // 3, n // 3 + 7), (n - 2, n)]:
        for name, values in discretise(case, first, end).fields().items():
            assert values.tobytes() == everything[name][first:end].tobytes()


@each
def test_neighbours_are_a_spacing_apart(shape, filling):
    case = make(shape, filling, 1e-4)
    p = discretise(case)
    places = np.stack([p.r, p.z], axis=1)
    nearest = cKDTree(places).query(places, k=2)[0][:, 1]
    # Neighbours in a hexagonal lattice are further apart than in a square one.
    usual = 1e-4 * (math.sqrt(2 / math.sqrt(3)) if filling == "hexagonal" else 1.0)
    assert np.median(nearest) == pytest.approx(usual, rel=0.03)
    assert nearest.min() > 0.6e-4
    np.testing.assert_allclose(p.h / 1.5e-4, 1.0, atol=0.12)


def test_a_hexagonal_lattice_has_six_neighbours():
    p = discretise(make("cylinder", "hexagonal", 1e-4))
    places = np.stack([p.r, p.z], axis=1)
    inside = (p.r > 1e-3) & (p.r < 3e-3) & (p.z > 1e-3) & (p.z < 19e-3)
    around = cKDTree(places).query(places[inside], k=8)[0]
    assert around[:, 6].max() < 1.03 * around[:, 1].min()
    assert around[:, 7].min() > 1.6 * around[:, 1].max()


def test_polar_layers_are_of_equal_depth_and_angle():
    p = discretise(make("spherical_shell", "polar", 5e-4, position=0.1))
    s, b = np.hypot(p.r, p.z - 0.1), np.arctan2(p.z - 0.1, p.r)
    middle = np.array([3.25, 3.75, 4.25, 4.75]) * 1e-3
    count = np.rint(math.pi * middle / 5e-4).astype(int)
    np.testing.assert_allclose(
        s, np.repeat(middle + 5e-4**2 / (12 * middle), count), rtol=1e-13
    )
    first = b[: count[0]]
    angle = math.pi / count[0]
    mid = (np.arange(count[0]) + 0.5) * angle - 0.5 * math.pi
    np.testing.assert_allclose(first, mid - angle**2 / 24 * np.tan(mid), atol=1e-13)


def gauss(p, centre, width):
    """The integral over a Gaussian on the axis, as the particles have it."""
    return (p.m / RHO * np.exp(-((p.r**2 + (p.z - centre) ** 2) / width**2))).sum()


@pytest.mark.parametrize(
    ("shape", "filling", "centre", "width"),
    [
        ("sphere", "polar", 1e-3, 0.6e-3),
        ("spherical_shell", "polar", 4e-3, 0.15e-3),
        ("cylinder", "hexagonal", 9.7e-3, 0.6e-3),
        ("cylinder", "square", 9.7e-3, 0.6e-3),
        ("sphere", "square", 1e-3, 0.6e-3),
    ],
)
def test_sums_over_rings_r1_are_integrals_at_the_axis(shape, filling, centre, width):
    """To fourth order; with rings at the middle of their parts, to second."""
    exact = math.pi**1.5 * width**3
    coarse, fine = (
        abs(gauss(discretise(make(shape, filling, dx)), centre, width) / exact - 1.0)
        for dx in (width / 3, width / 6)
    )
    assert coarse < 0.01
    assert fine < coarse / 11.0


def test_only_round_bodies_are_filled_in_layers():
    with pytest.raises(CaseError, match='filling = "polar": expected "square" or "hex'):
        make("plate", "polar")


@pytest.mark.parametrize("filling", ["square", "hexagonal", "polar"])
@pytest.mark.parametrize("inner", [1e-5, 0.3333e-3, 1.9e-3])
def test_the_thinnest_wall_allowed_holds_particles(filling, inner):
    sizes = {"inner_radius": inner, "outer_radius": inner + 1e-4}
    case = make("spherical_shell", filling, 1e-4 * (1 - 1e-9), **sizes)
    assert initial_count(case) > 0


@pytest.mark.parametrize("radius", [1e-4, 1.4e-4, 2.6e-4])
@pytest.mark.parametrize("filling", ["hexagonal", "polar"])
def test_the_smallest_spheres_hold_particles(radius, filling):
    p = discretise(make("sphere", filling, 1e-4, radius=radius))
    assert p.m.sum() == pytest.approx(RHO * 4 / 3 * math.pi * radius**3, rel=1e-13)
