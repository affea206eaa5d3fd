"""Plane shocks, against the jump conditions in another form and against known lines."""

import math
from itertools import pairwise

import numpy as np
import pytest

from mpisph.case import case_from_dict
from mpisph.verify.exact.shocks import (
    Matter,
    Shocked,
    contact,
    elastic_limit,
    matter_of,
    plane_waves,
    sound_speed,
)

RHO0, C0, SLOPE, GAMMA = 2703.0, 5240.0, 1.40, 1.97
G, Y = 27.6e9, 0.29e9


def hugoniot_pressure(rho, E):
    """Mie-Grueneisen about the line U_s = c0 + s u, with Gamma rho constant."""
    x = 1.0 - RHO0 / rho
    P_H = RHO0 * C0**2 * x / (1.0 - SLOPE * x) ** 2
    return P_H * (1.0 - 0.5 * GAMMA * x) + GAMMA * RHO0 * E


FLUID = Matter(RHO0, hugoniot_pressure)
SOLID = FLUID._replace(shear_modulus=G, yield_strength=Y)
GAS = Matter(1.2, lambda rho, E: 0.4 * rho * E)


def assert_conserved(matter, waves):
    """Mass, momentum and energy pass each front, as fluxes in its own frame."""
    rest = Shocked(0.0, 0.0, matter.density, 0.0, 0.0, 0.0)
    for ahead, behind in pairwise([rest, *waves]):

        def fluxes(state, front=behind.speed):
            w = state.velocity - front
            total = state.energy + 0.5 * state.velocity**2
            return np.array(
                [
                    state.density * w,
                    state.density * w * state.velocity + state.stress,
                    state.density * w * total + state.stress * state.velocity,
                ]
            )

        flow = ahead.density * abs(ahead.velocity - behind.speed)
        scale = [flow, behind.stress, behind.stress * behind.velocity]
        change = (fluxes(behind) - fluxes(ahead)) / scale
        assert change == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("u", [500.0, 1500.0, 3000.0])
def test_porous_matter_is_shocked_to_its_solid(u):
    """About the solid's Hugoniot, which the jump from a larger volume leaves."""
    case = case_from_dict(
        {
            "title": "foam",
            "bodies": [
                {"name": "foam", "shape": "plate", "thickness": 1e-3, "radius": 1e-2}
                | {"material": "al-6061-t6"}
            ],
            "scheme": {"strength": "none", "porosity": "p-alpha"},
            "materials": {
                "al-6061-t6": {
                    "mie-grueneisen": {"gamma_slope": 0.0},
                    "p-alpha": {
                        "initial_distension": 1.6,
                        "elastic_pressure": 0.0,
                        "solid_pressure": 1e8,
                    },
                }
            },
            "resolution": {"spacing": 1e-4},
            "time": {"end": 1e-6},
        }
    )
    matter = matter_of(case.material_table[0])
    assert matter.density == pytest.approx(RHO0 / 1.6)
    (wave,) = plane_waves(matter, u)
    assert_conserved(matter, [wave])
    V0, V00, V = 1.0 / RHO0, 1.6 / RHO0, 1.0 / wave.density
    x, g = 1.0 - V / V0, 0.5 * GAMMA * RHO0
    P_H = RHO0 * C0**2 * x / (1.0 - SLOPE * x) ** 2
    P = P_H * (1.0 - g * (V0 - V)) / (1.0 - g * (V00 - V))
    assert wave.pressure == pytest.approx(P, rel=1e-9)


@pytest.mark.parametrize("u", [1.0, 200.0, 1500.0, 3500.0])
def test_a_fluid_follows_its_line(u):
    (wave,) = plane_waves(FLUID, u)
    assert wave.speed == pytest.approx(C0 + SLOPE * u, rel=1e-9)
    assert wave.energy == pytest.approx(0.5 * u**2, rel=1e-9)
    assert_conserved(FLUID, [wave])


def test_a_strong_shock_in_cold_gas_has_six_times_its_density():
    (wave,) = plane_waves(GAS, 3e3)
    assert wave.density == pytest.approx(6.0 * GAS.density, rel=1e-9)
    assert wave.speed == pytest.approx(1.2 * 3e3, rel=1e-9)
    assert wave.pressure == pytest.approx(1.2 * GAS.density * 3e3**2, rel=1e-9)


@pytest.mark.parametrize("u", [20.0, 75.0, 450.0, 1500.0])
def test_a_solid_conserves_and_meets_its_yield_strength(u):
    waves = plane_waves(SOLID, u)
    # The plastic shock overtakes the precursor between 450 and 1500 m/s.
    assert len(waves) == (2 if 50.0 < u < 1000.0 else 1)
    assert_conserved(SOLID, waves)
    last = waves[-1]
    assert last.velocity == u
    assert last.pressure == pytest.approx(SOLID.pressure(last.density, last.energy))
    deviator = last.stress - last.pressure
    if u > 50.0:
        assert deviator == pytest.approx(2.0 / 3.0 * Y, rel=1e-6)
    else:
        assert deviator < 2.0 / 3.0 * Y


def test_the_elastic_limit_is_that_of_small_strains():
    limit = elastic_limit(SOLID)
    K = RHO0 * C0**2
    assert limit.stress == pytest.approx(Y * (K + 4 / 3 * G) / (2 * G), rel=0.02)
    assert limit.speed == pytest.approx(math.sqrt((K + 4 / 3 * G) / RHO0), rel=0.01)
    soft = SOLID._replace(yield_strength=1e-4 * Y)
    assert elastic_limit(soft).stress == pytest.approx(
        1e-4 * Y * (K + 4 / 3 * G) / (2 * G), rel=1e-5
    )
    with pytest.raises(ValueError, match="fluid"):
        elastic_limit(FLUID)


def test_equal_bodies_share_the_velocity():
    ours, theirs = contact(SOLID, SOLID, 3000.0)
    assert theirs[-1].velocity == pytest.approx(1500.0, rel=1e-9)
    assert ours[-1] == pytest.approx(theirs[-1], rel=1e-8)


def test_unlike_bodies_have_one_stress_and_stay_together():
    heavy = FLUID._replace(
        density=2 * RHO0, pressure=lambda r, E: 30e9 * (r / 5406 - 1)
    )
    ours, theirs = contact(heavy, SOLID, 1000.0)
    assert ours[-1].stress == pytest.approx(theirs[-1].stress, rel=1e-9)
    assert ours[-1].velocity + theirs[-1].velocity == pytest.approx(1000.0)


def test_sound_overtakes_the_shock():
    (wave,) = plane_waves(FLUID, 1500.0)
    c = sound_speed(FLUID, wave)
    assert c + wave.velocity > wave.speed
    gas = sound_speed(GAS, Shocked(0, 0, 1.2, 2.5e5, 0.4 * 1.2 * 2.5e5, 0))
    assert gas == pytest.approx(math.sqrt(1.4 * 0.4 * 2.5e5), rel=1e-6)


@pytest.mark.parametrize("eos", ["mie-grueneisen", "tillotson"])
def test_the_equation_of_state_is_the_program_s(eos):
    plate = {"shape": "plate", "thickness": 1e-3, "radius": 1e-2}
    case = case_from_dict(
        {
            "title": "plate",
            "bodies": [{**plate, "name": "plate", "material": "al-6061-t6"}],
            "resolution": {"spacing": 1e-4},
            "scheme": {"eos": eos, "strength": "elastic-plastic"},
            "time": {"end": 1e-6},
        }
    )
    matter = matter_of(case.body_models(case.bodies[0]))
    assert (matter.shear_modulus, matter.yield_strength) == (G, Y)
    waves = plane_waves(matter, 1500.0)
    assert_conserved(matter, waves)
    assert waves[-1].speed == pytest.approx(C0 + SLOPE * 1500.0, rel=0.04)
