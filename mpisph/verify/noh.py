"""Noh's problem of gas that streams to a plane, an axis or a point.

Two wide rods meet in the plane, and a long one streams to its axis: the rarefactions
from their other surfaces do not come to what is looked at.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.exact.noh import noh, noh_shock
from mpisph.verify.gas import SHOCK_PLACE, GasBody, gas_setup
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import (
    Array,
    Check,
    Problem,
    Setup,
    Solved,
    observed_order,
)
from mpisph.verify.profiles import mean_in, outermost_crossing, profile

GAMMA = 5.0 / 3.0

END = 0.6
# [ms]

BETA = 1.5
# Of the viscosity: with 2 the spherical shock is half a spacing farther out.

SHOCK = noh_shock(GAMMA) * END
# Where it is at the end [m].

WINDOW = (0.06, 0.17)
# Behind the shock, and outside of the wall heating [m].

TOLERANCE = 0.05
# Of the density there, relative, at `FINE`; at other spacings in proportion.

FINE = 1.0 / 80.0
# [m]

SEEN = 0.4
# What is drawn [m].


class Stream(NamedTuple):
    """A geometry of Noh's problem.

    Attributes
    ----------
    name, title : str
    dimensions : int
        1 for the plane, 2 for the axis, 3 for the point.
    bodies : sequence of GasBody
        The gas at the start; its density and its speed are 1.
    look : float
        Radius (plane) or axial distance (axis) within which it is looked at [m].
    """

    name: str
    title: str
    dimensions: int
    bodies: Sequence[GasBody]
    look: float


def noh_problem(stream: Stream) -> Problem:
    """Return Noh's problem in a geometry."""
    return Problem(
        name=stream.name,
        title=stream.title,
        source="Noh (1987), J. Comp. Phys. 72, 78-120, section 5",
        setups=partial(_setups, stream),
        check=partial(_check, stream),
        draw=partial(_draw, stream),
        caption="Particles that no rarefaction has met, at the end.",
    )


def _setups(stream: Stream, quick: bool) -> list[Setup]:
    return [_setup(stream, n) for n in ((20, 40) if quick else (40, 80))]


def _setup(stream: Stream, n: int) -> Setup:
    return gas_setup(
        f"1/{n}",
        f"{stream.title}, dx = 1/{n}",
        stream.bodies,
        1.0 / n,
        [END],
        GAMMA,
        scheme={"viscosity": {"alpha": 1.0, "beta": BETA}},
    )


def _distance(stream: Stream, r: Array, z: Array) -> Array:
    """Return the distance from the plane, the axis or the point."""
    distance: Array = (np.abs(z), r, np.hypot(r, z))[stream.dimensions - 1]
    return distance


def _seen(stream: Stream, solved: Solved) -> tuple[Array, Array, Array]:
    """Return distance, density and mass of the particles that are looked at."""
    last = solved.last
    r, z = last["r"], last["z"]
    across = (r, np.abs(z), 0.0 * r)[stream.dimensions - 1]
    distance = _distance(stream, r, z)
    seen = (across <= stream.look) & (distance < SEEN)
    return distance[seen], last["rho"][seen], last["m"][seen]


def _mean_error(stream: Stream, solved: Solved) -> float:
    """Return the mean error of the density over that behind the shock."""
    distance, rho, _ = _seen(stream, solved)
    exact = noh(distance, END, GAMMA, stream.dimensions).rho
    return float(np.abs(rho - exact).mean() / exact.max())


def _check(stream: Stream, solved: Sequence[Solved]) -> list[Check]:
    finest = solved[-1]
    dx = finest.run.case.spacing
    distance, rho, m = _seen(stream, finest)
    near = 1e-9
    inside, outside = noh(
        [SHOCK - near, SHOCK + near], END, GAMMA, stream.dimensions
    ).rho
    middles, means = profile(distance, rho, dx)
    layers = means[(middles > WINDOW[0]) & (middles < WINDOW[1])]
    worst = layers[np.abs(layers - inside).argmax()]
    tolerance = TOLERANCE * dx / FINE * inside
    place = outermost_crossing(middles, means, 0.5 * (inside + outside))
    order = observed_order(
        [each.run.case.spacing for each in solved],
        [_mean_error(stream, each) for each in solved],
    )
    return [
        Check.within(
            "density behind the shock",
            mean_in(rho, m, distance, *WINDOW),
            float(inside),
            tolerance,
            "kg/m3",
            order,
        ),
        Check.within("density, worst layer", worst, float(inside), tolerance, "kg/m3"),
        Check.within("place of the shock", place, SHOCK, SHOCK_PLACE * dx, "m"),
    ]


def _draw(stream: Stream, solved: Sequence[Solved], out: Out) -> None:
    line = np.linspace(1e-3, SEEN, 1000)
    exact = noh(line, END, GAMMA, stream.dimensions).rho
    dots = {each.label: _seen(stream, each)[:2] for each in solved}
    axis = ("|z|, m", "r, m", "distance from the middle, m")[stream.dimensions - 1]
    panel = Panel(axis, "density, kg/m³", dots, (line, exact))
    draw_panels(f"{stream.title}, t = {END:g} ms", [panel], out)
