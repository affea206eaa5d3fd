"""A sphere on a very thin plate, below and above the speed at which it breaks.

Piekutowski shot 9.53 mm spheres of 2017-T4 at plates of 0.46 mm of 6061-T6. At
3.77 km/s, shot 4-1428, the sphere stayed whole; at 4.71 km/s, shot 4-1433, it broke.
His threshold between them is 1.436 (t/D)^(-1/3) km/s, at 3.95 km/s. The materials are
the cards with the models that they choose; nothing is fitted to the shots.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.analysis.fragments import find_fragments
from mpisph.case import case_from_dict
from mpisph.diagnostics.cloud import cloud_definition
from mpisph.diagnostics.condition import BROKEN
from mpisph.figures.style import Out
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Check, Problem, Setup, Solved

_RADIUS = 4.765e-3
_SHOTS = (("4-1428", 3.77e3, 0.46e-3), ("4-1433", 4.71e3, 0.47e-3))
# Velocity of the sphere [m/s] and thickness of the plate [m].

_NPR, _QUICK_NPR = 40, 20
# Four rows of particles in the plate, or two.

_END, _QUICK_END = 8e-6, 5e-6

_WHOLE = 0.5
# Share of the sphere in its heaviest piece, above which it counts as whole.

_LARGEST_RATIO, _QUICK_RATIO = 0.5, 0.65
# Of that share above the threshold to that below it: two rows tell no more, and keep
# both spheres less apart than four.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(*shot, quick) for shot in _SHOTS]


def _setup(shot: str, velocity: float, thickness: float, quick: bool) -> Setup:
    sphere = {"name": "sphere", "shape": "sphere", "radius": _RADIUS}
    sphere |= {"position": -_RADIUS, "velocity": velocity, "material": "al-2017-t4"}
    plate = {"name": "plate", "shape": "plate", "thickness": thickness}
    plate |= {"radius": 5.0 * _RADIUS, "material": "al-6061-t6"}
    case = case_from_dict(
        {
            "title": f"Shot {shot}",
            "bodies": [sphere, plate],
            "resolution": {"npr": _QUICK_NPR if quick else _NPR},
            "time": {"end": _QUICK_END if quick else _END},
            "output": {"figures": False},
        }
    )
    return Setup(f"{shot}, NPR {case.resolution.npr}", case)


def _heaviest(solved: Solved) -> float:
    """Return the share of the sphere's mass that is in its heaviest piece."""
    at = solved.last
    found = find_fragments(at.arrays, cloud_definition(solved.run.case))
    mass = at["m"][at.body("sphere")].sum()
    return float(found.body_mass[:, 0].max(initial=0.0) / mass)


def _check(solved: Sequence[Solved]) -> list[Check]:
    whole, broken = (_heaviest(each) for each in solved)
    ratio = broken / whole
    name = "heaviest piece above the threshold over that below it"
    whole_run = solved[0].run.case.resolution.npr == _NPR
    largest = _LARGEST_RATIO if whole_run else _QUICK_RATIO
    checks = [Check.at_most(name, ratio, largest)]
    if whole_run:
        checks += [
            Check.at_least("4-1428: share of the heaviest piece", whole, _WHOLE, 1.0),
            Check.at_most("4-1433: share of the heaviest piece", broken, _WHOLE),
        ]
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    panels = []
    for each in solved:
        at = each.last
        sphere = at.body("sphere")
        sets = {}
        for name, chosen in (
            ("sound", at["damage"] <= 0.0),
            ("cracked", (at["damage"] > 0.0) & (at["damage"] < BROKEN)),
            ("broken", at["damage"] >= BROKEN),
        ):
            k = sphere & chosen
            sets[name] = (1e3 * at["z"][k], 1e3 * at["r"][k])
        middle = 1e3 * float(np.median(at["z"][sphere]))
        limits = (middle - 8.0, middle + 8.0)
        panels.append(Panel("z [mm]", "r [mm]", sets, None, limits, each.label))
    draw_panels("A sphere on a very thin plate", panels, out)


PROBLEM = Problem(
    "thin-plate",
    "a sphere on a very thin plate stays whole, and breaks when it is faster",
    "Piekutowski (1996), NASA CR-4707, shots 4-1428 and 4-1433",
    _setups,
    _check,
    _draw,
    "Both spheres after the impact: sound, cracked and broken matter.",
)
