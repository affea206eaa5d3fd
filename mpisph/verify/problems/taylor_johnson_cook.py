"""Taylor's test with a steel that hardens and softens, against two other codes.

Finite elements of DynELA and Abaqus, 5 along the radius and 50 along the rod, give the
final length, the diameter of the foot, and strain and temperature of the element on the
axis at the foot. The spacings divide that element, whose particles are averaged.

Both codes heat by 90 % of the plastic work alone. Temperatures here come from the
energy, which artificial viscosity adds to as well: some 30 K at that place. So the
temperature that the plastic work alone gives is compared too.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved
from mpisph.verify.rods import foot_diameter, rod_case, rod_length

_RADIUS = 3.2e-3
_LENGTH = 32.4e-3
_VELOCITY = 287.0
_END = 80e-6

_DENSITY = 7830.0
_YOUNG, _POISSON = 206.9e9, 0.3
_BULK = _YOUNG / (3.0 * (1.0 - 2.0 * _POISSON))
_HEAT_CAPACITY = 460.0
_SHARE = 0.9
_CELSIUS = 273.15
_COLD, _MELTING = 20.0 + _CELSIUS, 1540.0 + _CELSIUS
_STEEL = {
    "rho0": _DENSITY,
    "eos": "linear",
    "linear": {"bulk_modulus": _BULK},
    "strength": "johnson-cook",
    "johnson-cook": {
        "shear_modulus": _YOUNG / (2.0 * (1.0 + _POISSON)),
        "A": 806e6,
        "B": 614e6,
        "n": 0.168,
        "C": 0.0089,
        "m": 1.1,
        "melting_temperature": _MELTING,
        "reference_temperature": _COLD,
    },
    "thermal": "heat-capacity",
    "heat-capacity": {
        "heat_capacity": _HEAT_CAPACITY,
        "melting_temperature": _MELTING,
        "reference_temperature": _COLD,
        "heating_share": _SHARE,
    },
}
# 42CrMo4, of the manual of DynELA.

_ELEMENTS = 5, 50
# Along the radius, along the rod.

_FINAL_LENGTH = 26.52, 26.56
_FOOT = 11.15, 11.16
_STRAIN = 1.78, 1.81
_TEMPERATURE = 582.34, 590.96
# Of DynELA and of Abaqus; lengths in mm, temperatures in degrees Celsius.

_BOUND = 0.02
# Largest relative distance from what lies between both.

_COUNTS = (5, 10)
# Particles along the radius.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(count) for count in (_COUNTS[:1] if quick else _COUNTS)]


def _setup(count: int) -> Setup:
    case = rod_case(
        "Taylor's test, Johnson-Cook",
        _RADIUS, _LENGTH, count, _VELOCITY, _END, "steel", _STEEL,
    )  # fmt: skip
    return Setup(f"{count} a radius", case)


def _plastic_temperature(solved: Solved) -> Array:
    """Return the temperature that the plastic work alone gives at the end [K].

    The work is what R13 leaves out of the heat, over ``1 - share``; where the density
    exceeds the first one, the isentrope of the linear equation of state stores energy.
    """
    last = solved.last
    eta = np.maximum(last["rho"] / _DENSITY, 1.0)
    cold = _BULK / _DENSITY * (np.log(eta) + 1.0 / eta - 1.0)
    heat = _HEAT_CAPACITY * (last["T"] - _COLD)
    work = (last["E"] - cold - heat) / (1.0 - _SHARE)
    warmed: Array = _COLD + _SHARE * work / _HEAT_CAPACITY
    return warmed


def _in_element(solved: Solved, values: Array) -> float:
    """Return the mean of values by mass over the element on the axis at the foot."""
    first = solved.first
    r, z = _RADIUS / _ELEMENTS[0], _LENGTH / _ELEMENTS[1]
    inside = (first["r"] < r) & (first["z"] > -z)
    return float(np.average(values[inside], weights=first["m"][inside]))


def _check(solved: Sequence[Solved]) -> list[Check]:
    each = solved[-1]
    spacing = each.run.case.spacing
    strain = _in_element(each, each.last["plastic_strain"])
    plastic = _in_element(each, _plastic_temperature(each)) - _CELSIUS
    warm = _in_element(each, each.last["T"]) - _CELSIUS
    length, foot = rod_length(each.last, spacing), foot_diameter(each.last, spacing)
    bound = _BOUND * spacing * _COUNTS[-1] / _RADIUS
    return [
        _between("final length", 1e3 * length, _FINAL_LENGTH, bound, "mm"),
        _between("diameter of the foot", 1e3 * foot, _FOOT, bound, "mm"),
        _between("plastic strain at the foot", strain, _STRAIN, bound),
        _between(
            "temperature there by plastic work", plastic, _TEMPERATURE, bound, "°C"
        ),
        _between(
            "temperature there with viscous heat", warm, _TEMPERATURE, bound, "°C"
        ),
    ]


def _between(
    quantity: str,
    measured: float,
    codes: Sequence[float],
    bound: float,
    unit: str = "",
) -> Check:
    """Return the check that a quantity lies between both codes, but for the bound."""
    middle = float(np.mean(codes))
    tolerance = 0.5 * (max(codes) - min(codes)) + bound * middle
    return Check.within(quantity, measured, middle, tolerance, unit)


def _draw(solved: Sequence[Solved], out: Out) -> None:
    places, strains, temperatures = {}, {}, {}
    for each in solved:
        at = each.last
        height = -1e3 * at["z"]
        places[each.label] = (height, 1e3 * at["r"])
        strains[each.label] = (height, at["plastic_strain"])
        temperatures[each.label] = (height, _plastic_temperature(each) - _CELSIUS)
    finest = solved[-1].last
    temperatures[f"{solved[-1].label}, with viscous heat"] = (
        -1e3 * finest["z"],
        finest["T"] - _CELSIUS,
    )
    length, foot = float(np.mean(_FINAL_LENGTH)), float(np.mean(_FOOT))
    corners = ([0.0, 0.0, length, length], [0.5 * foot, 0.0, 0.0, 1e3 * _RADIUS])
    strain, temperature = float(np.mean(_STRAIN)), float(np.mean(_TEMPERATURE))
    near, element = (-0.2, 12.0), (0.0, 2.0)
    panels = [
        Panel("height [mm]", "r [mm]", places, corners, (-0.5, 1.05 * length)),
        Panel("height [mm]", "plastic strain", strains, (element, 2 * (strain,)), near),
        Panel(
            "height [mm]", "temperature by plastic work [°C]",
            temperatures, (element, 2 * (temperature,)), near,
        ),
    ]  # fmt: skip
    draw_panels("Taylor's test with Johnson-Cook strength", panels, out)


PROBLEM = Problem(
    "taylor-johnson-cook",
    "Taylor's test of a steel after Johnson and Cook: shape, strain and temperature",
    "O. Pantalé, manual of DynELA v4 (2020), chapter of impacts: axisymmetric Taylor "
    "test, computed with DynELA and Abaqus",
    _setups,
    _check,
    _draw,
    "The rod at the end, its strain and its temperature; lines are the ends, and the "
    "element on the axis at the foot, of the finite elements.",
)
