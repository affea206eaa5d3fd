"""Copper hits aluminium: pressure on both sides of the contact, and where it is.

The exact solution is that of impedance matching: velocity and stress are the same on
both sides, and each side is behind a shock of its own.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mpisph.case import Case
from mpisph.figures.style import Out
from mpisph.verify.exact.shocks import Shocked, contact, matter_of, sound_speed
from mpisph.verify.layers import Layers, layers_of, plates
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved

_FLYER, _TARGET = "cu-ofhc", "al-6061-t6"
_METALS = ("copper", "aluminium")
_VELOCITY = 3000.0
_SPACING = 0.1e-3

_WAY = 0.8
# Part of the target that the shock passes.

_WIDTH = 1.5
# Radius of the plates over their thickness.

_PRESSURE_BOUND = 0.05
_PLACE_BOUND = 0.25
# Of the spacing.


class Sides(NamedTuple):
    """What there is on both sides of the contact.

    Attributes
    ----------
    flyer, target : Shocked
        In the frame of each at rest, with velocities away from the contact.
    velocity : float
        Of the contact [m/s].
    """

    flyer: Shocked
    target: Shocked
    velocity: float

    @property
    def states(self) -> tuple[Shocked, Shocked]:
        """The states of both sides."""
        return self.flyer, self.target


def _setups(quick: bool) -> list[Setup]:
    """Return the run, coarse if it is to be quick."""
    count = 30 if quick else 80

    def case(end: float) -> Case:
        thickness = count * _SPACING
        radius = _WIDTH * thickness
        return plates(_FLYER, _TARGET, _VELOCITY, count, _SPACING, radius, end)

    end = _WAY * count * _SPACING / _exact(case(1e-6)).target.speed
    return [Setup(f"{count} layers", case(end))]


def _exact(case: Case) -> Sides:
    """Return the states behind both shocks."""
    flyer, target = (matter_of(case.body_models(body)) for body in case.bodies)
    ours, theirs = contact(flyer, target, case.bodies[0].velocity)
    return Sides(ours[-1], theirs[-1], theirs[-1].velocity)


def _layers(solved: Solved) -> tuple[Layers, Layers]:
    """Return the layers of both bodies, those at the contact first."""
    case = solved.run.case
    sides = _exact(case)
    reach = solved.run.snapshots[-1].time * max(
        sound_speed(matter_of(case.body_models(body)), state)
        for body, state in zip(case.bodies, sides.states, strict=True)
    )
    kernel = case.scheme.kappa * case.resolution.nph * case.spacing
    rim = float(solved.run.snapshots[0]["r"].max())
    flyer, target = (
        layers_of(solved.run, name, -1, rim - reach - kernel)
        for name in ("flyer", "target")
    )
    turned = {name: values[::-1] for name, values in flyer.fields.items()}
    return Layers(flyer.start[::-1], turned), target


def _pressures(solved: Solved) -> tuple[Array, Array]:
    """Return pressure over the exact one, of layers behind the shocks, by side."""
    case = solved.run.case
    sides = _exact(case)
    ratios = []
    end = solved.run.snapshots[-1].time
    for layers, state in zip(_layers(solved), sides.states, strict=True):
        passed = int(0.5 * state.speed * end / case.spacing)
        ratios.append(layers.mean("P")[:passed] / state.pressure)
    return ratios[0], ratios[1]


def _surfaces(solved: Solved) -> tuple[Array, Array]:
    """Return where flyer and target end, on each ring [m].

    A particle reaches half of its height beyond its centre; its height has shrunk as
    its density has risen.
    """
    case = solved.run.case
    faces = []
    for layers, body, sign in zip(_layers(solved), case.bodies, (1, -1), strict=True):
        rho0 = case.body_material(body).rho0
        height = case.spacing * rho0 / layers.fields["rho"][0]
        faces.append(layers.fields["z"][0] + 0.5 * sign * height)
    return faces[0], faces[1]


def _check(solved: Sequence[Solved]) -> list[Check]:
    """Compare pressure, density and energy at the contact, and its place."""
    last = solved[-1]
    case = last.run.case
    sides = _exact(case)
    checks = []
    for name, ratio, state in zip(_METALS, _pressures(last), sides.states, strict=True):
        worst = ratio[1:][np.argmax(np.abs(ratio[1:] - 1.0))]
        what = f"{name}: pressure that is farthest off, from the second layer on"
        P = state.pressure / 1e9
        checks.append(Check.within(what, worst * P, P, _PRESSURE_BOUND * P, "GPa"))
    flyer, target = _surfaces(last)
    place = sides.velocity * last.run.snapshots[-1].time
    middle = float(0.5 * (flyer + target).mean())
    off = _PLACE_BOUND * case.spacing
    checks.append(
        Check.within("place of the contact", 1e3 * middle, 1e3 * place, 1e3 * off, "mm")
    )
    overlap = float((flyer - target).max()) / case.spacing
    checks.append(
        Check.at_most("largest overlap over the spacing", overlap, _PLACE_BOUND)
    )
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    """Draw pressure, velocity and density along the axis."""
    last = solved[-1]
    case = last.run.case
    sides = _exact(case)
    end = last.run.snapshots[-1].time
    fields = {
        "P": ("pressure [GPa]", 1e9),
        "u_z": ("velocity [km/s]", 1e3),
        "rho": ("density [kg/m³]", 1.0),
    }
    shock = _VELOCITY - sides.flyer.speed, sides.target.speed
    z = np.array([1.2 * shock[0], shock[0], sides.velocity, shock[1], 1.2 * shock[1]])
    along = 1e3 * end * np.repeat(z, 2)[1:-1]
    rho = [case.body_material(body).rho0 for body in case.bodies]
    lines = {
        "P": (0.0, sides.flyer.pressure, sides.target.pressure, 0.0),
        "u_z": (_VELOCITY, sides.velocity, sides.velocity, 0.0),
        "rho": (rho[0], sides.flyer.density, sides.target.density, rho[1]),
    }
    panels = []
    for name, (label, unit) in fields.items():
        dots = {
            metal: (1e3 * layers.mean("z"), layers.mean(name) / unit)
            for metal, layers in zip(_METALS, _layers(last), strict=True)
        }
        exactly = along, np.repeat(np.array(lines[name]) / unit, 2)
        panels.append(Panel("z [mm]", label, dots, exactly))
    draw_panels(f"Copper on aluminium at {_VELOCITY / 1e3:g} km/s", panels, out)


PROBLEM = Problem(
    "contact",
    "Copper on aluminium at 3 km/s: the contact of two materials",
    "impedance matching by the Rankine-Hugoniot conditions with the equations of state "
    "as programmed (Davison, Fundamentals of Shock Wave Propagation in Solids, 2008)",
    _setups,
    _check,
    _draw,
    "Means of layers of particles near the axis. Only the layer at the contact may be "
    "off: its kernel reaches over both materials.",
)
