"""R13: temperature, the isentrope below it, and melting."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from material_point import Point, models
from oracles import approx
from scipy.integrate import solve_ivp

from mpisph.physics.eos import pressure
from mpisph.physics.isentrope import LARGEST_COMPRESSION, on_isentrope
from mpisph.physics.response import material_table
from mpisph.physics.thermal.heat_capacity import (
    HeatCapacityModel,
    heating,
    melting_temperature,
    share_molten,
)

HEAT = {"heat_capacity": 900.0, "melting_temperature": 925.0}
SOLIDS = {
    "mie-grueneisen": {
        "mie_grueneisen": {
            "c0": 5240.0,
            "slope": 1.4,
            "gamma0": 1.97,
            "gamma_slope": 0.48,
        }
    },
    "tillotson": {
        "tillotson": {
            "a": 0.5,
            "b": 1.63,
            "A": 78.5e9,
            "B": 65e9,
            "E0": 5e6,
            "Es": 2.76e6,
            "Es_prime": 14.1e6,
            "alpha": 5.0,
            "beta": 5.0,
        }
    },
    "linear": {},
}


def row(eos):
    material = models(
        {"eos": eos, "thermal": "heat-capacity"}, heat_capacity=HEAT, **SOLIDS[eos]
    )
    return material_table([material])[0]


@pytest.mark.parametrize("eos", SOLIDS)
def test_isentrope_r13_is_the_solution_of_its_equations(eos):
    """``dE = P/rho^2 d rho`` and ``dT/T = Gamma d rho/rho``, by another integrator."""
    mat = row(eos)

    def slopes(rho, y):
        P, _, dP_dE = pressure(rho, y[0], mat)
        return [P / rho**2, y[1] * dP_dE / rho**2]

    eta = np.array([1.0, 1.003, 1.1, 1.37, 1.8, 2.4])
    assert eta[-1] < 1.0 / (1.0 - LARGEST_COMPRESSION)
    found = solve_ivp(
        slopes, (2700.0, 2700.0 * 2.4), [0.0, 300.0], "DOP853", 2700.0 * eta,
        rtol=1e-12, atol=1e-6,
    )  # fmt: skip
    for x, E, T in zip(eta, *found.y, strict=True):
        got = on_isentrope(x, mat.isentrope)
        assert got == (approx(E, rel=1e-5, abs=1.0), approx(T, rel=1e-5))


def test_isentrope_r13_of_a_constant_gamma_rho():
    """``Gamma rho`` constant gives ``T = T0 exp(gamma0 (1 - rho0/rho))``."""
    material = models(
        {"eos": "mie-grueneisen", "thermal": "heat-capacity"},
        heat_capacity=HEAT,
        mie_grueneisen={"c0": 5350.0, "slope": 1.49, "gamma0": 1.7},
    )
    mat = material_table([material])[0]
    for eta in (1.05, 1.5, 2.0):
        T = on_isentrope(eta, mat.isentrope)[1]
        assert approx(300.0 * math.exp(1.7 * (1 - 1 / eta)), rel=1e-7) == T
    assert on_isentrope(0.4, mat.isentrope) == (0.0, 300.0)
    beyond = [on_isentrope(eta, mat.isentrope)[1] for eta in (2.4, 2.6, 4.0)]
    assert beyond == sorted(beyond)


def test_temperature_r13_is_that_of_the_energy_above_the_isentrope():
    material = models(
        {"eos": "mie-grueneisen", "thermal": "heat-capacity"},
        heat_capacity=HEAT | {"melting_temperature": 5000.0},
        **SOLIDS["mie-grueneisen"],
    )
    point = Point(material)
    curve = point.table[0].isentrope
    for eta, E in ((0.5, 2e5), (1.0, 3e5), (1.3, 1.5e6)):
        point.set(rho=2700.0 * eta, E=E)
        point.respond(0.0)
        E_s, T_s = on_isentrope(eta, curve)
        assert point.get("T") == approx(T_s + (E - E_s) / 900.0, rel=1e-13)
        assert point.get("melt") == 0.0


def test_temperature_r13_is_not_below_zero():
    material = models({"thermal": "heat-capacity"}, heat_capacity=HEAT)
    assert Point(material, E=-4e5).get("T") == 0.0


@given(c=st.floats(500.0, 1500.0), T=st.floats(1.0, 3000.0))
def test_heating_r13_takes_the_integral_of_the_heat_capacity(c, T):
    hot, half = 1000.0, 300.0
    rising = min(T, half)
    q = c * rising + 0.5 * (hot - c) * rising**2 / half + hot * (T - rising)
    assert heating(q, c, hot, 2.0 * half) == approx(T, rel=1e-12)
    assert heating(-1e4, c, hot, 2.0 * half) == approx(-1e4 / c)


def test_heat_to_melting_r13_is_taken_there():
    heat = {**HEAT, "heat_to_melting": 6.6e5, "melting_temperature": 925.0}
    material = models(
        {"eos": "mie-grueneisen", "thermal": "heat-capacity"},
        heat_capacity=heat,
        **SOLIDS["mie-grueneisen"],
    )
    point = Point(material)
    for E, T in ((6.6e5 - 1e-6, 925.0), (9e2, 301.0)):
        point.set(rho=2700.0, E=E)
        point.respond(0.0)
        assert point.get("T") == approx(T, rel=1e-5)
    with pytest.raises(ValueError, match="heat_to_melting must exceed"):
        HeatCapacityModel.model_validate({**heat, "heat_to_melting": 1e5})


def test_melting_r13_begins_by_lindemann_and_takes_the_hot_heat_capacity():
    """Compressed matter beyond its melting temperature, half molten and whole."""
    heat = HEAT | {
        "heat_to_melting": 6.6e5,
        "heat_of_fusion": 4e5,
        "melting_gamma": 2.0,
        "melting_slope": 0.5,
    }
    material = models({"thermal": "heat-capacity"}, heat_capacity=heat)
    hot = (4.0 * 6.6e5 / 625.0 - 900.0) / 3.0
    eta = 1.2
    T_m = 925.0 * math.exp(2 * 0.5 * (1 - 1 / eta)) * eta ** (2 * (2.0 - 0.5 - 1 / 3))
    point = Point(material)
    E_s, T_s = on_isentrope(eta, point.table[0].isentrope)
    way = 0.5 * (900.0 + hot) * 312.5  # to halfway to melting, then at `hot`
    to_melting = way + hot * (T_m - T_s - 312.5)
    for q, T, melt in (
        (to_melting - 1e4, T_m - 1e4 / hot, 0.0),
        (to_melting + 2e5, T_m, 0.5),
        (to_melting + 5e5, T_m + 1e5 / hot, 1.0),
    ):
        point.set(rho=2700.0 * eta, E=E_s + q)
        point.respond(0.0)
        assert point.get("T") == approx(T, rel=1e-12)
        assert point.get("melt") == approx(melt, rel=1e-9, abs=1e-12)


@given(eta=st.floats(1.0, 2.0), gamma=st.floats(0.4, 3.0), a=st.floats(0.0, 2.0))
def test_melting_temperature_r13_follows_lindemann(eta, gamma, a):
    """``d ln T_m/d ln rho = 2 (Gamma - 1/3)``, ``Gamma = gamma - a (1 - 1/eta)``."""
    d = 1e-6
    low, high = (
        math.log(melting_temperature(eta * math.exp(x), 900.0, gamma, a))
        for x in (0.0, d)
    )
    middle = eta * math.exp(0.5 * d)
    want = 2.0 * (gamma - a * (1.0 - 1.0 / middle) - 1.0 / 3.0)
    assert (high - low) / d == approx(want, rel=1e-7, abs=1e-8)
    assert melting_temperature(0.7, 900.0, gamma, a) == 900.0


def test_share_molten_r13_takes_the_latent_heat():
    assert share_molten(800.0, 900.0, 1000.0, 4e5) == (800.0, 0.0)
    assert share_molten(1000.0, 900.0, 1000.0, 4e5) == (900.0, 0.25)
    T, share = share_molten(1500.0, 900.0, 1000.0, 4e5)
    assert (T, share) == (approx(1100.0), 1.0)
    assert share_molten(901.0, 900.0, 1000.0, 0.0) == (901.0, 1.0)


def test_matter_r13_that_melts_loses_tension_and_shear_by_its_molten_share():
    material = models(
        {"thermal": "heat-capacity", "strength": "elastic-plastic"},
        heat_capacity=HEAT | {"heat_of_fusion": 4e5},
        elastic_plastic={"shear_modulus": 27e9, "yield_strength": 0.3e9},
    )
    point = Point(material, E=900.0 * 625.0 + 1e5)
    point.set(rho=2690.0, S_rz=1e9)
    point.respond(1e-9)
    assert point.get("melt") == approx(0.25, rel=1e-12)
    assert point.stress == approx(0.75 * 0.3e9, rel=1e-12)
    assert point.get("P") == approx(0.75 * 75e9 * (2690.0 / 2700.0 - 1.0), rel=1e-12)
