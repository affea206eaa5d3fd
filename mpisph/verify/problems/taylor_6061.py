"""Rods of 6061-T6 hit a wall at several speeds: one set of constants for all.

The measured lengths of 57 rods of three laboratories lie on one curve, whatever their
length over the diameter. The diameters of their feet differ by a fifth between the
laboratories at the same speed, and are left out. The strength models of the card are
taken as they stand, without damage: by that of the card a third of a rod at 400 m/s
breaks, and it is left with 0.58 of its length instead of 0.66.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.exact.taylor import RODS_6061_T6, stopped_length, strength_of
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Check, Problem, Setup, Solved
from mpisph.verify.rods import rod_case, rod_length

_RADIUS = 3.81e-3
_LENGTH = 23.47e-3
# The shortest rods of Wilkins and Guinan.

_DENSITY = 2700.0
_STRENGTHS = ("johnson-cook", "steinberg-guinan")
_VELOCITIES = (200.0, 300.0, 400.0, 500.0, 600.0)
_END = 60e-6

_BOUND = 0.02
# Of L/L0: twice the scatter (root mean square) of the rods about their curve.


def _setups(quick: bool) -> list[Setup]:
    velocities = (400.0,) if quick else _VELOCITIES
    count = 4 if quick else 6
    return [_setup(name, U, count) for name in _STRENGTHS for U in velocities]


def _setup(strength: str, velocity: float, count: int) -> Setup:
    constants = {"strength": strength, "thermal": "heat-capacity"}
    case = rod_case(
        "Taylor's test, 6061-T6",
        _RADIUS, _LENGTH, count, velocity, _END, "al-6061-t6", constants,
    )  # fmt: skip
    return Setup(f"{strength}, {velocity:.0f} m/s", case)


def _velocity(solved: Solved) -> float:
    return float(solved.label.split()[1])


def _ratio(solved: Solved) -> float:
    """Return the length at the end over the first one."""
    return rod_length(solved.last, solved.run.case.spacing) / _LENGTH


def _measured(velocity: float) -> float:
    """Return the length over the first one on the curve of the measured rods."""
    return stopped_length(_DENSITY, strength_of(_DENSITY), velocity)


def _of(solved: Sequence[Solved], strength: str) -> list[Solved]:
    return [each for each in solved if each.label.startswith(strength)]


def _check(solved: Sequence[Solved]) -> list[Check]:
    checks = []
    for strength in _STRENGTHS:
        off = {_velocity(each): _ratio(each) for each in _of(solved, strength)}
        U, ratio = max(off.items(), key=lambda rod: abs(rod[1] - _measured(rod[0])))
        what = f"{strength}: L/L0 where it is farthest off, at {U:.0f} m/s"
        checks.append(Check.within(what, ratio, _measured(U), _BOUND))
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    lengths = {
        strength: (
            [_velocity(each) for each in _of(solved, strength)],
            [_ratio(each) for each in _of(solved, strength)],
        )
        for strength in _STRENGTHS
    }
    for laboratory, rods in RODS_6061_T6.items():
        lengths[laboratory] = [U for U, _ in rods], [ratio for _, ratio in rods]
    shapes = {
        each.label: (-1e3 * each.last["z"], 1e3 * each.last["r"])
        for each in solved
        if _velocity(each) == 400.0
    }
    line = np.linspace(0.0, 650.0, 100)
    panels = [
        Panel("velocity [m/s]", "length over the first", lengths,
              (line, [_measured(U) for U in line])),
        Panel("height [mm]", "r [mm]", shapes, None),
    ]  # fmt: skip
    draw_panels("Rods of 6061-T6", panels, out)


PROBLEM = Problem(
    "taylor-6061",
    "Taylor's test of 6061-T6 at 200 to 600 m/s, with the constants of the card",
    "measured: Wilkins and Guinan, J. Appl. Phys. 44 (1973) 1200; Gust, J. Appl. Phys. "
    "53 (1982) 3566; House et al., Int. J. Impact Eng. 16 (1995) 189",
    _setups,
    _check,
    _draw,
    "Final lengths beside those of measured rods and their curve; both at 400 m/s.",
)
