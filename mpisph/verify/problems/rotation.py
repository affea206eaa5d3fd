"""A long elastic cylinder in steady rotation keeps its stresses.

It is the section of so large a ring that stretch along the hoop is nothing: a cylinder
in plane strain. It starts with the stresses that hold it together, which turn with it:
their invariants stay. A stress rate that is not objective would change them.
"""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.physics.stress import equivalent_stress
from mpisph.verify.exact.elasticity import spun_cylinder
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order
from mpisph.verify.solids import ALUMINIUM, ring_body, round_section, solid_case

_SECTION = 0.01
_RING = 6e4 * _SECTION
# Radii of the cylinder and of the ring [m].

_RATE = 2e4
_TURN = 2.0 * math.pi / _RATE
# Angular velocity [rad/s] and time of a turn [s].

_INSIDE = 0.75
# Part of the radius within which no kernel reaches beyond the surface, at 12 a radius.

_BOUND = 0.02
# Largest mean error of the invariants, of the largest stress.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(12, 0.25)] if quick else [_setup(6, 1.0), _setup(12, 1.0)]


def _setup(count: int, turns: float) -> Setup:
    spacing = _SECTION / count
    body = ring_body(_RING, _SECTION)
    times = [turns * _TURN]
    case = case_from_dict(solid_case("rotating cylinder", body, spacing, times))
    start = round_section(_RING, _SECTION, spacing)
    x, z = start["r"] - _RING, start["z"]
    start["u_r"], start["u_z"] = -_RATE * z, _RATE * x
    s = np.hypot(x, z)
    stress = spun_cylinder(ALUMINIUM, _SECTION, _RATE, s)
    mean = (stress.radial + stress.hoop + stress.axial) / 3.0
    cos2, sin2, both = (x / s) ** 2, (z / s) ** 2, x * z / s**2
    start["S_rr"] = stress.radial * cos2 + stress.hoop * sin2 - mean
    start["S_zz"] = stress.radial * sin2 + stress.hoop * cos2 - mean
    start["S_rz"] = (stress.radial - stress.hoop) * both
    start["rho"] = ALUMINIUM.density * (1.0 - mean / ALUMINIUM.bulk_modulus)
    return Setup(f"{count} a radius", case, start)


def _invariants(at: Solved, first: bool = False) -> tuple[Array, Array, Array]:
    """Return distance from the centre [m], mean and equivalent stress [Pa]."""
    p = at.first if first else at.last
    m = p["m"]
    x, z = (p[name] - np.average(p[name], weights=m) for name in ("r", "z"))
    equivalent = np.array(
        [
            equivalent_stress(*each)
            for each in zip(p["S_rr"], p["S_zz"], p["S_rz"], strict=True)
        ]
    )
    return np.hypot(x, z), -p["P"], equivalent


def _exact(s: Array) -> tuple[Array, Array]:
    """Return mean and equivalent stress at distances from the centre [Pa]."""
    stress = np.array(spun_cylinder(ALUMINIUM, _SECTION, _RATE, s))
    mean = stress.mean(axis=0)
    return mean, np.sqrt(1.5 * ((stress - mean) ** 2).sum(axis=0))


def _errors(solved: Solved) -> list[float]:
    """Return root mean square errors of both invariants, over the largest stress."""
    s, *found = _invariants(solved)
    inside = s < _INSIDE * _SECTION
    largest = float(spun_cylinder(ALUMINIUM, _SECTION, _RATE, np.zeros(1)).radial[0])
    return [
        float(np.sqrt(np.mean((value - exact)[inside] ** 2))) / largest
        for value, exact in zip(found, _exact(s), strict=True)
    ]


def _check(solved: Sequence[Solved]) -> list[Check]:
    errors = [_errors(each) for each in solved]
    sizes = [each.run.case.spacing for each in solved]
    names = ("mean stress", "equivalent stress")
    return [
        Check.at_most(
            f"error of the {name} over the largest stress", each[-1], _BOUND,
            order=observed_order(sizes, each),
        )
        for name, each in zip(names, zip(*errors, strict=True), strict=True)
    ]  # fmt: skip


def _draw(solved: Sequence[Solved], out: Out) -> None:
    line = np.linspace(0.0, _SECTION, 100)
    panels = []
    for k, name in enumerate(("mean stress [MPa]", "equivalent stress [MPa]")):
        dots = {}
        for each in solved:
            s, *found = _invariants(each)
            dots[each.label] = (1e3 * s, found[k] / 1e6)
        exact = (1e3 * line, _exact(line)[k] / 1e6)
        panels.append(Panel("distance from the centre [mm]", name, dots, exact))
    draw_panels("Rotating cylinder", panels, out)


PROBLEM = Problem(
    "rotation",
    "Objectivity: the stresses of a rotating cylinder turn with it",
    "Timoshenko and Goodier, Theory of Elasticity (1970), section 32, in plane strain",
    _setups,
    _check,
    _draw,
    "Invariants of the stress of all particles at the end.",
)
