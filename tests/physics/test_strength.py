"""R14, R15: strength that hardens and softens, on a single particle."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from material_point import Point, isochoric, models, pure_shear
from oracles import approx
from scipy.optimize import brentq

from mpisph.physics.models import record, record_type
from mpisph.physics.strength.johnson_cook import JohnsonCook, johnson_cook
from mpisph.physics.strength.steinberg_guinan import (
    SteinbergGuinan,
    steinberg_modulus,
    steinberg_yield,
)

G = 27e9
JC = {
    "shear_modulus": G,
    "A": 324e6,
    "B": 114e6,
    "n": 0.42,
    "C": 0.02,
    "m": 1.34,
    "melting_temperature": 925.0,
    "reference_temperature": 300.0,
}
SG = {
    "shear_modulus": 27.6e9,
    "yield_strength": 0.29e9,
    "largest_yield_strength": 0.68e9,
    "beta": 125.0,
    "n": 0.10,
    "A": 6.52e-11,
    "B": 6.16e-4,
}
HEAT = {"heat_capacity": 900.0, "melting_temperature": 925.0}


def jc_yield(strain, rate, T, c=JC):
    """Johnson and Cook (1983), written out."""
    hot = (T - c["reference_temperature"]) / (
        c["melting_temperature"] - c["reference_temperature"]
    )
    hot = min(max(hot, 0.0), 1.0)
    return (
        (c["A"] + c["B"] * strain ** c["n"])
        * (1 + c["C"] * math.log(max(rate, 1.0)))
        * (1 - hot ** c["m"])
    )


def row(model, numbers):
    constants = model(**numbers)
    return np.array([record(constants)], record_type(model)).view(np.recarray)[0]


@pytest.mark.parametrize("strain", [0.0, 1e-4, 0.3, 4.0])
@pytest.mark.parametrize("rate", [0.0, 0.5, 3.0, 1e6])
@pytest.mark.parametrize("T", [77.0, 300.0, 600.0, 924.0, 2000.0])
def test_johnson_cook_r14_is_the_product_of_its_three_laws(strain, rate, T):
    mat = row(JohnsonCook, JC)
    Y, by_strain, by_rate = johnson_cook(strain, rate, T, mat)
    assert approx(jc_yield(strain, rate, T), rel=1e-13) == Y
    if strain > 0.0:
        d = 1e-6 * strain
        up, down = (jc_yield(strain + s * d, rate, T) for s in (1, -1))
        assert by_strain == approx((up - down) / (2 * d), rel=1e-6, abs=1e-3)
    if rate > 1.0:
        d = 1e-6 * rate
        up, down = (jc_yield(strain, rate + s * d, T) for s in (1, -1))
        assert by_rate == approx((up - down) / (2 * d), rel=1e-4, abs=1e-6)


def johnson_cook_point(**changes):
    table = JC | changes
    return Point(models({"strength": "johnson-cook"}, johnson_cook=table), T=300.0)


@pytest.mark.parametrize("C", [0.0, 0.02])
@pytest.mark.parametrize("n", [0.1, 0.42, 1.0])
def test_torsion_r14_hardens_by_the_closed_form(n, C):
    """In pure shear ``gamma/sqrt(3) = eps_p + Y(eps_p)/(3 G)``, at any step.

    Without temperature T is 0 K, below the reference, so that nothing softens. The rate
    of the last increment counts.
    """
    point, dt, steps, rate = johnson_cook_point(n=n, C=C), 1e-6, 50, 4e3
    last = 0.0
    for k in range(1, steps + 1):
        point.strain(pure_shear(rate), dt, heat=False)
        total = rate * dt * k / math.sqrt(3.0)

        def excess(strain, total=total, last=last):
            Y = jc_yield(strain, (strain - last) / dt, 0.0, JC | {"n": n, "C": C})
            return strain + Y / (3 * G) - total

        if excess(last) >= 0.0:
            assert point.get("plastic_strain") == 0.0
            assert point.stress == approx(3 * G * total, rel=1e-12)
            continue
        want = brentq(excess, last, total, xtol=1e-16, rtol=1e-14)
        got = point.get("plastic_strain")
        assert got == approx(want, rel=1e-10)
        Y = jc_yield(want, (want - last) / dt, 0.0, JC | {"n": n, "C": C})
        assert point.stress == approx(Y, rel=1e-10)
        last = got
    assert last > 0.1


@given(increment=st.floats(1e-9, 0.5), strain=st.floats(0.0, 1.0))
def test_plastic_return_r7_solves_for_the_increment(increment, strain):
    """The trial stress of a known increment gives it back."""
    point = johnson_cook_point(C=0.0, n=0.1)
    point.set(plastic_strain=strain)
    Y = jc_yield(strain + increment, 0.0, 0.0, JC | {"n": 0.1})
    point.set(S_rz=(Y + 3 * G * increment) / math.sqrt(3.0))
    point.respond(1e-6)
    assert point.stress == approx(Y, rel=1e-12)
    got = point.get("plastic_strain") - strain
    assert got == approx(increment, rel=1e-6, abs=1e-12)


def test_what_melts_r13_takes_its_strain_along():
    """It strains nothing plastically; what freezes is without stress."""
    heat = {"heat_capacity": 900.0, "melting_temperature": 925.0}
    p = Point(
        models(
            {"strength": "elastic-plastic", "thermal": "heat-capacity"},
            elastic_plastic={"shear_modulus": 27e9, "yield_strength": 0.3e9},
            heat_capacity=heat | {"heat_of_fusion": 4e5},
        )
    )
    p.set(S_rz=0.29e9 / math.sqrt(3.0))
    for melt, left in ((0.5, 0.5), (0.9999, 1e-4), (1.0 - 1e-9, 1e-9), (0.0, 1e-9)):
        p.set(E=900.0 * 625.0 + melt * 4e5)
        p.respond(1e-9)
        assert p.get("melt") == approx(melt, rel=1e-9)
        assert p.get("plastic_strain") == 0.0
        assert p.stress == approx(left * 0.29e9, rel=1e-6)


def test_cycles_r14_add_up_the_plastic_strain():
    """Shear forth and back: each reversal is elastic for twice the yield stress."""
    point, dt, rate = johnson_cook_point(C=0.0), 1e-6, 2e3
    strain, S = 0.0, 0.0  # signed shear stress over sqrt(1/3)
    for half, sign in enumerate((1, -1, 1, -1)):
        for _ in range(20 if half == 0 else 40):
            point.strain(pure_shear(sign * rate), dt, heat=False)
            trial = S + sign * 3 * G * rate * dt / math.sqrt(3.0)
            Y = jc_yield(strain, 0.0, 0.0)
            if abs(trial) > Y:
                more = brentq(
                    lambda d, t=trial, e=strain: (
                        abs(t) - 3 * G * d - jc_yield(e + d, 0.0, 0.0)
                    ),
                    0.0,
                    abs(trial) / (3 * G),
                    xtol=1e-17,
                    rtol=1e-14,
                )
                strain += more
                S = math.copysign(abs(trial) - 3 * G * more, trial)
            else:
                S = trial
            got = math.sqrt(3.0) * point.get("S_rz")
            assert got == approx(S, rel=1e-10, abs=1.0)
    assert point.get("plastic_strain") == approx(strain, rel=1e-10)
    assert strain > 0.1


def test_uniaxial_stress_r14_in_a_bar_that_keeps_its_volume():
    point, dt, rate, steps = johnson_cook_point(C=0.0), 1e-6, 5e3, 40
    for _ in range(steps):
        point.strain(isochoric(rate), dt, heat=False)
    strain = point.get("plastic_strain")
    Y = jc_yield(strain, 0.0, 0.0)
    assert point.stress == approx(Y, rel=1e-10)
    assert strain + Y / (3 * G) == approx(rate * dt * steps, rel=1e-10)
    S_rr, S_zz, S_rz = point.get("S_rr", "S_zz", "S_rz")
    assert [S_rr, S_zz, S_rz] == approx([-Y / 3, 2 * Y / 3, 0.0], rel=1e-10)


def test_plastic_work_r13_heats_once():
    """Without hardening all work beyond the elastic part is Y eps_p, and heats."""
    Y = 324e6
    point = Point(
        models(
            {"strength": "elastic-plastic", "thermal": "heat-capacity"},
            elastic_plastic={"shear_modulus": G, "yield_strength": Y},
            heat_capacity=HEAT,
        )
    )
    for _ in range(200):
        point.strain(pure_shear(5e3), 1e-6)
    strain = point.get("plastic_strain")
    assert strain == approx(1.0 / math.sqrt(3.0) - Y / (3 * G), rel=1e-10)
    work = Y * strain / point.get("rho")
    elastic = Y**2 / (6 * G) / point.get("rho")
    assert point.get("plastic_work") == approx(work, rel=1e-10)
    # The trapezium of the work is exact but for the one step in which yield begins.
    assert point.get("E") == approx(work + elastic, rel=1e-3)
    assert point.get("T") == approx(300.0 + point.get("E") / 900.0, rel=1e-12)


def test_heating_share_r13_leaves_the_rest_of_the_work_in_the_lattice():
    thermal = HEAT | {"heating_share": 0.9}
    point = Point(
        models({"thermal": "heat-capacity"}, heat_capacity=thermal),
        E=1e5,
        plastic_work=2e4,
    )
    assert point.get("T") == approx(300.0 + (1e5 - 2e3) / 900.0, rel=1e-13)


def test_steinberg_r15_modulus_and_yield():
    mat = row(SteinbergGuinan, SG)
    for eta, P, T in ((1.0, 0.0, 300.0), (1.2, 20e9, 800.0), (0.98, -1e9, 250.0)):
        want = 1 + 6.52e-11 * P / eta ** (1 / 3) - 6.16e-4 * (T - 300.0)
        modulus = steinberg_modulus(eta, P, T, mat)
        assert modulus == approx(27.6e9 * want, rel=1e-13)
        for strain in (0.0, 0.01, 1.0, 1e4):
            Y, slope = steinberg_yield(strain, modulus, mat)
            hardened = min(0.29e9 * (1 + 125 * strain) ** 0.1, 0.68e9)
            assert approx(hardened * want, rel=1e-13) == Y
            d = 1e-6 * (strain + 0.01)
            if hardened < 0.68e9:
                up, down = (
                    0.29e9 * (1 + 125 * (strain + s * d)) ** 0.1 for s in (1, -1)
                )
                assert slope == approx(want * (up - down) / (2 * d), rel=1e-5)
            else:
                assert slope == 0.0
    assert steinberg_modulus(1.0, 0.0, 5000.0, mat) == 0.0


def test_torsion_r15_hardens_by_the_closed_form():
    point = Point(
        models(
            {"strength": "steinberg-guinan", "thermal": "heat-capacity"},
            steinberg_guinan=SG,
            heat_capacity=HEAT,
        )
    )
    modulus, dt, rate = 27.6e9, 1e-6, 5e3
    for k in range(1, 101):
        point.strain(pure_shear(rate), dt, heat=False)
        total = rate * dt * k / math.sqrt(3.0)

        def excess(strain, total=total):
            Y = min(0.29e9 * (1 + 125 * strain) ** 0.1, 0.68e9)
            return strain + Y / (3 * modulus) - total

        if excess(0.0) < 0.0:
            want = brentq(excess, 0.0, total, xtol=1e-17, rtol=1e-14)
            assert point.get("plastic_strain") == approx(want, rel=1e-10)
    assert point.get("plastic_strain") > 0.2


def test_yield_r14_r15_is_zero_when_molten():
    for strength, constants in (
        ("johnson-cook", {"johnson_cook": JC}),
        ("steinberg-guinan", {"steinberg_guinan": SG}),
    ):
        point = Point(
            models(
                {"strength": strength, "thermal": "heat-capacity"},
                heat_capacity=HEAT | {"heat_of_fusion": 4e5},
                **constants,
            ),
            E=900.0 * 625.0 + 5e5,
        )
        point.set(S_rz=1e8)
        point.respond(1e-8)
        assert point.get("melt") == 1.0
        assert point.get("G", "S_rz") == [0.0, 0.0]


@pytest.mark.parametrize("turn", [0.4, 2.0])
def test_turned_axes_r14_give_the_turned_stress(turn):
    """Objectivity of the return: it scales the deviator."""
    c, s = math.cos(turn), math.sin(turn)
    Q = np.array([[c, s], [-s, c]])
    L = np.array([[2e3, 5e3], [1e3, -4e3]])
    stresses = []
    for axes in (np.eye(2), Q):
        point = johnson_cook_point()
        M = axes @ L @ axes.T
        for _ in range(30):
            gradient = (M[0, 0], 0.0, M[0, 1], M[1, 0], M[1, 1])
            point.strain(gradient, 1e-7, heat=False)
        rr, zz, rz = point.get("S_rr", "S_zz", "S_rz")
        stresses.append(axes.T @ np.array([[rr, rz], [rz, zz]]) @ axes)
        strain = point.get("plastic_strain")
    assert strain > 0.005
    np.testing.assert_allclose(stresses[1], stresses[0], rtol=1e-10)
