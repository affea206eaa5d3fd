"""R17: brittle failure from flaws."""

import math

import numpy as np
import pytest
from material_point import BULK, Point, models, uniaxial_strain
from oracles import approx
from scipy import stats

from mpisph.physics.cracks import CRACK_SPEED
from mpisph.physics.failure.grady_kipp import (
    MOST_FLAWS,
    active_flaws,
    cracks_in_a_piece,
    damage_of_flaws,
    uniform,
)

# Without compiling, numpy warns of products that wrap, as the generator's do.
pytestmark = pytest.mark.filterwarnings("ignore:overflow encountered in scalar")

BASALT = {"k": 4e35, "m": 9.0}
ELASTIC = {"shear_modulus": 22.7e9, "yield_strength": 3.5e9}


def splitmix(seed, number, draw):
    """The generator in whole numbers of Python."""
    mask, x = 2**64 - 1, 0
    for word in (seed, number, draw):
        x = ((x ^ word) + 0x9E3779B97F4A7C15) & mask
        x = ((x ^ (x >> 30)) * 0xBF58476D1CE4E5B9) & mask
        x = ((x ^ (x >> 27)) * 0x94D049BB133111EB) & mask
        x ^= x >> 31
    return ((x >> 11) + 0.5) / 2**53


def test_uniform_r17_is_a_function_of_three_integers():
    for key in ((0, 0, 0), (0, 7, 3), (5, 10**9, 60), (2**31 - 1, 1, 0)):
        assert uniform(*key) == splitmix(*key)


def test_uniform_r17_is_uniform_and_independent():
    x = np.array([[uniform(1, i, j) for j in range(20)] for i in range(3000)])
    assert stats.kstest(x.ravel(), "uniform").pvalue > 1e-3
    for pairs in ((x[:, :-1], x[:, 1:]), (x[:-1], x[1:])):
        r = np.corrcoef(pairs[0].ravel(), pairs[1].ravel())[0, 1]
        assert abs(r) < 4 / math.sqrt(pairs[0].size)


@pytest.mark.parametrize("expected", [0.05, 1.0, 12.0])
def test_active_flaws_r17_are_poisson(expected):
    n = np.array([active_flaws(3, i, expected) for i in range(4000)])
    assert n.mean() == approx(expected, abs=5 * math.sqrt(expected / 4000))
    assert n.var() == approx(expected, rel=0.15)
    none = (n == 0.0).mean()
    assert none == approx(math.exp(-expected), abs=0.03)


def test_active_flaws_r17_only_grow_with_strain():
    for number in range(50):
        n = [active_flaws(0, number, x) for x in np.linspace(0.0, 20.0, 60)]
        assert (np.diff(n) >= 0.0).all()
        assert n[0] == 0.0
    assert active_flaws(0, 1, MOST_FLAWS + 7.5) == MOST_FLAWS + 7.5


def test_damage_of_flaws_r17_grows_as_the_cube_of_the_cracks():
    D = 0.0
    for _ in range(10):
        D = damage_of_flaws(D, 3.0, 0.01)
    assert approx(0.3**3, rel=1e-12) == D
    assert damage_of_flaws(0.999, 1.0, 0.5) == 1.0
    assert damage_of_flaws(0.4, 0.0, 0.5) == approx(0.4, rel=1e-15)


def pulled(number, seed=0, size=1e-3, rate=100.0):
    """Peak tension of a particle that is pulled apart [Pa], and its last damage."""
    p = Point(
        models(
            {"failure": "grady-kipp", "strength": "elastic-plastic"},
            grady_kipp=BASALT | {"seed": seed},
            elastic_plastic=ELASTIC,
        ),
        size=size,
        number=number,
    )
    p.set(m=2700.0 * size**3)
    peak = 0.0
    for _ in range(400):
        p.strain(uniaxial_strain(rate), 1e-7, heat=False)
        peak = max(peak, p.get("S_zz") - p.get("P"))
    return peak, p.get("damage")


def test_particles_r17_break_at_strengths_of_their_own_the_same_for_a_number():
    found = [pulled(number) for number in range(5)]
    assert len({peak for peak, _ in found}) == 5
    assert all(damage == 1.0 for _, damage in found)
    assert found == [pulled(number) for number in range(5)]
    assert pulled(0, seed=1) != found[0]


@pytest.mark.parametrize("r", [0.4e-3, 5e-3])
@pytest.mark.parametrize("damage", [0.0, 0.3])
def test_damage_r17_grows_by_the_cracks_of_a_piece(r, damage):
    """``d D^(1/3)/dt = n s/(2 pi r) c_g/R``, n from the strain of the sound share."""
    s, dt, G, shear = 0.2e-3, 1e-10, 22.7e9, 0.4e9
    young = 9 * BULK * G / (3 * BULK + G)
    expected = 25.0
    k = expected / (2.0 * math.pi * r * s**2 * (shear / young) ** 9)
    p = Point(
        models(
            {"failure": "grady-kipp", "strength": "elastic-plastic"},
            grady_kipp={"k": k, "m": 9.0},
            elastic_plastic=ELASTIC,
        ),
        size=s,
        number=5,
        r=r,
    )
    p.set(m=2.0 * math.pi * r * 2700.0 * s**2, damage=damage)
    p.set(S_zz=(1.0 - damage) * shear, S_rr=-0.5 * (1.0 - damage) * shear)
    p.respond(dt)
    n = active_flaws(0, 5, expected)
    assert n > 0.0
    c_l = math.sqrt((BULK + 4 * G / 3) / 2700.0)
    cracks = n * s / (2 * math.pi * r)
    assert cracks < 1.0 / CRACK_SPEED
    rate = cracks * CRACK_SPEED * c_l / (s * (0.75 / math.pi) ** (1 / 3))
    grown = np.cbrt(p.get("damage")) - np.cbrt(damage)
    assert grown == approx(rate * dt, rel=1e-9)


def test_cracks_r17_in_a_piece_are_the_mean_around_the_ring():
    assert cracks_in_a_piece(10.0, 1e-3, 1e-2) == approx(10.0 / (20 * math.pi))
    assert cracks_in_a_piece(1e6, 1e-3, 1e-2) == 2.5


def test_the_weakest_flaw_r17_follows_weibull():
    """A slow pull breaks a particle at the strain of its weakest flaw."""
    V, m, k = 1e-9, 9.0, 4e35
    young = 9 * BULK * 22.7e9 / (3 * BULK + 22.7e9)
    U = uniform(0, 11, 0)
    weakest = (-math.log(U) / (k * V)) ** (1 / m)
    p = Point(
        models(
            {"failure": "grady-kipp", "strength": "elastic-plastic"},
            grady_kipp=BASALT,
            elastic_plastic=ELASTIC,
        ),
        number=11,
    )
    p.set(m=2700.0 * V)
    for share, broken in ((0.999, False), (1.001, True)):
        # Hydrostatic tension P = -young strain.
        p.set(rho=2700.0 * (1.0 - share * weakest * young / BULK), damage=0.0)
        p.respond(1e-9)
        assert (p.get("damage") > 0.0) == broken
