"""Sedov's point explosion: energy in the middle of a cold ball."""

from collections.abc import Sequence

import numpy as np

from mpisph.case.discretise import discretise
from mpisph.figures.style import Out
from mpisph.verify.exact.riemann import GasState
from mpisph.verify.exact.sedov import sedov
from mpisph.verify.gas import KM_S, GasBody, gas_setup
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import (
    Array,
    Check,
    Problem,
    Setup,
    Solved,
    observed_order,
)
from mpisph.verify.profiles import outermost_crossing, profile

GAMMA = 5.0 / 3.0

SOLUTION = sedov(GAMMA)

END = 1.0
# [ms]

FRONT = 0.75
# Where the shock is then, in a ball of radius 1 [m].

SOURCE = 0.08
# Width of the Gaussian that the energy is given by [m]: a thousandth of the mass that
# the shock has passed at the end is within it.

LOST = 0.4
# What the peak may lack of 4 times the first density, at `FINE`.

TOLERANCE = 0.01
# Of the front's place, relative, at `FINE`; both at other spacings in proportion.

FINE = 1.0 / 80.0
# [m]


def _setups(quick: bool) -> list[Setup]:
    return [_setup(n) for n in ((20, 40) if quick else (40, 80))]


def _setup(n: int) -> Setup:
    # Such that the sum over the particles is that of the solution.
    start = discretise(_ball(n, 1.0).case).fields()
    return _ball(n, SOLUTION.energy(FRONT, END) * KM_S**2 / (start["m"] @ start["E"]))


def _ball(n: int, energy: float) -> Setup:
    """Return a run with a specific energy in the middle [J/kg]."""
    heat = f"{energy} * exp(-(s / {SOURCE})**2)"
    ball = {"shape": "sphere", "radius": 1.0, "energy": heat}
    return gas_setup(
        f"1/{n}",
        f"Sedov explosion, dx = 1/{n}",
        [GasBody(ball, GasState(1.0, 0.0, 0.0))],
        1.0 / n,
        [END],
        GAMMA,
    )


def _distance(fields: dict[str, Array]) -> Array:
    distance: Array = np.hypot(fields["r"], fields["z"])
    return distance


def _layers(solved: Solved) -> tuple[Array, Array]:
    """Return the mean density of layers as thick as a spacing."""
    last = solved.last
    distance = _distance(last.arrays)
    return profile(distance, last["rho"], solved.run.case.spacing)


def _front(solved: Solved) -> float:
    """Return where the density falls through the middle of the jump."""
    return outermost_crossing(*_layers(solved), 0.5 * (1.0 + SOLUTION.jump))


def _mean_error(solved: Solved) -> float:
    last = solved.last
    distance = _distance(last.arrays)
    inside = distance < 1.2 * FRONT
    exact = SOLUTION.at(distance[inside], FRONT, END).rho
    return float(np.abs(last["rho"][inside] - exact).mean())


def _check(solved: Sequence[Solved]) -> list[Check]:
    finest = solved[-1]
    spacings = [each.run.case.spacing for each in solved]
    coarse = spacings[-1] / FINE
    peaks = [_layers(each)[1].max() for each in solved]
    fronts = [_front(each) for each in solved]
    last = finest.last
    speed = last["u_r"] ** 2 + last["u_z"] ** 2
    energy = (last["m"] * (0.5 * speed + last["E"])).sum() / KM_S**2
    given = SOLUTION.energy(FRONT, END)
    return [
        Check.at_least(
            "peak density",
            peaks[-1],
            SOLUTION.jump - coarse * LOST,
            SOLUTION.jump,
            "kg/m3",
            observed_order(spacings, [SOLUTION.jump - peak for peak in peaks]),
        ),
        Check.within(
            "place of the shock",
            fronts[-1],
            FRONT,
            coarse * TOLERANCE * FRONT,
            "m",
            observed_order(spacings, [front - FRONT for front in fronts]),
        ),
        Check.at_most(
            "mean error of the density",
            _mean_error(finest),
            coarse * 0.1,
            unit="kg/m3",
            order=observed_order(spacings, [_mean_error(each) for each in solved]),
        ),
        Check.within("energy", energy, given, 1e-6 * given, "MJ"),
    ]


def _draw(solved: Sequence[Solved], out: Out) -> None:
    line = np.linspace(0.0, 1.0, 2000)
    exact = SOLUTION.at(line, FRONT, END)
    rho, u = {}, {}
    for each in solved:
        last = each.last
        distance = _distance(last.arrays)
        speed = (last["u_r"] * last["r"] + last["u_z"] * last["z"]) / distance
        rho[each.label] = distance, last["rho"]
        u[each.label] = distance, speed / KM_S
    axis = "distance from the middle, m"
    panels = [
        Panel(axis, "density, kg/m³", rho, (line, exact.rho)),
        Panel(axis, "velocity, km/s", u, (line, exact.u)),
    ]
    draw_panels(f"{PROBLEM.title}, t = {END:g} ms", panels, out)


PROBLEM = Problem(
    name="sedov",
    title="Sedov's point explosion",
    source="Sedov (1959); Kamm and Timmes (2007), LA-UR-07-2849",
    setups=_setups,
    check=_check,
    draw=_draw,
    caption="All particles at the end.",
)
