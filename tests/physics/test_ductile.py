"""R18: ductile failure."""

import math

import numpy as np
import pytest
from material_point import BULK, RHO0, Point, isochoric, models, pure_shear
from oracles import approx
from pydantic import ValidationError

from mpisph.physics.cracks import CRACK_SPEED
from mpisph.physics.ductile.johnson_cook_damage import (
    HIGHEST_TRIAXIALITY,
    LOWEST_TRIAXIALITY,
    JohnsonCookDamage,
    fracture_strain,
    tearing,
)
from mpisph.physics.models import record, record_type

STEEL = {
    "D1": 0.05,
    "D2": 3.44,
    "D3": -2.12,
    "D4": 0.002,
    "D5": 0.61,
    "melting_temperature": 1793.0,
}
ELASTIC = {"shear_modulus": 27e9, "yield_strength": 0.3e9}
MAT = np.array([record(JohnsonCookDamage(**STEEL))], record_type(JohnsonCookDamage))
MAT = MAT.view(np.recarray)[0]


@pytest.mark.parametrize("triaxiality", [-0.33, 0.0, 1 / 3, 1.4, 3.0])
@pytest.mark.parametrize("rate", [0.0, 1.0, 1e5])
@pytest.mark.parametrize("T", [200.0, 298.0, 1000.0, 3000.0])
def test_fracture_strain_r18_is_the_product_of_three_laws(triaxiality, rate, T):
    hot = min(max((T - 298.0) / (1793.0 - 298.0), 0.0), 1.0)
    within = min(triaxiality, HIGHEST_TRIAXIALITY)
    want = (
        (0.05 + 3.44 * math.exp(-2.12 * within))
        * (1 + 0.002 * math.log(max(rate, 1.0)))
        * (1 + 0.61 * hot)
    )
    assert fracture_strain(triaxiality, rate, T, MAT) == approx(want, rel=1e-13)
    assert HIGHEST_TRIAXIALITY == 1.5


def test_fracture_strain_r18_is_infinite_where_matter_is_pressed():
    assert LOWEST_TRIAXIALITY == -1 / 3
    for triaxiality in (-1 / 3, -1.0, -20.0):
        assert fracture_strain(triaxiality, 1.0, 300.0, MAT) == math.inf


def test_a_bar_in_compression_r18_does_not_break():
    pressed = RHO0 * (1.0 + 1.001 * ELASTIC["yield_strength"] / 3.0 / BULK)
    p, strain = broken(isochoric(-1e4), steps=3000, rho=pressed)
    assert p.get("ductile_damage") == 0.0
    assert strain > 2.0


def test_fracture_strain_r18_has_a_floor():
    weak = JohnsonCookDamage(**STEEL | {"D1": -0.4, "D2": 0.5, "D3": -0.5})
    row = np.array([record(weak)], record_type(JohnsonCookDamage)).view(np.recarray)[0]
    assert fracture_strain(1.4, 0.0, 300.0, row) == weak.least_strain == 0.01


def test_constants_r18_that_break_at_once_are_refused():
    with pytest.raises(ValidationError, match="D1, D2, D3: a bar in tension would"):
        JohnsonCookDamage(**STEEL | {"D1": -0.9, "D2": 1.0, "D3": -0.5})
    with pytest.raises(ValidationError, match="must exceed reference_temperature"):
        JohnsonCookDamage(**STEEL | {"melting_temperature": 250.0})


def broken(gradient, dt=1e-7, steps=20000, rho=RHO0, **constants):
    """Plastic strain, of a particle, when its share is used up; and its history."""
    p = Point(
        models(
            {"ductile": "johnson-cook-damage", "strength": "elastic-plastic"},
            johnson_cook_damage=STEEL | {"D4": 0.0} | constants,
            elastic_plastic=ELASTIC,
        ),
        rho=rho,
    )
    for _ in range(steps):
        p.strain(gradient, dt, heat=False)
        if p.get("ductile_damage") >= 1.0:
            break
    return p, p.get("plastic_strain")


def test_torsion_r18_breaks_at_the_strain_without_triaxiality():
    _, strain = broken(pure_shear(1e4))
    assert strain == approx(0.05 + 3.44, rel=1e-3)


def test_then_r18_a_crack_runs_and_neither_shear_nor_tension_is_left():
    p, _ = broken(pure_shear(1e6), dt=1e-9)
    before = p.get("damage")
    # It has crossed a share of the particle in the one step since.
    way = CRACK_SPEED * math.sqrt((BULK + 4 * 27e9 / 3) / RHO0) * 1e-9
    assert before == approx(way / 1e-4, rel=1e-3)
    for _ in range(100):
        p.strain(isochoric(1e4), 1e-8, heat=False)
    assert p.get("damage") == 1.0
    assert p.stress == 0.0
    p.set(rho=2600.0)
    p.respond(1e-8)
    assert p.get("P") == 0.0


def test_strain_to_fracture_r18_is_that_at_the_rate_and_temperature():
    """Of one increment, in matter that the thermal model has heated."""
    hot, rate, dt = 400.0, 1e6, 1e-9
    constants = STEEL | {"D4": 0.1, "D5": 2.0}
    p = Point(
        models(
            {
                "ductile": "johnson-cook-damage",
                "strength": "elastic-plastic",
                "thermal": "heat-capacity",
            },
            johnson_cook_damage=constants,
            elastic_plastic=ELASTIC,
            heat_capacity={
                "heat_capacity": 900.0,
                "melting_temperature": 1793.0,
                "reference_temperature": 298.0,
            },
        ),
        E=900.0 * hot,
    )
    while p.get("plastic_strain") == 0.0:
        p.strain(pure_shear(rate), dt, heat=False)
    before, used = p.get("plastic_strain"), p.get("ductile_damage")
    p.strain(pure_shear(rate), dt, heat=False)
    increment = p.get("plastic_strain") - before
    strain = (
        (0.05 + 3.44 * math.exp(2.12 * p.get("P") / p.stress))
        * (1.0 + 0.1 * math.log(increment / dt))
        * (1.0 + 2.0 * hot / (1793.0 - 298.0))
    )
    assert p.get("ductile_damage") - used == approx(increment / strain, rel=1e-9)


def test_tearing_r18_is_of_what_cracks_have_left():
    """``1 - D = (1 - o)(1 - t)``: half open, matter that tears loses half as much."""
    lost = []
    for opening in (0.0, 0.5):
        p = Point(
            models(
                {
                    "ductile": "johnson-cook-damage",
                    "strength": "elastic-plastic",
                    "failure": "spall",
                },
                johnson_cook_damage=STEEL | {"crack_energy": 20e3},
                elastic_plastic=ELASTIC,
                spall={"strength": 1e9},
            )
        )
        p.set(opening=opening, damage=opening, ductile_damage=1.0)
        p.respond(0.0)
        for _ in range(20):
            p.strain(pure_shear(1e6), 1e-9, heat=False)
        lost.append(p.get("damage") - opening)
        assert p.get("opening") == opening
    assert lost[0] > 0.0
    assert lost[1] == approx(0.5 * lost[0], rel=1e-6)


def test_tearing_r18_takes_the_energy_of_the_crack():
    """The stress times the plastic strain times the band, from fracture to the end."""
    energy, dt = 20e3, 1e-8
    p, _ = broken(pure_shear(1e4), crack_energy=energy)
    band = 2.2917 * p.get("h")
    done, before = 0.0, p.get("damage")
    while p.get("damage") < 1.0:
        work = p.get("plastic_work")
        p.strain(pure_shear(1e5), dt, heat=False)
        done += (p.get("plastic_work") - work) * p.get("rho") * band
    # The share of the first step was done before it was asked for.
    assert done == approx(energy * (1.0 - before) ** 2, rel=2e-3)
    assert tearing(energy, energy) == 0.5
    assert tearing(1.0, 0.0) == math.inf
