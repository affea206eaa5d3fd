"""R16: spall, on a single particle that is pulled apart."""

import math

import numpy as np
import pytest
from material_point import BULK, Point, models, uniaxial_strain
from oracles import approx

from mpisph.physics.cracks import (
    BAND,
    CRACK_SPEED,
    crack_growth,
    largest_deviatoric_stress,
    ring_size,
)
from mpisph.physics.failure.spall import (
    LEAST_LENGTH,
    opening_growth,
    opening_strain,
    relaxed_share,
    untorn_share,
)

STRENGTH = 1.2e9
SIZE = 1e-4
WIDTH = BAND * 1.5 * SIZE  # of the band that a crack stretches
RESOLVED = LEAST_LENGTH * WIDTH * STRENGTH**2 / BULK  # the least crack energy
ELASTIC = {"shear_modulus": 27e9, "yield_strength": 0.3e9}


def point(strong=False, **spall):
    """A particle that spalls, with or without strength in shear."""
    choices = {"failure": "spall"}
    if strong:
        choices["strength"] = "elastic-plastic"
    constants = {"spall": {"strength": STRENGTH} | spall, "elastic_plastic": ELASTIC}
    return Point(models(choices, **constants), size=SIZE)


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


def test_a_crack_r16_runs_through_the_particle_at_its_speed_at_most():
    """The limit falls with the damage, and the damage grows at the crack's speed."""
    p = point()
    dt = 1e-9
    found = pull(p, 1e7, dt, 60)
    begun = int(np.argmax(found[:, 1] > 0.0))
    P, D = found[begun:].T
    growth = np.diff(D[D < 1.0])
    # Sound speed of the linear equation: sqrt(K/rho0), P dP/dE is zero. The size grows.
    want = CRACK_SPEED * math.sqrt(BULK / 2700.0) * dt / SIZE
    size = np.exp(0.5 * 1e7 * dt * (begun + 2 + np.arange(growth.size)))
    np.testing.assert_allclose(growth * size, want, rtol=0.01)
    limit = -STRENGTH * (1.0 - np.concatenate([[0.0], D[:-1]]))
    np.testing.assert_allclose(P, limit, rtol=1e-12, atol=1.0)
    assert D[-1] == 1.0
    assert P[-1] == 0.0


@pytest.mark.parametrize("share", [0.0, 0.5, 1.5, 5.0])
def test_work_of_a_crack_r16_is_its_energy(share):
    """To open it, the tension does G_c of work an area, or as much as is resolved."""
    p = point(crack_energy=share * RESOLVED)
    energy = max(share, 1.0) * RESOLVED
    last = 2 * energy / STRENGTH / WIDTH  # strain when the crack is open
    rate, steps = 1e4, 10000
    dt = 1.2 * last / steps / rate
    found = pull(p, rate, dt, steps)
    work = -np.trapezoid(np.concatenate([[0.0], found[:, 0]]), dx=rate * dt) * WIDTH
    # Of logarithmic strain.
    assert work == approx(energy, rel=last)
    assert found[-1, 1] == 1.0
    half = int(np.argmax(found[:, 1] > 0.5))
    assert found[half, 0] == approx(-0.5 * STRENGTH, rel=2e-3)
    # Half open: half of the last opening, and half of the strength's strain.
    strain = np.expm1(rate * dt * (half + 1))
    assert strain == approx(0.5 * (last + STRENGTH / BULK), rel=0.05)


def test_a_crack_r16_closes_elastically():
    """The tension falls with the bulk modulus, to zero, until the faces meet."""
    p = point(crack_energy=3 * RESOLVED)
    rate, dt = 1e4, 1e-9
    damage = 0.0
    while damage < 0.3:
        p.strain(uniaxial_strain(rate), dt, heat=False)
        damage = p.get("damage")
    open_density = p.get("rho")
    tension = -p.get("P")
    assert tension == approx(0.7 * STRENGTH, rel=1e-3)
    p.strain(uniaxial_strain(-rate), 100 * dt, heat=False)
    assert p.get("damage") == damage
    slope = (tension + p.get("P")) / math.log(p.get("rho") / open_density)
    # Of matter between the cracks, whose density is near the reference density.
    assert slope == approx(BULK, rel=0.03)
    p.set(rho=0.5 * (open_density + 2700.0))
    p.respond(dt)
    assert p.get("P") == 0.0
    p.set(rho=2700.0 * 1.01)
    p.respond(dt)
    assert p.get("P") == approx(0.01 * BULK, rel=1e-9)
    # Pulled apart again, it bears the same tension at the same opening.
    p.set(rho=open_density)
    p.respond(dt)
    assert p.get("P") == approx(-tension, rel=1e-3)
    assert p.get("damage") == approx(damage, rel=1e-4)


def test_opening_strain_r16_is_at_least_what_the_spacing_resolves():
    assert opening_strain(1e-4, 1e9, 5e3, 70e9) == approx(
        max(1e-5 / (BAND * 1e-4), 2 * LEAST_LENGTH / 70), rel=1e-14
    )
    assert opening_strain(1e-4, 1e9, 1e5, 70e9) == approx(2e-4 / (BAND * 1e-4))
    assert opening_strain(1e-4, 1e9, 0.0, 70e9) == approx(2 * LEAST_LENGTH / 70)


def test_opening_growth_r16_takes_up_the_excess():
    """With the new damage, the tension between the cracks is what they let through."""
    D, dD = 0.2, opening_growth(3e7, 0.1, 1e9, 70e9)
    strain = D * 0.1 + ((1.0 - D) * 1e9 + 3e7) / 70e9
    D += dD
    assert 70e9 * (strain - D * 0.1) == approx((1.0 - D) * 1e9, rel=1e-12)


TIME = 1e-8


def pulled_open(rate, end, steps):
    """The opening and the tension by the equation of the opening itself.

    Classical Runge-Kutta with steps of its own; the tension between the cracks is that
    of the linear equation of state.
    """
    last = 2.0 * LEAST_LENGTH * STRENGTH / BULK

    def excess(t, o):
        solid = math.exp(-rate * t) * (1.0 + o * last)
        return BULK * (1.0 - solid) - (1.0 - o) * STRENGTH

    def speed(t, o):
        return max(excess(t, o), 0.0) / (BULK * last - STRENGTH) / TIME

    o, dt = 0.0, end / steps
    for i in range(steps):
        t = i * dt
        a = speed(t, o)
        b = speed(t + 0.5 * dt, o + 0.5 * dt * a)
        c = speed(t + 0.5 * dt, o + 0.5 * dt * b)
        o += dt / 6.0 * (a + 2.0 * b + 2.0 * c + speed(t + dt, o + dt * c))
    return o, (1.0 - o) * STRENGTH + excess(end, o)


@pytest.mark.parametrize("rate", [3e5, 1e6])
def test_an_excess_r16_relaxes_as_its_equation_says(rate):
    """Of the first order: half the step, half of what is wrong."""
    begins = STRENGTH / BULK / rate
    end = begins + 3.0 * TIME
    opening, tension = pulled_open(rate, end, 20000)
    off = []
    for steps in (1000, 2000):
        p = point(relaxation_time=TIME)
        found = pull(p, rate, end / steps, steps)
        assert p.get("opening") == approx(opening, rel=0.02)
        assert -found[-1, 0] == approx(tension, rel=0.003)
        off.append(abs(p.get("opening") - opening))
    assert off[1] == approx(0.5 * off[0], rel=0.2)


@pytest.mark.parametrize("dt", [0.1 * TIME, TIME, 3.0 * TIME])
def test_the_strength_r16_rises_by_the_rate_times_the_time_at_any_step(dt):
    rate = 1e5
    p = point(relaxation_time=TIME, crack_energy=5 * RESOLVED)
    steps = int((STRENGTH / BULK / rate + 20.0 * TIME) / dt)
    found = pull(p, rate, dt, steps)
    rise = -found[-1, 0] - (1.0 - found[-2, 1]) * STRENGTH
    assert 0.0 < found[-1, 1] < 0.1
    assert rise == approx(BULK * rate * TIME, rel=0.03)


def test_a_short_pulse_r16_exceeds_the_strength_and_opens_its_share():
    excess, dt = 0.1e9, 0.2 * TIME
    for time, share in ((0.0, 1.0), (TIME, 0.2 / 1.2)):
        p = point(relaxation_time=time)
        p.set(rho=2700.0 * (1.0 - (STRENGTH + excess) / BULK))
        p.respond(dt)
        last = opening_strain(1.5 * SIZE, STRENGTH, 0.0, BULK)
        assert p.get("opening") == approx(
            share * excess / (BULK * last - STRENGTH), rel=1e-6
        )
        assert -p.get("P") == approx(STRENGTH + (1.0 - share) * excess, rel=1e-9)
    assert relaxed_share(0.0, TIME) == 0.0
    assert relaxed_share(0.0, 0.0) == relaxed_share(dt, 0.0) == 1.0


def test_band_r16_is_that_in_which_a_crack_takes_its_energy():
    """A crack smeared by the kernel damages by exp(-z^2/h^2) when its middle breaks."""
    z = np.linspace(-6.0, 6.0, 4001)
    lost = 1.0 - np.exp(-(z**2))
    assert np.trapezoid(1.0 - lost**2, z) == approx(BAND, rel=1e-9)


def test_failed_matter_r16_bears_pressure_and_nothing_else():
    p = point(strong=True)
    p.set(damage=1.0)
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
        p = point(strong=True, criterion=criterion)
        for _ in range(4000):
            p.strain(uniaxial_strain(1e4), 1e-9, heat=False)
            if p.get("damage") > 0.0:
                break
        assert p.get("damage") > 0.0
        results[criterion] = 2700.0 - p.get("rho")
    strain = {name: x / 2700.0 for name, x in results.items()}
    assert BULK * strain["pressure"] == approx(STRENGTH, rel=1e-3)
    assert BULK * strain["principal"] == approx(STRENGTH - 0.2e9, rel=1e-3)


def test_yield_r16_comes_before_the_crack():
    """What is given up in yielding does not open a crack, whatever the step."""
    p = point(strong=True, criterion="principal")
    p.set(rho=2700.0 * (1.0 - 0.9e9 / BULK), S_zz=0.8e9, S_rr=-0.4e9)
    p.respond(1e-9)
    assert p.get("damage") == 0.0
    assert p.get("P") == approx(-0.9e9, rel=1e-12)
    assert p.get("S_zz") == approx(0.2e9, rel=1e-12)


def test_matter_r16_that_is_torn_bears_its_share_of_the_tension():
    """Tearing opens no crack: it lessens the share that bears, in shear and tension."""
    torn = 0.02
    p = point()
    p.set(damage=torn, rho=2700.0 * (1.0 - 0.1e9 / BULK))
    p.respond(1e-9)
    assert p.get("P") == approx(-(1.0 - torn) * 0.1e9, rel=1e-12)
    found = pull(p, 1e6, 1e-9, 60)
    opening, damage = p.get("opening", "damage")
    assert 0.0 < opening < 1.0
    assert 1.0 - damage == approx((1.0 - opening) * (1.0 - torn), rel=1e-12)
    assert -found[:, 0].min() == approx((1.0 - torn) * STRENGTH, rel=1e-2)
    assert untorn_share(1.0, 1.0) == untorn_share(1.0, 0.3) == 0.0


def test_the_principal_tension_r16_of_torn_matter_is_that_of_what_bears():
    """Half torn, with half of the stress: the same excess, the same opening."""
    openings = []
    for torn in (0.0, 0.5):
        p = point(strong=True, criterion="principal")
        share = 1.0 - torn
        p.set(damage=torn, S_zz=0.15e9 * share, S_rr=-0.075e9 * share)
        p.set(rho=2700.0 * (1.0 - 1.1e9 / BULK))
        p.respond(1e-9)
        openings.append(p.get("opening"))
    assert openings[0] > 0.0
    assert openings[1] == approx(openings[0], rel=1e-9)


def test_what_breaks_r16_takes_its_strain_along():
    """It leaves the rest of the stress, and strains nothing plastically."""
    p = point(strong=True)
    p.set(rho=0.9 * 2700.0, S_rz=0.29e9 / math.sqrt(3.0))
    for _ in range(100):
        p.respond(1e-9)
        assert p.stress == approx((1.0 - p.get("damage")) * 0.29e9, rel=1e-9)
    assert p.get("damage") == 1.0
    assert p.get("plastic_strain") == 0.0


def test_a_crack_r16_is_faster_in_stiff_matter():
    """It runs at the speed of longitudinal waves, in a share of its own size."""
    grown = []
    for strong in (False, True):
        p = point(strong)
        p.set(rho=2700.0 * (1.0 - 3.0 * STRENGTH / BULK))
        p.respond(1e-9)
        grown.append(p.get("damage"))
    rho = 2700.0 * (1.0 - 3.0 * STRENGTH / BULK)
    c = p.get("c")
    stiff = math.sqrt(c * c + 4 * 27e9 / (3 * rho))
    assert grown[1] / grown[0] == approx(stiff / c, rel=1e-12)


def test_cracks_r16_of_porous_matter_open_between_its_solid():
    """Between the cracks the solid has the density alpha rho (1 + o eps_c)."""
    alpha, opening = 1.25, 0.1
    p = Point(
        models(
            {"failure": "spall", "porosity": "p-alpha"},
            spall={"strength": STRENGTH},
            p_alpha={
                "initial_distension": alpha,
                "elastic_pressure": 1e8,
                "solid_pressure": 5e8,
            },
        ),
        size=SIZE,
    )
    last = opening_strain(1.5 * SIZE, STRENGTH, 0.0, BULK)
    strain = 0.004  # of the solid, in tension
    rho = 2700.0 / alpha * (1.0 - strain) / (1.0 + opening * last)
    p.set(opening=opening, damage=opening, rho=rho)
    p.respond(1e-9)
    assert p.get("P") == approx(-BULK * strain / alpha, rel=1e-10)


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
