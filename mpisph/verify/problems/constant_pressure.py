"""A gas under constant pressure: nothing moves inside, and its surface is pushed.

The accelerations are those of one very short step. Inside they are zero. The surface is
not in equilibrium: its matter takes up the whole force of the pressure, so what is
measured there is the sum of mass times acceleration, over the pressure times the area.
It may differ by what a strip of half a smoothing length makes of the area.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import MPA, MS, GasBody, gas_setup
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved

RADIUS = 24
LENGTH = 32
# Of the rod, in spacings.

STEP = 1e-6
# [ms]

GAS = GasState(1.0, 0.0, 1.0)

INSIDE = 0.005
# Largest acceleration inside, over P/(rho dx).

UNSHARP = 0.5
# How far from its place the surface may seem to be, in smoothing lengths.


def _setups(quick: bool) -> list[Setup]:
    ratios = (1.2, 1.5, 2.0) if quick else (1.2, 1.4, 1.6, 1.8, 2.0)
    return [_setup(nph) for nph in ratios]


def _setup(nph: float) -> Setup:
    dx = 1.0 / RADIUS
    length = LENGTH * dx
    rod = {"shape": "cylinder", "radius": 1.0, "position": -0.5 * length}
    return gas_setup(
        f"NPH {nph:g}",
        f"constant pressure, NPH {nph:g}",
        [GasBody({**rod, "length": length}, GAS)],
        dx,
        [STEP],
        1.4,
        resolution={"nph": nph},
        time={"step": "fixed", "dt": MS * STEP},
    )


def _accelerations(solved: Solved) -> tuple[Array, Array]:
    """Return the radial and axial accelerations [m/s2]."""
    last = solved.last
    return last["u_r"] / (MS * STEP), last["u_z"] / (MS * STEP)


def _middle(solved: Solved) -> Array:
    """Return which particles see neither end of the rod."""
    case, z = solved.run.case, solved.first["z"]
    reach = case.scheme.kappa * case.smoothing_length + case.spacing
    middle: Array = np.abs(z) < 0.5 * LENGTH * case.spacing - reach
    return middle


def _inner(solved: Solved) -> Array:
    """Return which particles see no surface at all."""
    case = solved.run.case
    reach = case.scheme.kappa * case.smoothing_length + case.spacing
    inner: Array = _middle(solved) & (solved.first["r"] < 1.0 - reach)
    return inner


def _unit(solved: Solved) -> float:
    """Return P/(rho dx) [m/s2]."""
    return float(MPA * GAS.P / (GAS.rho * solved.run.case.spacing))


def _check(solved: Sequence[Solved]) -> list[Check]:
    return [check for each in solved for check in _checks(each)]


def _checks(solved: Solved) -> list[Check]:
    a_r, a_z = _accelerations(solved)
    first, inner, middle = solved.first, _inner(solved), _middle(solved)
    unit = _unit(solved)
    m, P = first["m"], MPA * GAS.P
    forward = first["z"] > 0.0
    end = (m * a_z)[forward].sum() / (P * np.pi)
    length = np.unique(first["z"][middle]).size * solved.run.case.spacing
    side = (m * a_r)[middle].sum() / (2.0 * np.pi * P * length)
    strip = UNSHARP * solved.run.case.smoothing_length
    name, scale = solved.label, "P/(rho dx)"
    return [
        Check.at_most(
            f"{name}: |a_r| inside", np.abs(a_r[inner]).max() / unit, INSIDE, unit=scale
        ),
        Check.at_most(
            f"{name}: |a_z| inside", np.abs(a_z[inner]).max() / unit, INSIDE, unit=scale
        ),
        Check.within(f"{name}: force on an end", end, 1.0, 2.0 * strip, "P A"),
        Check.within(f"{name}: force on the side", side, 1.0, strip, "P A"),
    ]


def _draw(solved: Sequence[Solved], out: Out) -> None:
    inside, surface = {}, {}
    for each in solved:
        ring = each.first["r"] / each.run.case.spacing
        a_r = _accelerations(each)[0] / _unit(each)
        inner, middle = _inner(each), _middle(each)
        inside[each.label] = ring[inner], a_r[inner]
        surface[each.label] = ring[middle], a_r[middle]
    line = np.array([0.0, RADIUS])
    panels = [
        Panel("r / dx", "a_r / (P/(ρ dx)), inside", inside, (line, 0.0 * line)),
        Panel("r / dx", "a_r / (P/(ρ dx))", surface, (line, 0.0 * line)),
    ]
    draw_panels(PROBLEM.title, panels, out)


PROBLEM = Problem(
    name="constant-pressure",
    title="Gas under constant pressure",
    source="no acceleration inside; the force on a surface is P times its area",
    setups=_setups,
    check=_check,
    draw=_draw,
    caption="Radial acceleration of the particles that see no end of the rod; on the "
    "left of those that do not see its side either.",
)
