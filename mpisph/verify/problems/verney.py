"""Verney's beryllium shell implodes and stops by its own strength.

The shell is filled by a square and by a polar lattice; both must stay spherical. Every
particle beside a surface tells where that surface is, if the volume between them is
kept, so that the steps of a square lattice do not count as error.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.shell import (
    Shell,
    outer_radius,
    starting_velocity,
    stopping_time,
    surface_of,
)
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved

_SHELL = Shell(0.08, 0.10, 1845.0, 330e6)
_MATERIAL = {
    "rho0": _SHELL.density,
    "eos": "mie-grueneisen",
    "mie-grueneisen": {"c0": 8000.0, "slope": 1.124, "gamma0": 1.11},
    "elastic-plastic": {
        "shear_modulus": 151e9,
        "yield_strength": _SHELL.yield_strength,
    },
    "minimum-pressure": {"value": "-inf", "mode": "off"},
}
# Steinberg, UCRL-MA-106439 (1996), S-200 beryllium with its initial yield strength.

_STOPS = (0.06, 0.05, 0.04)
# Inner radii at which the shell stops [m].

_BOUND = 0.5e-3
# Largest error of both radii [m].

_LATTICES = ("square", "polar")


def _setups(quick: bool) -> list[Setup]:
    if quick:
        return [_setup("square", 0.06, 4e-3)]
    return [_setup(lattice, stop, 1e-3) for lattice in _LATTICES for stop in _STOPS]


def _setup(lattice: str, stop: float, spacing: float) -> Setup:
    speed = starting_velocity(_SHELL, stop)
    shell = {
        "name": "shell",
        "shape": "spherical_shell",
        "inner_radius": _SHELL.inner,
        "outer_radius": _SHELL.outer,
        "filling": lattice,
        "material": "beryllium",
        "radial_velocity": f"-{speed} * ({_SHELL.inner} / s)**2",
    }
    case = case_from_dict(
        {
            "title": "Verney's shell",
            "bodies": [shell],
            "materials": {"beryllium": _MATERIAL},
            "resolution": {"spacing": spacing, "nph": 1.5},
            "scheme": {
                "viscosity": {"alpha": 0.1, "beta": 0.1},
                "heat": {"enabled": False},
            },
            "time": {"end": stopping_time(_SHELL, stop)},
            "output": {"figures": False},
        }
    )
    return Setup(f"{lattice}, {100 * stop:g} cm", case)


def _surface(solved: Solved, inner: bool) -> tuple[Array, Array]:
    """Return angles from the axis [deg] and radii of a surface [m]."""
    first, last = solved.first, solved.last
    before, now = (np.hypot(at["r"], at["z"]) for at in (first, last))
    surface = _SHELL.inner if inner else _SHELL.outer
    beside = np.abs(before - surface) < 1.25 * solved.run.case.spacing
    angle = np.degrees(np.arctan2(last["r"], last["z"]))[beside]
    return angle, surface_of(before[beside], now[beside], surface)


def _stop(solved: Solved) -> float:
    """Return the inner radius at which the shell is to stop [m]."""
    return float(solved.label.split()[1]) / 100.0


def _check(solved: Sequence[Solved]) -> list[Check]:
    checks = []
    for each in solved:
        stop = _stop(each)
        for name, exact in (
            ("inner", stop),
            ("outer", outer_radius(_SHELL, stop)),
        ):
            _, radii = _surface(each, name == "inner")
            worst = radii[np.argmax(np.abs(radii - exact))]
            what = f"{each.label}: {name} radius where it is farthest off"
            bound = 100 * _BOUND
            checks.append(Check.within(what, 100 * worst, 100 * exact, bound, "cm"))
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    panels = []
    for name, inner in (("inner", True), ("outer", False)):
        dots = {}
        for each in solved:
            stop = _stop(each)
            exact = stop if inner else outer_radius(_SHELL, stop)
            angle, radii = _surface(each, inner)
            dots[each.label] = (angle, 1e3 * (radii - exact))
        label = f"error of the {name} radius [mm]"
        exactly = ((0.0, 180.0), (0.0, 0.0))
        panels.append(Panel("angle from the axis [°]", label, dots, exactly))
    last = solved[-1].last
    shell = {solved[-1].label: (100 * last["z"], 100 * last["r"])}
    panels.append(Panel("z [cm]", "r [cm]", shell, None))
    draw_panels("Imploding beryllium shell", panels, out)


PROBLEM = Problem(
    "verney",
    "Verney's imploding beryllium shell, from two lattices",
    "energy balance of an incompressible, perfectly plastic shell (Verney, 1968; "
    "Howell and Ball, J. Comp. Phys. 175, 2002, 128)",
    _setups,
    _check,
    _draw,
    "Where the surfaces are, from each particle beside them, and the last shell.",
)
