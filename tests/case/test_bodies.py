import numpy as np
import pytest

from mpisph.case.bodies import Annulus, Rectangle, regions_overlap

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
    ],
)
def test_known_pairs(one, other, expected):
    assert regions_overlap(one, other) is expected
    assert regions_overlap(other, one) is expected


@pytest.mark.parametrize("far", [0.0, -7.7e2, 3.3e5])
def test_touching_is_told_from_overlapping_at_all_sizes(far):
    """A grain on a plate a million times as wide, here and far from the origin."""
    plate = Rectangle(0.0, 1.0, far, far + 1e-3)
    grain = 1e-6
    assert not regions_overlap(plate, Annulus(0.0, grain, far - grain))
    assert regions_overlap(plate, Annulus(0.0, grain, far - 0.99 * grain))
    assert regions_overlap(plate, Annulus(0.0, grain, far + 0.5e-3))


def inside(region, r, z):
    if isinstance(region, Rectangle):
        in_z = (region.low < z) & (z < region.high)
        return (region.inner < r) & (r < region.outer) & in_z
    squared = r**2 + (z - region.centre) ** 2
    return (region.inner**2 < squared) & (squared < region.outer**2)


def random_region(rng):
    inner, width = rng.choice([0.0, rng.random()]), 0.1 + rng.random()
    if rng.random() < 0.5:
        return Annulus(inner, inner + width, 2.0 * rng.random())
    low = 2.0 * rng.random()
    return Rectangle(inner, inner + width, low, low + 0.1 + rng.random())


def test_against_a_fine_raster():
    rng = np.random.default_rng(1)
    r, z = np.meshgrid(np.linspace(0.0, 2.2, 200), np.linspace(-2.2, 4.2, 500))
    for _ in range(300):
        one, other = random_region(rng), random_region(rng)
        shared = np.count_nonzero(inside(one, r, z) & inside(other, r, z))
        if shared:
            assert regions_overlap(one, other)
        elif regions_overlap(one, other):
            # The raster may miss a sliver, never an overlap of several cells.
            assert sliver(one, other)


def sliver(one, other):
    r, z = np.meshgrid(np.linspace(0.0, 2.2, 2000), np.linspace(-2.2, 4.2, 3000))
    shared = np.count_nonzero(inside(one, r, z) & inside(other, r, z))
    return 0 < shared < 200
