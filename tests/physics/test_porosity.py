"""R19: porous matter, driven as a single particle."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from material_point import BULK, RHO0, Point, models, uniaxial_strain
from oracles import ALUMINIUM, approx, pressure_and_slopes
from pydantic import ValidationError
from scipy.integrate import quad
from scipy.optimize import brentq

from mpisph.materials.model import TABLES
from mpisph.physics.porosity.p_alpha import crush_pressure, crushed_distension
from mpisph.physics.response import material_table
from mpisph.physics.sound import sound_speed

CURVE = {
    "initial_distension": 1.5,
    "elastic_pressure": 0.1e9,
    "solid_pressure": 0.6e9,
}
P_E, P_S, ALPHA0 = 0.1e9, 0.6e9, 1.5
ALUMINIUM_HUGONIOT = {"c0": 5350.0, "slope": 1.49, "gamma0": 1.7}


def porous(eos="linear", exponent=2.0, **more):
    """Matter of 2/3 of its solid's density."""
    names = {"porosity": "p-alpha", "eos": eos} | more.pop("choices", {})
    return models(
        names,
        p_alpha=CURVE | {"exponent": exponent},
        mie_grueneisen=ALUMINIUM_HUGONIOT,
        **more,
    )


def crush_of(alpha, n=2.0):
    """The pressure at which pores are crushed, from alpha."""
    return P_S - (P_S - P_E) * ((alpha - 1.0) / (ALPHA0 - 1.0)) ** (1.0 / n)


def density_of(alpha, P):
    """The density with pores, of the linear equation of state of the solid."""
    return RHO0 * (1.0 + alpha * P / BULK) / alpha


def test_a_porous_body_is_at_rest_at_the_start_r19():
    point = Point(porous())
    assert point.get("rho", "distension", "P") == [1800.0, 1.5, 0.0]


@pytest.mark.parametrize("n", [1.0, 2.0, 3.5])
def test_crushed_distension_r19_follows_the_curve(n):
    point = Point(porous(exponent=n))
    for alpha in np.linspace(1.499, 1.0001, 40).tolist():
        P = crush_of(alpha, n)
        point.set(rho=density_of(alpha, P))
        point.respond(0.0)
        assert point.get("distension") == approx(alpha, rel=1e-10)
        assert point.get("P") == approx(P, rel=1e-10)


def test_crushed_distension_r19_follows_the_curve_of_a_hot_solid():
    """With the energy of the state in the pressure of the solid."""
    mat = ALUMINIUM._replace(rho0=RHO0)
    point = Point(porous("mie-grueneisen"))
    for alpha, E in ((1.45, 1e4), (1.3, 5e4), (1.1, 1.2e5), (1.01, 2e5)):
        P = crush_of(alpha)
        solid = brentq(
            lambda rho, E=E, P=alpha * P: pressure_and_slopes(rho, E, mat)[0] - P,
            0.5 * RHO0,
            1.5 * RHO0,
            xtol=1e-11,
        )
        point.set(rho=solid / alpha, E=E)
        point.respond(0.0)
        assert point.get("distension") == approx(alpha, rel=1e-10)
        assert point.get("P") == approx(P, rel=1e-10)


def test_crush_pressure_r19_has_its_ends():
    row = material_table([porous()])[0].p_alpha
    assert crush_pressure(1.0, row) == P_E
    assert crush_pressure(0.0, row) == P_S
    assert crush_pressure(math.sqrt(0.25), row) == approx(crush_of(1.125))


def test_pores_r19_stay_below_the_elastic_pressure_and_never_open_again():
    point = Point(porous())
    point.set(rho=density_of(1.5, 0.999 * P_E))
    point.respond(0.0)
    assert point.get("distension") == 1.5
    assert point.get("P") == approx(0.999 * P_E, rel=1e-10)
    point.set(rho=density_of(1.2, crush_of(1.2)))
    point.respond(0.0)
    crushed = point.get("distension")
    # Down into tension and up again to nearly where it came from: no change.
    for P in (0.28e9, 0.0, -0.2e9, 0.5 * crush_of(1.2), 0.999 * crush_of(1.2)):
        point.set(rho=density_of(crushed, P))
        point.respond(0.0)
        assert point.get("distension") == crushed
        assert point.get("P") == approx(P, rel=1e-10, abs=1e-4)
    point.set(rho=density_of(1.1, crush_of(1.1)))
    point.respond(0.0)
    assert point.get("distension") == approx(1.1, rel=1e-10)


@pytest.mark.parametrize("eos", ["linear", "mie-grueneisen"])
def test_crushed_matter_r19_is_its_solid(eos):
    point, solid = (
        Point(porous(eos)),
        Point(models({"eos": eos}, mie_grueneisen=ALUMINIUM_HUGONIOT)),
    )
    for rho, E in ((1.05 * RHO0, 1e5), (0.9 * RHO0, 3e6), (1.4 * RHO0, 2e6)):
        for each in (point, solid):
            each.set(rho=1.2 * RHO0, E=0.0)
            each.respond(0.0)
            each.set(rho=rho, E=E)
            each.respond(0.0)
        assert point.get("distension") == 1.0
        assert point.get("P", "c") == solid.get("P", "c")


def test_the_work_of_compaction_r19_is_the_integral_of_pressure():
    point = Point(porous())
    last = density_of(1.02, crush_of(1.02))
    steps = 400
    rate = -1e5
    dt = math.log(last / 1800.0) / -rate / steps
    for _ in range(steps):
        point.strain(uniaxial_strain(rate), dt)
    assert point.get("rho") == approx(last, rel=1e-10)
    assert point.get("distension") == approx(1.02, rel=1e-10)

    def volume(alpha):
        return 1.0 / density_of(alpha, crush_of(alpha))

    def power(share):  # over alpha from alpha0 on, by its square root
        alpha, h = 1.0 + 0.5 * share**2, 1e-5
        slope = (volume(1.0 + 0.5 * (share + h) ** 2) - volume(alpha)) / h
        slope -= (volume(1.0 + 0.5 * (share - h) ** 2) - volume(alpha)) / h
        return crush_of(alpha) * 0.5 * slope

    elastic = quad(
        lambda P: P * (1.0 / density_of(1.5, P)) ** 2 * RHO0 / BULK, 0.0, P_E
    )[0]
    crushed = quad(power, math.sqrt(0.04), 1.0, epsabs=1e-6)[0]
    # Trapezia: the pressure rises within some steps from zero to the elastic one.
    assert point.get("E") == approx(elastic + crushed, rel=2e-4)


@pytest.mark.parametrize("alpha", [1.5, 1.2, 1.0])
def test_the_sound_speed_r19_is_that_of_the_solid(alpha):
    """At constant alpha: by differences along an isentrope, pores and all."""
    mat = ALUMINIUM._replace(rho0=RHO0)
    point = Point(porous("mie-grueneisen"))
    rho, E = 1.0003 * RHO0 / alpha, 2e4
    point.set(rho=rho, E=E, distension=alpha)
    point.respond(0.0)
    assert point.get("distension") == alpha
    P, P_rho, P_E = pressure_and_slopes(alpha * rho, E, mat)
    solid = sound_speed(alpha * rho, P, P_rho, P_E, 1.0)
    assert point.get("c") == approx(solid, rel=1e-12)
    d = 1e-6 * rho
    around = []
    for side in (-d, d):
        E_s = E + P / alpha / rho**2 * side
        around.append(pressure_and_slopes(alpha * (rho + side), E_s, mat)[0] / alpha)
    assert (around[1] - around[0]) / (2.0 * d) == approx(solid**2, rel=1e-6)


def test_the_temperature_r13_is_that_of_the_solid():
    heat = {"heat_capacity": 900.0, "melting_temperature": 5000.0}
    thermal = {"choices": {"thermal": "heat-capacity"}, "heat_capacity": heat}
    point = Point(porous("mie-grueneisen", **thermal))
    solid = Point(
        models(
            {"eos": "mie-grueneisen", "thermal": "heat-capacity"},
            mie_grueneisen=ALUMINIUM_HUGONIOT,
            heat_capacity=heat,
        )
    )
    assert point.get("T") == 300.0
    for rho, E in ((0.99 * RHO0, 1e4), (1.03 * RHO0, 3e5)):
        solid.set(rho=rho, E=E)
        solid.respond(0.0)
        point.set(rho=rho / point.get("distension"), E=E)
        point.respond(0.0)
        alpha = point.get("distension")
        solid.set(rho=alpha * point.get("rho"))
        solid.respond(0.0)
        assert point.get("T") == approx(solid.get("T"), rel=1e-13)


def test_the_shear_modulus_r15_is_that_at_the_density_of_the_solid():
    steinberg = {"shear_modulus": 27.6e9, "yield_strength": 0.29e9, "beta": 125.0}
    steinberg |= {"largest_yield_strength": 0.68e9, "n": 0.1, "A": 6.52e-9, "B": 0.0}
    point = Point(
        porous(choices={"strength": "steinberg-guinan"}, steinberg_guinan=steinberg)
    )
    point.set(rho=1.02 * RHO0 / ALPHA0)
    point.respond(0.0)
    P, alpha, rho = point.get("P", "distension", "rho")
    assert alpha > 1.1
    eta = alpha * rho / RHO0
    want = 27.6e9 * (1.0 + 6.52e-9 * P / eta ** (1 / 3))
    assert point.get("G") == approx(want, rel=1e-13)


ROW = material_table([porous("mie-grueneisen")])[0]


@given(
    eta=st.floats(0.2, 3.0),
    E=st.floats(-1e5, 1e7),
    alpha=st.floats(1.0, 1.5),
)
def test_crushed_distension_r19_is_found_for_any_state(eta, E, alpha):
    rho = eta * RHO0
    found = crushed_distension(rho, E, alpha, ROW)
    assert 1.0 <= found <= alpha
    mat = ALUMINIUM._replace(rho0=RHO0)
    P = pressure_and_slopes(found * rho, E, mat)[0] / found
    # The least distance to the curve that doubles of alpha allow.
    rounding = 1e-9 * P_S + 1e-14 * BULK
    if found == alpha:
        assert P <= crush_of(alpha) + rounding or alpha == 1.0
    elif found > 1.0:
        assert abs(P - crush_of(found)) <= rounding
    else:
        assert P >= P_S - rounding


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"initial_distension": 1.0}, "greater than 1"),
        ({"solid_pressure": 0.1e9}, "solid_pressure must exceed elastic_pressure"),
        ({"elastic_pressure": -1.0}, "greater than or equal to 0"),
        ({"exponent": 0.5}, "greater than or equal to 1"),
    ],
)
def test_constants_of_pores_r19_that_make_no_sense_are_refused(change, message):
    with pytest.raises(ValidationError, match=message):
        TABLES["p-alpha"](**CURVE | change)
