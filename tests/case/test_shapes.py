"""Shapes: what follows from their sections, and what every listed one must have."""

from dataclasses import dataclass

import numpy as np
import pytest
from shapes import example, names

from mpisph.case import Case, case_from_dict, case_schema
from mpisph.case.bodies import SHAPES, particle_count
from mpisph.case.discretise import discretise, initial_count
from mpisph.case.shapes.annulus import Annulus
from mpisph.case.shapes.overlap import sections_overlap
from mpisph.case.shapes.rectangle import Rectangle
from mpisph.case.shapes.section import Section
from mpisph.core.errors import CaseError


@dataclass(frozen=True)
class Cone(Section):
    """No shape of the program: a section that has only what it must have."""

    radius: float
    low: float
    high: float

    @property
    def ends(self):
        return self.low, self.high

    @property
    def widest(self):
        return self.radius

    @property
    def area(self):
        return 0.5 * self.radius * (self.high - self.low)

    @property
    def volume(self):
        return np.pi * self.radius**2 * (self.high - self.low) / 3.0

    @property
    def walls(self):
        return ()

    def radii(self, z):
        outer = self.radius * (self.high - z) / (self.high - self.low)
        return np.zeros_like(z), outer


PLATE = Rectangle(0.0, 10.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("one", "other", "expected"),
    [
        (PLATE, Rectangle(0.0, 10.0, 1.0, 2.0), False),
        (PLATE, Rectangle(0.0, 10.0, 0.9, 2.0), True),
        (PLATE, Rectangle(10.0, 12.0, 0.0, 1.0), False),
        (PLATE, Rectangle(0.0, 1.0, 0.2, 0.3), True),
        (PLATE, Annulus(0.0, 5.0, -5.0), False),
        (PLATE, Annulus(0.0, 5.0, -4.99), True),
        (PLATE, Annulus(0.0, 5.0, 6.0), False),
        (PLATE, Annulus(0.0, 0.1, 0.5), True),
        (PLATE, Annulus(10.1, 11.0, 0.5), False),
        (PLATE, Annulus(10.0, 11.0, 0.5), True),
        (Rectangle(3.0, 4.0, -9.0, 9.0), Annulus(0.0, 3.0, 0.0), False),
        (Rectangle(3.0, 4.0, -9.0, 9.0), Annulus(0.0, 3.1, 0.0), True),
        (Annulus(0.0, 2.0, 0.0), Annulus(0.0, 3.0, 5.0), False),
        (Annulus(0.0, 2.0, 0.0), Annulus(0.0, 3.0, 4.9), True),
        (Annulus(2.0, 3.0, 0.0), Annulus(0.0, 2.0, 0.0), False),
        (Annulus(2.0, 3.0, 0.0), Annulus(0.0, 2.1, 0.0), True),
        (Annulus(2.0, 3.0, 0.0), Annulus(0.0, 1.0, 1.0), False),
        (Annulus(2.0, 3.0, 0.0), Annulus(0.0, 1.0, 1.1), True),
        (Annulus(2.0, 3.0, 0.0), Annulus(2.0, 3.0, 0.0), True),
        # Two walls that are thin where they cross, and nowhere else near each other.
        (Annulus(2.0, 2.000001, 0.0), Rectangle(1.0, 1.000001, -9.0, 9.0), True),
        (Annulus(2.0, 2.000001, 0.0), Rectangle(1.0, 1.000001, -1.0, 1.0), False),
        (Annulus(2.0, 2.000001, 0.0), Annulus(1.0, 1.000001, 2.0), True),
        (Cone(3.0, 0.0, 4.0), Rectangle(0.0, 9.0, 4.0, 5.0), False),
        (Cone(3.0, 0.0, 4.0), Rectangle(0.0, 9.0, 3.999, 5.0), True),
        (Cone(3.0, 0.0, 4.0), Rectangle(1.5, 9.0, 2.0, 5.0), False),
        (Cone(3.0, 0.0, 4.0), Rectangle(1.499, 9.0, 2.0, 5.0), True),
        # The sphere within the cone that touches its base and its side.
        (Cone(3.0, 0.0, 4.0), Annulus(1.5, 2.0, 1.5), True),
        (Cone(3.0, 0.0, 4.0), Annulus(5.0, 6.0, 0.0), False),
        (Cone(3.0, 0.0, 4.0), Annulus(2.4, 2.5, 0.0), True),
    ],
)
def test_known_pairs(one, other, expected):
    assert sections_overlap(one, other) is expected
    assert sections_overlap(other, one) is expected


@pytest.mark.parametrize("far", [0.0, -7.7e2, 3.3e5])
def test_touching_is_told_from_overlapping_at_all_sizes(far):
    """A grain on a plate a million times as wide, here and far from the origin."""
    plate = Rectangle(0.0, 1.0, far, far + 1e-3)
    grain = 1e-6
    assert not sections_overlap(plate, Annulus(0.0, grain, far - grain))
    assert sections_overlap(plate, Annulus(0.0, grain, far - 0.99 * grain))
    assert sections_overlap(plate, Annulus(0.0, grain, far + 0.5e-3))


def inside(section, r, z):
    if isinstance(section, Cone):
        height = (section.high - z) / (section.high - section.low)
        return (height < 1.0) & (r < section.radius * height)
    if isinstance(section, Rectangle):
        in_z = (section.low < z) & (z < section.high)
        return (section.inner < r) & (r < section.outer) & in_z
    squared = r**2 + (z - section.centre) ** 2
    return (section.inner**2 < squared) & (squared < section.outer**2)


def random_section(rng):
    inner, width = rng.choice([0.0, rng.random()]), 0.1 + rng.random()
    low, kind = 2.0 * rng.random(), rng.integers(3)
    if kind == 0:
        return Annulus(inner, inner + width, low)
    if kind == 1:
        return Cone(inner + width, low, low + 0.1 + rng.random())
    return Rectangle(inner, inner + width, low, low + 0.1 + rng.random())


def test_against_a_fine_raster():
    rng = np.random.default_rng(1)
    r, z = np.meshgrid(np.linspace(0.0, 2.2, 200), np.linspace(-2.2, 4.2, 500))
    for _ in range(300):
        one, other = random_section(rng), random_section(rng)
        shared = np.count_nonzero(inside(one, r, z) & inside(other, r, z))
        if shared:
            assert sections_overlap(one, other)
        elif sections_overlap(one, other):
            # The raster may miss a sliver, never an overlap of several cells.
            assert sliver(one, other)


def sliver(one, other):
    r, z = np.meshgrid(np.linspace(0.0, 2.2, 2000), np.linspace(-2.2, 4.2, 3000))
    shared = np.count_nonzero(inside(one, r, z) & inside(other, r, z))
    return 0 < shared < 200


@pytest.mark.parametrize("grain", [1e-6, 1e-2, 1.0])
@pytest.mark.parametrize("far", [0.0, -7.7e2, 3.3e5])
def test_a_ball_may_touch_a_shell_from_within(grain, far):
    """Where rounding along z is largest along r: at the pole."""
    shell = Annulus(1.0, 1.1, far)
    at_the_pole = far - 1.0 + grain
    assert not sections_overlap(shell, Annulus(0.0, grain, at_the_pole))
    assert sections_overlap(shell, Annulus(0.0, grain, at_the_pole - 1e-2 * grain))


def test_a_lattice_follows_from_the_radii_alone():
    cone = Cone(3.0, 0.0, 4.0)
    lattice = cone.lattice(0.01)
    row = np.repeat(np.arange(lattice.z.size), lattice.length)
    assert (np.diff(lattice.z) > 0.0).all()
    assert row.size == pytest.approx(cone.count(0.01), rel=0.01)
    last = lattice.inner + (lattice.first + lattice.length - 0.5) * lattice.width
    assert inside(cone, last, lattice.z).all()
    assert not inside(cone, last + lattice.width, lattice.z).any()


every_shape = pytest.mark.parametrize("shape", SHAPES)


def case_of(shape, **changes):
    body = {**example(shape), **changes}
    time = {"end": 1e-6}
    resolution = {"spacing": 2e-4}
    data = {"title": "t", "bodies": [body], "resolution": resolution, "time": time}
    return case_from_dict(data)


@every_shape
def test_the_particles_of_a_shape_lie_within_it(shape):
    case = case_of(shape, position=0.3)
    section = case.bodies[0].section
    p = discretise(case)
    inner, outer = section.radii(p.z)
    low, high = section.ends
    assert ((low < p.z) & (p.z < high)).all()
    assert ((inner < p.r) & (p.r < outer)).all()
    assert outer.max() <= section.widest
    assert p.id.size == initial_count(case)
    assert p.id.size == pytest.approx(particle_count(case.bodies, 2e-4), rel=0.05)


@every_shape
def test_the_mass_of_a_shape_is_that_of_its_volume(shape):
    case = case_of(shape)
    (body,) = case.bodies
    low, high = body.section.ends
    z = low + (np.arange(20_000) + 0.5) * (high - low) / 20_000
    inner, outer = body.section.radii(z)
    volume = np.pi * (outer**2 - inner**2).mean() * (high - low)
    mass = case.body_material(body).rho0 * volume
    assert discretise(case).m.sum() == pytest.approx(mass, rel=0.01)
    area = (outer - inner).mean() * (high - low)
    assert body.section.area == pytest.approx(area, rel=1e-4)


@every_shape
def test_a_body_overlaps_itself_and_no_other_beside_it(shape):
    one = case_of(shape).bodies[0]
    low, high = one.section.ends
    beside = one.model_copy(update={"position": one.position + high - low})
    assert sections_overlap(one.section, one.section)
    assert not sections_overlap(one.section, beside.section)


@every_shape
def test_a_shape_is_described_and_known_to_the_schema(shape):
    body = case_of(shape).bodies[0]
    assert "mm" in body.describe()
    assert body.shape in names()
    assert body.label().replace(" ", "_") == body.shape
    assert shape.__name__ in case_schema()["$defs"]


def test_an_unknown_shape_is_told_all_that_are_known(data):
    data["bodies"][0]["shape"] = "cube"
    with pytest.raises(CaseError) as caught:
        case_from_dict(data)
    choices = " or ".join(f'"{name}"' for name in sorted(names()))
    assert f"expected {choices}" in str(caught.value)


@every_shape
def test_the_walls_of_a_shape_must_hold_particles(shape):
    body = case_of(shape).bodies[0]
    for _, thickness, least in body.section.walls:
        spacing = 1.01 * thickness / least
        changed = {**dict(case_of(shape)), "resolution": {"spacing": spacing}}
        with pytest.raises(ValueError, match="is thinner than"):
            Case.model_validate(changed)
