"""A large elastic ring whose round section spins about its own centre.

Rotation is no strain, so a section that spins must go on. Matter comes to other radii
as the section turns: the stretch along the hoop slows the section as gravity slows a
pendulum, which is part of the exact solution.
"""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.elasticity import spun_section
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order
from mpisph.verify.solids import ALUMINIUM, ring_body, round_section, solid_case

_SECTION = 0.01
_RING = 100.0 * _SECTION
# Radii of the section and of its centre line [m].

_RATE = 2e4
# Angular velocity [rad/s]: the surface moves at 200 m/s.

_TURN = 2.0 * math.pi / _RATE
_OUTPUTS = 16
# In a turn.

_LEAST = 0.999
# Angular momentum after a turn, over that at the start.

_BOUND = 0.01
# Largest error of it on the way.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(12, 0.25)] if quick else [_setup(6, 1.0), _setup(12, 1.0)]


def _setup(count: int, turns: float) -> Setup:
    spacing = _SECTION / count
    outputs = np.arange(1, round(turns * _OUTPUTS) + 1) * _TURN / _OUTPUTS
    body = ring_body(_RING, _SECTION)
    case = case_from_dict(
        solid_case("spinning section", body, spacing, outputs.tolist())
    )
    start = round_section(_RING, _SECTION, spacing)
    start["u_r"], start["u_z"] = -_RATE * start["z"], _RATE * (start["r"] - _RING)
    return Setup(f"{count} a radius", case, start)


def _momenta(solved: Solved) -> tuple[Array, Array]:
    """Return the angular momenta over the first one, as computed and exact."""
    computed, exact = [], []
    for at in solved.run.snapshots:
        m, r, z, u_r, u_z = (at[name] for name in ("m", "r", "z", "u_r", "u_z"))
        middle = [np.average(each, weights=m) for each in (r, z, u_r, u_z)]
        x, y, u, v = (e - c for e, c in zip((r, z, u_r, u_z), middle, strict=True))
        computed.append((m * (x * v - y * u)).sum())
        rate = spun_section(ALUMINIUM, _RING, _RATE, at.time)[1]
        exact.append(rate / _RATE)
    return np.array(computed) / computed[0], np.array(exact)


def _check(solved: Sequence[Solved]) -> list[Check]:
    found = [_momenta(each) for each in solved]
    errors = [float(np.abs(computed - exact).max()) for computed, exact in found]
    order = observed_order([each.run.case.spacing for each in solved], errors)
    last = solved[-1].run
    computed, exact = found[-1]
    checks = [
        Check.at_most("largest error of L/L0", errors[-1], _BOUND, order=order),
    ]
    if last.snapshots[-1].time > 0.99 * _TURN:
        text = "angular momentum L/L0 after a turn"
        checks.append(Check.at_least(text, computed[-1], _LEAST, float(exact[-1])))
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    momenta, shapes = {}, {}
    for each in solved:
        turns = np.array([at.time for at in each.run.snapshots]) / _TURN
        computed, exact = _momenta(each)
        momenta[each.label] = (turns, computed)
        x, z = each.last["r"] - _RING, each.last["z"]
        shapes[each.label] = (1e3 * (x - x.mean()), 1e3 * (z - z.mean()))
    angle = np.linspace(0.0, 2.0 * np.pi, 100)
    circle = 1e3 * _SECTION * np.cos(angle), 1e3 * _SECTION * np.sin(angle)
    panels = [
        Panel("turns", "angular momentum, L/L₀", momenta, (turns, exact)),
        Panel("r − R [mm]", "z [mm]", shapes, circle, (-13.0, 13.0)),
    ]
    draw_panels("Spinning section of an elastic ring", panels, out)


PROBLEM = Problem(
    "spin",
    "An elastic section that spins goes on",
    "balance of angular momentum of a section that bends a ring, a pendulum: "
    "phi'' = -E/(2 rho R^2) sin phi",
    _setups,
    _check,
    _draw,
    "Angular momentum about the centre of the section, and the section at the end.",
)
