"""A free elastic sphere breathes in its lowest radial mode.

It starts undeformed, with the velocities of the mode. The frequency is read from the
times at which its radial momentum vanishes.
"""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.elasticity import sphere_displacement, sphere_wavenumber
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order
from mpisph.verify.solids import ALUMINIUM, solid_case, zero_crossings

_RADIUS = 0.01
_SPEED = 10.0
# Of the surface at the start [m/s].

_WAVENUMBER = sphere_wavenumber(ALUMINIUM, _RADIUS)
_PERIOD = 2.0 * math.pi / (_WAVENUMBER * ALUMINIUM.longitudinal_speed)

_LARGEST = float(sphere_displacement(np.array(_WAVENUMBER * _RADIUS)))
_X = f"({_WAVENUMBER} * s)"
_VELOCITY = f"{_SPEED / _LARGEST} * (sin{_X} / {_X}**2 - cos{_X} / {_X})"
# As `_mode`.

_PERIODS = 1.25
_OUTPUTS = 20
# In a period.

_FREQUENCY_BOUND = 0.02
_ROUND_BOUND = 0.05
# Largest relative errors.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(count) for count in ((30,) if quick else (10, 20, 40))]


def _setup(count: int) -> Setup:
    times = np.arange(1, round(_PERIODS * _OUTPUTS) + 1) * _PERIOD / _OUTPUTS
    body = {"shape": "sphere", "radius": _RADIUS, "radial_velocity": _VELOCITY}
    case = case_from_dict(
        solid_case(
            "breathing sphere", body, _RADIUS / count, times.tolist(), viscosity=0.1
        )
    )
    return Setup(f"{count} a radius", case)


def _mode(s: Array) -> Array:
    """Return the velocity of the mode over that of the surface."""
    mode: Array = sphere_displacement(_WAVENUMBER * s)
    return mode / _LARGEST


def _amplitudes(solved: Solved) -> tuple[Array, Array, Array]:
    """Return times [s] and the share of the mode in the velocities over the first one.

    The last is that share within 30 degrees of the axis alone.
    """
    first = solved.first
    s = np.hypot(first["r"], first["z"])
    unit_r, unit_z, mode, m = first["r"] / s, first["z"] / s, _mode(s), first["m"]
    near = first["r"] < 0.5 * s
    times, whole, axis = [], [], []
    for at in solved.run.snapshots:
        part = m * mode * (at["u_r"] * unit_r + at["u_z"] * unit_z)
        times.append(at.time)
        whole.append(part.sum())
        axis.append(part[near].sum())
    return (
        np.array(times),
        np.array(whole) / whole[0],
        np.array(axis) / axis[0],
    )


def _frequency(solved: Solved) -> float:
    """Return the frequency from the second and fourth quarter [Hz]."""
    times, amplitude, _ = _amplitudes(solved)
    zeros = zero_crossings(times, amplitude)
    return 0.5 / (zeros[1] - zeros[0]) if len(zeros) > 1 else math.nan


def _check(solved: Sequence[Solved]) -> list[Check]:
    exact = 1.0 / _PERIOD
    found = [_frequency(each) for each in solved]
    sizes = [each.run.case.spacing for each in solved]
    order = observed_order(sizes, [value - exact for value in found])
    _, whole, axis = _amplitudes(solved[-1])
    return [
        Check.within(
            "frequency", found[-1] / 1e3, exact / 1e3, _FREQUENCY_BOUND * exact / 1e3,
            "kHz", order,
        ),
        Check.at_most(
            "largest difference of the amplitude near the axis",
            float(np.abs(axis - whole).max()), _ROUND_BOUND,
        ),
    ]  # fmt: skip


def _draw(solved: Sequence[Solved], out: Out) -> None:
    whole, axis = {}, {}
    for each in solved:
        times, all_of_it, near = _amplitudes(each)
        whole[each.label] = (times / _PERIOD, all_of_it)
        axis[each.label] = (times / _PERIOD, near)
    line = np.linspace(0.0, _PERIODS, 200)
    exact = (line, np.cos(2.0 * np.pi * line))
    panels = [
        Panel("periods", "amplitude of the mode", whole, exact, title="whole sphere"),
        Panel("periods", "amplitude of the mode", axis, exact, title="near the axis"),
    ]
    draw_panels("Breathing elastic sphere", panels, out)


PROBLEM = Problem(
    "sphere",
    "Free vibration of an elastic sphere in its lowest radial mode",
    "Love, Mathematical Theory of Elasticity (1927), section 196",
    _setups,
    _check,
    _draw,
    "Share of the mode in the velocities, over that at the start.",
)
