"""An elastic torus breathes while it flies along the axis, and while it stands.

Its hoops stretch and shorten as a whole. Translation is no strain: the torus that
flies must do the same as the one that stands, to rounding.
"""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.elasticity import ring_frequency
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order
from mpisph.verify.solids import (
    ALUMINIUM,
    ring_body,
    round_section,
    solid_case,
    zero_crossings,
)

_SECTION = 0.01
_RING = 10.0 * _SECTION
# Radii of the section and of its centre line [m].

_OUTWARD = 10.0
# Velocity at the start [m/s].

_FLIGHT = 5000.0
# Along the axis [m/s].

_PERIOD = 2.0 * math.pi / ring_frequency(ALUMINIUM, _RING)
_PERIODS = 1.25
_OUTPUTS = 20
# In a period.

_FREQUENCY_BOUND = 0.02
_SHIFT_BOUND = 1e-6
# Relative.


def _setups(quick: bool) -> list[Setup]:
    counts = (4,) if quick else (8, 16)
    return [_setup(counts[0], 0.0), *(_setup(count, _FLIGHT) for count in counts)]


def _setup(count: int, flight: float) -> Setup:
    spacing = _SECTION / count
    times = np.arange(1, round(_PERIODS * _OUTPUTS) + 1) * _PERIOD / _OUTPUTS
    body = ring_body(_RING, _SECTION)
    data = solid_case("torus", body, spacing, times.tolist(), viscosity=0.1)
    start = round_section(_RING, _SECTION, spacing)
    start["u_r"] += _OUTWARD
    start["u_z"] += flight
    how = "in flight" if flight else "at rest"
    return Setup(f"{how}, {count} a radius", case_from_dict(data), start)


def _radial(solved: Solved) -> tuple[Array, Array]:
    """Return times [s] and the mean radial velocity over that at the start."""
    shots = solved.run.snapshots
    means = [np.average(at["u_r"], weights=at["m"]) for at in shots]
    return np.array([at.time for at in shots]), np.array(means) / _OUTWARD


def _frequency(solved: Solved) -> float:
    """Return the frequency from the first and third quarter [Hz]."""
    zeros = zero_crossings(*_radial(solved))
    return 0.5 / (zeros[1] - zeros[0]) if len(zeros) > 1 else math.nan


def _shift(still: Solved, flying: Solved) -> float:
    """Return the largest difference of the stresses over the largest stress."""
    names = ("P", "S_rr", "S_zz", "S_rz")
    largest = max(float(np.abs(still.last[name]).max()) for name in names)
    worst = max(
        float(np.abs(still.last[name] - flying.last[name]).max()) for name in names
    )
    return worst / largest


def _check(solved: Sequence[Solved]) -> list[Check]:
    still, *flying = solved
    exact = 1.0 / _PERIOD
    found = [_frequency(each) for each in flying]
    sizes = [each.run.case.spacing for each in flying]
    order = observed_order(sizes, [value - exact for value in found])
    return [
        Check.within(
            "frequency in flight", found[-1] / 1e3, exact / 1e3,
            _FREQUENCY_BOUND * exact / 1e3, "kHz", order,
        ),
        Check.at_most(
            "largest difference that flight makes, over the largest stress",
            _shift(still, flying[0]), _SHIFT_BOUND,
        ),
    ]  # fmt: skip


def _draw(solved: Sequence[Solved], out: Out) -> None:
    dots = {}
    for each in solved:
        times, velocity = _radial(each)
        dots[each.label] = (times / _PERIOD, velocity)
    line = np.linspace(0.0, _PERIODS, 200)
    exact = (line, np.cos(2.0 * np.pi * line))
    panel = Panel("periods", "mean radial velocity over the first", dots, exact)
    draw_panels("Breathing torus", [panel], out)


PROBLEM = Problem(
    "torus",
    "An elastic torus breathes, in flight as at rest",
    "Love, Mathematical Theory of Elasticity (1927), section 293: sqrt(E/rho)/R",
    _setups,
    _check,
    _draw,
    "Mean radial velocity of the torus.",
)
