"""A sphere of 2017-T4 makes a crater in a thick plate of 6061-T6.

No solution is known; the depth stands beside the equation that shields are designed
by, and the shape beside the mean of many craters. The materials are cards as they
come, with hardening, melting, spall and tearing. The crater ends where the target's
matter begins, be it broken; what is left of the sphere lines it.
"""

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from mpisph.case import Case, case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.crater import DEEPEST, SHALLOWEST, crater_depth
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved

_SPHERE, _TARGET = "al-2017-t4", "al-6061-t6"
_DIAMETER = 9.53e-3
_SPEEDS = (7000.0, 5000.0)

_SIZE = 6.0
# Thickness and radius of the target in diameters of the sphere: 2.8 times the depth of
# the deepest crater. From 2.2 times on nothing flies off the rear face, from 3 times on
# nothing spalls there (NASA/TM-2009-214785).

_HARDNESS = 95.0
_YOUNGS_MODULUS = 68.9e9
# Brinell's hardness and Young's modulus of 6061-T6 (ASM Handbook, volume 2, 1990).

_END = 30e-6
# The depth changes no more from two thirds of it on.

_DEPTH_BOUND = 0.15
_SHAPE_BOUND = 0.15
# As far as a fit may be trusted for a single alloy. Where the wall of the crater meets
# the face, it is known no better than to a particle.

_BROKEN = 0.5
# Least damage of what is drawn as broken.

_NEAR_AXIS = 0.2
# Radius within which the depth is taken, in diameters of the sphere.


def _setups(quick: bool) -> list[Setup]:
    fast, slow = _SPEEDS
    chosen = [(3, fast)] if quick else [(8, fast), (8, slow)]
    return [_setup(npr, speed) for npr, speed in chosen]


def _setup(npr: int, speed: float) -> Setup:
    sphere = {"name": "sphere", "shape": "sphere", "material": _SPHERE}
    target = {"name": "target", "shape": "plate", "material": _TARGET, "position": 0.0}
    radius = 0.5 * _DIAMETER
    size = _SIZE * _DIAMETER
    case = case_from_dict(
        {
            "title": "A crater in thick aluminium",
            "bodies": [
                {**sphere, "radius": radius, "position": -radius, "velocity": speed},
                {**target, "thickness": size, "radius": size},
            ],
            "resolution": {"npr": npr},
            "time": {"end": _END},
            "output": {"figures": False},
        }
    )
    return Setup(f"{speed / 1e3:g} km/s, NPR {npr}", case)


def _exact(case: Case) -> float:
    """Return the depth of the crater by the equation [m]."""
    sphere, target = (case.body_material(body) for body in case.bodies)
    sound = math.sqrt(_YOUNGS_MODULUS / target.rho0)
    speed = case.bodies[0].velocity
    return crater_depth(_DIAMETER, sphere.rho0, speed, target.rho0, _HARDNESS, sound)


class Crater(NamedTuple):
    """What is left of the target.

    Attributes
    ----------
    r, z : ndarray
        Of all matter, from where the face of the target would be now [m].
    parts : mapping of str to ndarray of bool
        What of it is what.
    depth, diameter : float
        [m].
    """

    r: Array
    z: Array
    parts: Mapping[str, Array]
    depth: float
    diameter: float


def _crater(solved: Solved) -> Crater:
    first, last = solved.first, solved.last
    spacing = solved.run.case.spacing
    target = last.body("target")
    # The far corner has felt nothing but the push.
    far = target & (first["r"] > 0.8 * first["r"][target].max())
    far &= first["z"] > 0.3 * first["z"][target].max()
    push = np.average((last["z"] - first["z"])[far], weights=last["m"][far])
    r, z = last["r"], last["z"] - push
    near = target & (r < _NEAR_AXIS * _DIAMETER)
    face = target & (np.abs(z - 0.5 * spacing) < spacing)
    broken = last["damage"] > _BROKEN
    parts = {
        "sound": target & ~broken,
        "broken": target & broken,
        "of the sphere": ~target,
    }
    # A particle reaches half of a spacing beyond its centre.
    depth = float(z[near].min()) - 0.5 * spacing
    diameter = 2.0 * (float(r[face].min()) - 0.5 * spacing)
    return Crater(r, z, parts, depth, diameter)


def _check(solved: Sequence[Solved]) -> list[Check]:
    checks = []
    for each in solved:
        crater, exact = _crater(each), _exact(each.run.case)
        off = _SHAPE_BOUND + 2.0 * each.run.case.spacing / crater.diameter
        name = f"{each.run.case.bodies[0].velocity / 1e3:g} km/s: "
        checks += [
            Check.within(
                name + "depth of the crater",
                1e3 * crater.depth,
                1e3 * exact,
                1e3 * _DEPTH_BOUND * exact,
                "mm",
            ),
            Check(
                name + "depth over diameter",
                "",
                crater.depth / crater.diameter,
                0.5 * (SHALLOWEST + DEEPEST),
                (1.0 - off) * SHALLOWEST,
                (1.0 + off) * DEEPEST,
            ),
        ]
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    panels = []
    for each in solved:
        crater = _crater(each)
        depth = _exact(each.run.case)
        radius = depth / (SHALLOWEST + DEEPEST)
        across = np.linspace(0.0, radius, 60)
        # Half of an ellipse of that depth and diameter.
        line = depth * np.sqrt(1.0 - (across / radius) ** 2)
        extent = 1.5 * depth
        shown = (crater.r < extent) & (np.abs(crater.z) < extent)
        dots = {
            name: (1e3 * crater.r[shown & part], -1e3 * crater.z[shown & part])
            for name, part in crater.parts.items()
        }
        panels.append(
            Panel(
                "r [mm]", "z [mm]", dots, (1e3 * across, -1e3 * line),
                (0.0, 1e3 * extent), each.label,
            )
        )  # fmt: skip
    draw_panels("Crater in thick aluminium", panels, out)


PROBLEM = Problem(
    "crater",
    "Crater of an aluminium sphere in a thick plate",
    "no exact solution: depth by Cour-Palais, Int. J. Impact Engng 5 (1987) 221, as in "
    "NASA/TM-2009-214785; depth over diameter by Love et al., Int. J. Impact Engng 16 "
    "(1995) 405",
    _setups,
    _check,
    _draw,
    "Matter at the end, and the crater of that depth and diameter.",
)
