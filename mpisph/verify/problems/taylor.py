"""Taylor's test: a copper rod hits its mirror image and becomes shorter.

Two equal rods meet, so that the plane between them is a rigid wall without friction.
Wilkins and Guinan found one curve for the final length of rods that were computed as
elastic and perfectly plastic. Beside it stands the balance of energy: plastic work
takes all kinetic energy but what viscosity heats and what still vibrates. And rings
near the axis must widen as their neighbours do.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.taylor import final_length
from mpisph.verify.layers import PERFECT
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order

_LENGTH = 32.4e-3
_RADIUS = 3.2e-3
_YIELD = 400e6
_DENSITY = 8930.0
# Of work-hardened copper.

_VELOCITY = 190.0
# Of each rod against the plane between them [m/s].

_END = 80e-6

_LENGTH_BOUND = 0.05
_WORK_BOUND = 0.05
_AXIS_BOUND = 0.1
# Largest relative errors; the curve was fitted to computed rods that closely.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(count) for count in ((4,) if quick else (6, 12))]


def _setup(count: int) -> Setup:
    rod = {
        "shape": "cylinder",
        "radius": _RADIUS,
        "length": _LENGTH,
        "material": "cu-ofhc",
    }
    case = case_from_dict(
        {
            "title": "Taylor's test",
            "bodies": [
                {
                    **rod,
                    "name": "rod",
                    "position": -_LENGTH,
                    "velocity": 2.0 * _VELOCITY,
                },
                {**rod, "name": "image", "position": 0.0},
            ],
            "materials": {
                "cu-ofhc": {
                    "elastic-plastic": {"yield_strength": _YIELD},
                    "minimum-pressure": {"value": "-inf", "mode": "off"},
                }
            },
            "resolution": {"spacing": _RADIUS / count, "nph": 1.5},
            "scheme": {
                **PERFECT,
                "viscosity": {"alpha": 0.1, "beta": 0.5},
                "heat": {"enabled": False},
            },
            "time": {"end": _END},
            "output": {"figures": False},
        }
    )
    return Setup(f"{count} a radius", case)


def _length(solved: Solved) -> float:
    """Return the length of a rod at the end [m]; the free ends keep their spacing."""
    z = solved.last["z"]
    beyond = _LENGTH - float(solved.first["z"].max())
    return 0.5 * float(z.max() - z.min()) + beyond


def _work(solved: Solved) -> float:
    """Return the plastic work over the kinetic energy about the plane."""
    last = solved.last
    work = float((last["m"] * last["plastic_strain"]).sum()) * _YIELD / _DENSITY
    return work / (0.5 * float(last["m"].sum()) * _VELOCITY**2)


def _axis(solved: Solved) -> float:
    """Return how rings 0 and 1 have widened over rings 2 and 3: the farthest from 1.

    Rings are compared beside the foot, where the strain is even along r.
    """
    first, last = solved.first, solved.last
    ring = np.floor(first["r"] / solved.run.case.spacing)
    height = np.abs(last["z"] - np.average(last["z"], weights=last["m"]))
    beside = (height > _RADIUS) & (height < 1.5 * _RADIUS)
    wider = last["r"] / first["r"]
    inner = [wider[beside & (ring == k)].mean() for k in (0, 1)]
    outer = wider[beside & ((ring == 2) | (ring == 3))].mean()
    return float(max((each / outer for each in inner), key=lambda x: abs(x - 1.0)))


def _check(solved: Sequence[Solved]) -> list[Check]:
    exact = final_length(_LENGTH, _DENSITY, _YIELD, _VELOCITY)
    lengths = [_length(each) for each in solved]
    sizes = [each.run.case.spacing for each in solved]
    order = observed_order(sizes, [length - exact for length in lengths])
    bound = _LENGTH_BOUND * exact
    last = lengths[-1]
    return [
        Check.within("final length", 1e3 * last, 1e3 * exact, 1e3 * bound, "mm", order),
        Check.within(
            "plastic work over kinetic energy", _work(solved[-1]), 1.0, _WORK_BOUND
        ),
        Check.within(
            "widening of ring 0 or 1 over that of the next two",
            _axis(solved[-1]),
            1.0,
            _AXIS_BOUND,
        ),
    ]


def _draw(solved: Sequence[Solved], out: Out) -> None:
    exact = 1e3 * final_length(_LENGTH, _DENSITY, _YIELD, _VELOCITY)
    strains, shapes = {}, {}
    for each in solved:
        at = each.last
        middle = float(np.average(at["z"], weights=at["m"]))
        z: Array = 1e3 * (at["z"] - middle)
        shapes[each.label] = (z, 1e3 * at["r"])
        strains[each.label] = (z, at["plastic_strain"])
    ends = (np.array([-exact, -exact, exact, exact]), np.array([0.0, 3.2, 3.2, 0.0]))
    panels = [
        Panel("z [mm]", "r [mm]", shapes, ends, (-1.1 * exact, 1.1 * exact)),
        Panel("z [mm]", "plastic strain", strains, None),
    ]
    draw_panels("Taylor's test", panels, out)


PROBLEM = Problem(
    "taylor",
    "Taylor's test: the length of a perfectly plastic rod after its impact",
    "Wilkins and Guinan, J. Appl. Phys. 44 (1973) 1200, of computed rods: "
    "L/L0 = 0.88 exp(-rho U^2/(2 Y)) + 0.12; balance of energy",
    _setups,
    _check,
    _draw,
    "Both rods at the end, within the ends that the curve gives; their plastic strain.",
)
