"""Shock tubes: two gases in a wide rod, looked at near its axis.

The rod is so wide, and so long, that the rarefactions from its free surfaces come
neither to what is looked at nor to the waves from its middle.
"""

from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.exact.riemann import GasState, Riemann, solve_riemann
from mpisph.verify.gas import (
    KM_S,
    MPA,
    SHOCK_PLACE,
    GasBody,
    gas_setup,
)
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

GAMMA = 1.4

VISCOSITY = {"alpha": 1.5, "beta": 3.0}
# With alpha = 1 the particles that a shock has pushed into new places keep swinging.

FINE = 0.01
# Spacing at which the tolerances count [m].

CONTACT = 0.05
# Largest error of the pressure there, relative, at all spacings.

CONTACT_LAYERS = 4.0
# That count as being at the contact.

REACH = 5.0
# Of a kernel in spacings, for h = 1.5 dx that grows by a tenth.


class Tube(NamedTuple):
    """A shock tube.

    Attributes
    ----------
    name, title, source : str
    left, right : GasState
        In km/s and MPa; the left one is at z < 0.
    end : float
        [ms].
    z_low, z_high, radius : float
        The rod [m].
    look : float
        Radius within which it is looked at [m].
    tolerance : float
        Of pressure and velocity behind the shock, relative; this and the others count
        at dx = 1/100, and at other spacings in proportion to these.
    density_tolerance : float
        Of the density there.
    spread : float
        Of the mean error of the density over its largest jump.
    """

    name: str
    title: str
    source: str
    left: GasState
    right: GasState
    end: float
    z_low: float
    z_high: float
    radius: float
    look: float
    tolerance: float
    density_tolerance: float
    spread: float

    @property
    def solution(self) -> Riemann:
        """The exact solution."""
        return solve_riemann(self.left, self.right, GAMMA)


def tube_problem(tube: Tube) -> Problem:
    """Return the problem of a tube."""
    return Problem(
        name=tube.name,
        title=tube.title,
        source=tube.source,
        setups=partial(_setups, tube),
        check=partial(_check, tube),
        draw=partial(_draw, tube),
        caption=f"Particles within {tube.look:g} m of the axis, at the end.",
    )


def _setups(tube: Tube, quick: bool) -> list[Setup]:
    return [_setup(tube, n) for n in ((25, 50) if quick else (50, 100))]


def _setup(tube: Tube, n: int) -> Setup:
    rod = {"shape": "cylinder", "radius": tube.radius}
    left = {**rod, "position": tube.z_low, "length": -tube.z_low}
    right = {**rod, "position": 0.0, "length": tube.z_high}
    return gas_setup(
        f"1/{n}",
        f"{tube.title}, dx = 1/{n}",
        [GasBody(left, tube.left), GasBody(right, tube.right)],
        1.0 / n,
        [tube.end],
        GAMMA,
        scheme={"viscosity": VISCOSITY},
    )


def _seen(tube: Tube, solved: Solved) -> tuple[dict[str, Array], Array]:
    """Return the particles near the axis and far from the ends, and their z."""
    last = solved.last
    z = last["z"]
    length = tube.end * np.sqrt(GAMMA * np.array([s.P / s.rho for s in tube[3:5]]))
    room = length + REACH * solved.run.case.spacing
    seen = (last["r"] < tube.look) & (z > tube.z_low + room[0])
    seen &= z < tube.z_high - room[1]
    units = {"rho": 1.0, "u_z": KM_S, "P": MPA, "m": 1.0}
    return {name: last[name][seen] / unit for name, unit in units.items()}, z[seen]


def _mean_error(tube: Tube, solved: Solved) -> float:
    """Return the mean error of the density over its largest jump."""
    fields, z = _seen(tube, solved)
    exact = tube.solution.at(z / tube.end).rho
    return float(np.abs(fields["rho"] - exact).mean() / np.ptp(exact))


def _contact_error(tube: Tube, solved: Solved) -> float:
    """Return the largest relative error of the pressure next to the contact.

    The first layer on either side is left out.
    """
    first, last, dx = solved.first, solved.last, solved.run.case.spacing
    depth = np.abs(first["z"]) / dx
    near = (last["r"] < tube.look) & (depth > 1.0) & (depth < CONTACT_LAYERS)
    P = tube.solution.P
    return float(np.abs(last["P"][near] / MPA - P).max() / P)


def _check(tube: Tube, solved: Sequence[Solved]) -> list[Check]:
    finest = solved[-1]
    exact, end = tube.solution, tube.end
    dx = finest.run.case.spacing
    coarse = dx / FINE
    fields, z = _seen(tube, finest)
    contact, shock = exact.u * end, exact.shock_speed * end
    nearby = 1e-6 * exact.u
    behind = exact.at(exact.u + nearby).rho
    # The middle half of what lies between contact and shock.
    part = 0.25 * (shock - contact)
    window = contact + part, shock - part
    P, u, rho = (
        mean_in(fields[f], fields["m"], z, *window) for f in ("P", "u_z", "rho")
    )
    place = outermost_crossing(
        *profile(z, fields["rho"], dx), 0.5 * (behind + tube.right.rho)
    )
    errors = [_mean_error(tube, each) for each in solved]
    order = observed_order([each.run.case.spacing for each in solved], errors)
    return [
        Check.within("place of the shock", place, shock, SHOCK_PLACE * dx, "m"),
        Check.at_most(
            "pressure at the contact, error beyond its first layers",
            _contact_error(tube, finest),
            CONTACT,
        ),
        Check.within(
            "pressure behind the shock",
            P,
            exact.P,
            coarse * tube.tolerance * exact.P,
            "MPa",
        ),
        Check.within(
            "velocity behind the shock",
            u,
            exact.u,
            coarse * tube.tolerance * exact.u,
            "km/s",
        ),
        Check.within(
            "density behind the shock",
            rho,
            float(behind),
            coarse * tube.density_tolerance * float(behind),
            "kg/m3",
        ),
        Check.at_most(
            "mean error of the density over its jump",
            errors[-1],
            tube.spread * coarse,
            order=order,
        ),
    ]


def _draw(tube: Tube, solved: Sequence[Solved], out: Out) -> None:
    exact = tube.solution
    fields, z = _seen(tube, solved[-1])
    line = np.linspace(z.min(), z.max(), 2000)
    states = exact.at(line / tube.end)
    labels = ("density, kg/m³", "velocity, km/s", "pressure, MPa")
    panels = []
    for label, name, state in zip(labels, ("rho", "u_z", "P"), states, strict=True):
        dots = {}
        for each in solved:
            fields, z = _seen(tube, each)
            dots[each.label] = z, fields[name]
        panels.append(Panel("z, m", label, dots, (line, state)))
    draw_panels(f"{tube.title}, t = {tube.end:g} ms", panels, out)
