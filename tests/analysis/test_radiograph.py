"""Radiographs: against Abel transforms, the projection of a ball, and the mass."""

import math

import numpy as np
import pytest
from abel.tools.analytical import TransformPair
from launch import CASES
from scipy.integrate import quad

import mpisph.analysis.radiograph
from mpisph.analysis.radiograph import (
    areal_density,
    mass_attenuation,
    material_attenuations,
    transmission,
)
from mpisph.case import load_case
from mpisph.case.shapes.section import ring_shift

RHO = 2710.0


def lattice(nr, nz, dx, z_low=0.0, density=lambda r, z: np.full(r.shape, RHO)):
    """Rings on a square lattice with the axis between two columns."""
    r, z = np.meshgrid((np.arange(nr) + 0.5) * dx, z_low + (np.arange(nz) + 0.5) * dx)
    r, z = r.ravel(), z.ravel()
    rho = density(r, z)
    kept = rho > 0.0
    r, z, rho = r[kept], z[kept], rho[kept]
    return {"r": r, "z": z, "rho": rho, "m": 2 * np.pi * r * rho * dx**2}


def random_rings(n=400):
    rng = np.random.default_rng(3)
    return {
        "r": np.concatenate([[0.0], rng.uniform(0.0, 9e-3, n - 1) ** 2 / 9e-3]),
        "z": rng.uniform(-5e-3, 12e-3, n),
        "rho": rng.uniform(100.0, 3000.0, n),
        "m": rng.uniform(1e-8, 1e-6, n),
    }


WHOLE = ((-10e-3, 20e-3), 15e-3)


@pytest.mark.parametrize("pixel", [0.08e-3, 0.37e-3, 4e-3])
@pytest.mark.parametrize("widen", [1.0, 2.5])
def test_the_mass_in_view_is_exact(pixel, widen):
    arrays = random_rings()
    film = areal_density(arrays, *WHOLE, pixel, widen)
    mass = film.areal_density.sum() * pixel**2
    assert mass == pytest.approx(arrays["m"].sum(), rel=1e-12)
    assert (film.areal_density >= -1e-9).all()


@pytest.mark.parametrize("profile", [1, 3, 4, 6])
def test_smooth_profiles_have_pyabels_transform(profile):
    """A rod whose density depends on r alone; PyAbel knows the transform of some."""
    n = 200
    pair = TransformPair(n, profile=profile)
    R = 5e-3
    dx = R / n
    rod = lattice(
        n, 12, dx, density=lambda r, z: 1e3 * np.interp(r / R, pair.r, pair.func)
    )
    film = areal_density(rod, (4 * dx, 8 * dx), R, dx)
    half = film.areal_density[n:, :]
    wanted = 1e3 * R * np.interp((np.arange(n) + 0.5) / n, pair.r, pair.abel)
    for column in half.T:
        # Where the profile jumps, at its rim, the lattice is half a spacing wrong.
        assert column[:-6] == pytest.approx(wanted[:-6], abs=0.006 * wanted.max())


def test_a_uniform_ball_has_chords():
    n, R = 160, 4.765e-3
    ball = lattice(
        n, 2 * n, R / n, -R, lambda r, z: np.where(r**2 + z**2 < R**2, RHO, 0.0)
    )
    pixel = R / 40
    film = areal_density(ball, (-R, R), R, pixel)
    z = 0.5 * (film.z_edges[1:] + film.z_edges[:-1])
    y = 0.5 * (film.y_edges[1:] + film.y_edges[:-1])
    square = z[None, :] ** 2 + y[:, None] ** 2
    inside = square < (0.9 * R) ** 2
    chords = 2 * RHO * np.sqrt(R**2 - square[inside])
    assert film.areal_density[inside] == pytest.approx(chords, rel=0.015)
    assert film.areal_density[inside].mean() == pytest.approx(chords.mean(), rel=1e-3)
    outside = square > (1.06 * R) ** 2
    assert film.areal_density[outside].max() == 0.0


def test_one_ring_by_numerical_integration():
    ring = {"r": [3e-3], "z": [0.3e-3], "rho": [800.0]}
    ring = {name: np.array(x) for name, x in ring.items()}
    side = 1.1e-3
    ring["m"] = 2 * np.pi * ring["r"] * ring["rho"] * side**2
    ring["r"] = ring["r"] + ring_shift(ring["r"], side)
    pixel = 0.5e-3
    film = areal_density(ring, (-0.5e-3, 1.5e-3), 4e-3, pixel)
    # It reaches from z = -0.25 to 0.85 mm.
    heights = np.array([0.25e-3, 0.5e-3, 0.35e-3, 0.0])
    inner, outer = 3e-3 - side / 2, 3e-3 + side / 2

    def chord(y):
        lengths = [math.sqrt(max(R * R - y * y, 0.0)) for R in (outer, inner)]
        return 2 * (lengths[0] - lengths[1])

    for row in range(8):
        low, high = row * pixel, (row + 1) * pixel
        breaks = [y for y in (inner, outer) if low < y < high]
        area = quad(chord, low, high, points=breaks or None, epsabs=0.0)[0]
        wanted = 800.0 * area * heights / pixel**2
        assert film.areal_density[8 + row] == pytest.approx(wanted, rel=1e-6)
        assert film.areal_density[7 - row] == pytest.approx(wanted, rel=1e-6)


def test_the_edges_hold_the_view_in_square_pixels():
    film = areal_density(random_rings(), (-1e-3, 2.05e-3), 0.95e-3, 0.1e-3)
    assert film.areal_density.shape == (20, 31)
    assert film.z_edges[[0, -1]] == pytest.approx([-1e-3, 2.1e-3])
    assert film.y_edges[[0, -1]] == pytest.approx([-1e-3, 1e-3])
    assert np.diff(film.z_edges) == pytest.approx(0.1e-3)
    assert np.diff(film.y_edges) == pytest.approx(0.1e-3)
    exact = areal_density(random_rings(), (0.0, 0.3e-3), 0.3e-3, 0.1e-3)
    assert exact.areal_density.shape == (6, 3)


def test_a_part_of_the_view_shows_the_same():
    arrays, pixel = random_rings(), 0.25e-3
    arrays["z"][1:3] = -2.02e-3, 5.02e-3  # across the edges of the part
    arrays["r"][1:3] = 3e-3
    whole = areal_density(arrays, *WHOLE, pixel).areal_density
    part = areal_density(arrays, (-2e-3, 5e-3), 6e-3, pixel).areal_density
    # y from -15 and z from -10 mm; y from -6 and z from -2 mm.
    assert part == pytest.approx(whole[36:-36, 32 : 32 + 28], rel=1e-9, abs=1e-9)


def test_chunks_change_nothing(monkeypatch):
    whole = areal_density(random_rings(), *WHOLE, 0.5e-3).areal_density
    monkeypatch.setattr(mpisph.analysis.radiograph, "_CHUNK", 7)
    chunks = areal_density(random_rings(), *WHOLE, 0.5e-3).areal_density
    assert chunks == pytest.approx(whole, rel=1e-12, abs=1e-12)


def test_a_wider_ring_keeps_its_place():
    ring = {"r": [5e-3], "z": [1e-3], "rho": [900.0], "m": [1e-6]}
    ring = {name: np.array(x) for name, x in ring.items()}
    side = math.sqrt(1e-6 / (2 * np.pi * 5e-3 * 900.0))
    film = areal_density(ring, (0.0, 2e-3), 6e-3, 0.01e-3, widen=3.0)
    seen = np.flatnonzero(film.areal_density.any(axis=0)) * 0.01e-3
    assert seen.min() == pytest.approx(1e-3 - 1.5 * side, abs=0.011e-3)
    assert seen.max() + 0.01e-3 == pytest.approx(1e-3 + 1.5 * side, abs=0.011e-3)
    across = np.flatnonzero(film.areal_density.any(axis=1)) * 0.01e-3
    assert np.ptp(across) == pytest.approx(2 * (5e-3 + 1.5 * side), abs=0.021e-3)


def test_nothing_in_view_is_an_empty_film():
    film = areal_density(random_rings(), (1.0, 1.01), 1e-2, 1e-3)
    assert film.areal_density.shape == (20, 10)
    assert not film.areal_density.any()


@pytest.mark.parametrize(
    ("z_range", "y_max", "pixel", "widen"),
    [
        ((1.0, 1.0), 1.0, 0.1, 1.0),
        ((0.0, 1.0), -1.0, 0.1, 1.0),
        ((0.0, 1.0), 1.0, 0.0, 1.0),
        ((0.0, math.inf), 1.0, 0.1, 1.0),
        ((0.0, 1.0), 1.0, 0.1, 0.0),
    ],
)
def test_sizes_must_be_positive(z_range, y_max, pixel, widen):
    with pytest.raises(ValueError, match="positive"):
        areal_density(random_rings(), z_range, y_max, pixel, widen)


def test_transmission_of_aluminium():
    """2.699 g/cm2 are 1 cm; NIST's 0.2018 cm2/g at 80 keV, 0.1704 at 100 keV."""
    sigma = np.array([[0.0, 26.99], [53.98, 269.9]])
    wanted = np.exp(-0.2018 * sigma / 10.0)
    assert transmission(sigma, 0.02018) == pytest.approx(wanted, rel=1e-12)
    assert transmission(sigma, 0.02018)[0, 1] == pytest.approx(0.580, abs=1e-3)
    assert transmission(sigma, 0.01704)[0, 1] == pytest.approx(0.631, abs=1e-3)


@pytest.mark.parametrize(
    ("composition", "energy", "nist"),
    [
        ((("Al", 1.0),), 80e3, 0.02018),
        ((("Al", 1.0),), 60e3, 0.02778),
        ((("Al", 1.0),), 100e3, 0.01704),
        ((("Cu", 1.0),), 80e3, 0.07630),
        ((("Fe", 1.0),), 80e3, 0.05952),
        ((("W", 1.0),), 80e3, 0.7810),
        ((("Al", 0.9), ("Cu", 0.1)), 80e3, 0.9 * 0.02018 + 0.1 * 0.0763),
    ],
)
def test_attenuation_is_that_of_nist(composition, energy, nist):
    """Hubbell and Seltzer, NISTIR 5632 [m2/kg]."""
    assert mass_attenuation(composition, energy) == pytest.approx(nist, rel=0.01)


def test_each_material_of_a_case_attenuates_by_its_composition():
    case = load_case(
        CASES / "piekutowski-4-1353.toml", ["bodies.plate.material=cu-ofhc"]
    )
    assert material_attenuations(case) == pytest.approx([0.02018, 0.0763], rel=0.01)
    bare = {
        k: m.model_copy(update={"composition": {}}) for k, m in case.materials.items()
    }
    case = case.model_copy(update={"materials": bare})
    assert material_attenuations(case) == pytest.approx([0.02018] * 2, rel=0.01)


def test_weights_are_factors_on_the_mass():
    arrays = random_rings()
    view = ((-0.05, 0.05), 0.05, 0.005)
    weights = np.full(len(arrays["m"]), 3.0)
    one, three = (areal_density(arrays, *view, 1.0, w) for w in (None, weights))
    assert three.areal_density == pytest.approx(3.0 * one.areal_density)
