"""R16: spall, on a single particle that is pulled apart."""

import math

import numpy as np
import pytest
from material_point import BULK, Point, models, uniaxial_strain
from oracles import approx

from mpisph.physics.cracks import (
    CRACK_SPEED,
    crack_growth,
    largest_deviatoric_stress,
    ring_size,
)
from mpisph.physics.failure.spall import opening_growth

STRENGTH = 1.2e9
SIZE = 1e-4
ELASTIC = {"shear_modulus": 27e9, "yield_strength": 0.3e9}


def point(**spall):
    return Point(
        models({"failure": "spall"}, spall={"strength": STRENGTH} | spall), size=SIZE
    )


def pull(p, rate, dt, steps):
    """Pressures and stretches of equal steps."""
    found = []
    for _ in range(steps):
        p.strain(uniaxial_strain(rate), dt, heat=False)
        found.append(p.get("P", "damage"))
    return np.array(found)


@pytest.mark.parametrize("angle", [0.0, 0.7])
def test_largest_deviatoric_stress_r16_is_the_largest_eigenvalue(angle):
    for rr, zz, rz in ((1.0, 2.0, 0.5), (-3.0, 1.0, 2.0), (-1.0, -2.0, angle)):
        T = np.array([[rr, 0, rz], [0, -(rr + zz), 0], [rz, 0, zz]])
        want = np.linalg.eigvalsh(T).max()
        assert largest_deviatoric_stress(rr, zz, rz) == approx(want, rel=1e-14)


def test_crack_growth_r16_is_the_way_of_a_crack_over_the_size():
    c_l = math.sqrt(5000.0**2 + 4 * 27e9 / (3 * 2700.0))
    want = CRACK_SPEED * c_l * 1e-8 / 2e-4
    assert crack_growth(5000.0, 27e9, 2700.0, 2e-4, 1e-8) == approx(want, rel=1e-14)
    assert CRACK_SPEED == 0.4
    assert ring_size(2 * math.pi * 0.3 * 2700.0 * 4e-8, 0.3, 2700.0) == approx(2e-4)


def test_tension_r16_below_the_strength_does_no_harm():
    p = point()
    found = pull(p, 1e4, 1e-9, 1500)
    assert found[:, 0].min() == approx(BULK * (math.exp(-0.015) - 1), rel=1e-9)
    assert not found[:, 1].any()


@pytest.mark.parametrize("rate", [1e3, 1e5])
def test_a_crack_r16_runs_through_the_particle(rate):
    """The limit falls with the damage, and the damage grows at the crack's speed."""
    p = point()
    dt = 1e-9
    found = pull(p, rate, dt, int(0.0175 / rate / dt) + 200)
    begun = int(np.argmax(found[:, 1] > 0.0))
    P, D = found[begun:].T
    growth = np.diff(D[D < 1.0])
    # Sound speed of the linear equation: sqrt(K/rho0), P dP/dE is zero.
    want = CRACK_SPEED * math.sqrt(BULK / 2700.0) * dt / SIZE
    np.testing.assert_allclose(growth, want, rtol=0.02)  # the size grows by 1 %
    limit = -STRENGTH * (1.0 - np.concatenate([[0.0], D[:-1]]))
    np.testing.assert_allclose(P, limit, rtol=1e-12, atol=1.0)
    assert D[-1] == 1.0
    assert P[-1] == 0.0
    assert -found[:begun, 0].min() < STRENGTH


@pytest.mark.parametrize("crack_energy", [2e3, 2e4])
def test_work_of_a_crack_r16_is_its_energy(crack_energy):
    """From rest to failure the tension does G_c of work an area, whatever the size."""
    p = point(crack_energy=crack_energy)
    last = 2 * crack_energy / STRENGTH / SIZE  # strain when the crack is open
    rate, steps = 1e4, 20000
    dt = 1.2 * last / steps / rate
    found = pull(p, rate, dt, steps)
    work = -np.trapezoid(np.concatenate([[0.0], found[:, 0]]), dx=rate * dt) * SIZE
    # Of logarithmic strain; the size grows by it.
    assert work == approx(crack_energy, rel=0.02 + last)
    assert found[-1, 1] == 1.0
    half = int(np.argmax(found[:, 1] > 0.5))
    assert found[half, 0] == approx(-0.5 * STRENGTH, rel=1e-3)


def test_opening_growth_r16():
    last = 2 * 5e3 / 1e9 - 1e-4 * 1e9 / 70e9
    assert opening_growth(1e-3, 1e-4, 1e9, 5e3, 70e9) == approx(1e-7 / last, rel=1e-13)
    assert opening_growth(-1e-3, 1e-4, 1e9, 5e3, 70e9) == 0.0
    assert opening_growth(1e-3, 1e-1, 1e9, 5e3, 70e9) == math.inf


def test_failed_matter_r16_bears_pressure_and_nothing_else():
    p = Point(
        models(
            {"failure": "spall", "strength": "elastic-plastic"},
            spall={"strength": STRENGTH},
            elastic_plastic=ELASTIC,
        ),
        damage=1.0,
    )
    for eta, S in ((0.9, 1e8), (1.0, 1e8), (1.1, 1e8)):
        p.set(rho=2700.0 * eta, S_rz=S)
        p.respond(1e-9)
        assert p.get("P") == approx(max(BULK * (eta - 1.0), 0.0), abs=1e-3)
        assert p.get("S_rz", "G") == [0.0, 0.0]
    assert p.get("damage") == 1.0


def test_principal_stress_r16_can_fail_matter_that_pressure_would_not():
    """In uniaxial strain the axial tension is P plus two thirds of Y."""
    results = {}
    for criterion in ("pressure", "principal"):
        p = Point(
            models(
                {"failure": "spall", "strength": "elastic-plastic"},
                spall={"strength": STRENGTH, "criterion": criterion},
                elastic_plastic=ELASTIC,
            ),
            size=SIZE,
        )
        for _ in range(4000):
            p.strain(uniaxial_strain(1e4), 1e-9, heat=False)
            if p.get("damage") > 0.0:
                break
        assert p.get("damage") > 0.0
        results[criterion] = 2700.0 - p.get("rho")
    strain = {name: x / 2700.0 for name, x in results.items()}
    assert BULK * strain["pressure"] == approx(STRENGTH, rel=1e-3)
    assert BULK * strain["principal"] == approx(STRENGTH - 0.2e9, rel=1e-3)


def test_damage_r16_softens_shear():
    p = Point(
        models(
            {"failure": "none", "strength": "elastic-plastic"}, elastic_plastic=ELASTIC
        ),
        damage=0.25,
    )
    p.set(S_rz=1e9)
    p.respond(1e-9)
    assert p.get("G") == approx(0.75 * 27e9, rel=1e-14)
    assert p.stress == approx(0.75 * 0.3e9, rel=1e-14)
