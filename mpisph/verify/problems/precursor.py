"""A slow impact: the elastic precursor runs ahead of the plastic wave.

The precursor has the longitudinal speed and leaves the stress of the Hugoniot elastic
limit behind; the plastic wave follows at nearly the bulk sound speed. Viscosity spreads
both waves over some layers, and they part by only a sixth of their way.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mpisph.case import Case
from mpisph.figures.style import Out
from mpisph.verify.exact.shocks import Shocked, matter_of, plane_waves
from mpisph.verify.layers import Layers, layers_of, plates
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Check, Problem, Setup, Solved, observed_order
from mpisph.verify.profiles import outermost_crossing

_MATERIAL = "al-6061-t6"
_VELOCITY = 150.0
_SPACING = 0.1e-3

_WAY = 0.85
# Part of the plates that the precursor passes.

_SPEED_BOUND = 0.02
_STRESS_BOUND = 0.05
# Largest relative errors; limits are read from experiments no more precisely.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(count) for count in ((80,) if quick else (80, 160))]


def _setup(count: int) -> Setup:
    def case(end: float) -> Case:
        return plates(
            _MATERIAL, _MATERIAL, _VELOCITY, count, _SPACING, count * _SPACING, end,
            viscosity={"alpha": 0.5, "beta": 0.5},
        )  # fmt: skip

    end = _WAY * count * _SPACING / _exact(case(1e-6))[0].speed
    return Setup(f"{count} layers", case(end))


def _exact(case: Case) -> tuple[Shocked, Shocked]:
    """Return the states behind the precursor and behind the plastic wave."""
    flyer = case.bodies[0]
    limit, plastic = plane_waves(
        matter_of(case.body_models(flyer)), 0.5 * flyer.velocity
    )
    return limit, plastic


def _layers(solved: Solved, index: int) -> Layers:
    """Return the target's layers, as far out as no wave from the rims has come."""
    case = solved.run.case
    reach = _exact(case)[0].speed * solved.run.snapshots[-1].time
    rim = float(solved.first["r"].max())
    kernel = case.scheme.kappa * case.resolution.nph * case.spacing
    return layers_of(solved.run, "target", index, rim - reach + kernel)


class Measured(NamedTuple):
    """What a run gives, in SI units.

    Attributes
    ----------
    precursor, plastic : float
        Speeds, where the velocity is half way through the wave.
    limit : float
        Stress between both waves where it changes least, as it is read from the
        records of experiments.
    stress : float
        Stress behind the plastic wave.
    """

    precursor: float
    plastic: float
    limit: float
    stress: float


def _measure(solved: Solved) -> Measured:
    limit, plastic = _exact(solved.run.case)
    both = [_layers(solved, index) for index in (1, 2)]
    times = [solved.run.snapshots[index].time for index in (1, 2)]
    levels = 0.5 * limit.velocity, 0.5 * (limit.velocity + plastic.velocity)
    speeds = []
    for level in levels:
        first, second = (
            outermost_crossing(at.mean("z"), at.mean("u_z"), level) for at in both
        )
        speeds.append((second - first) / (times[1] - times[0]))
    end, spacing = both[1], solved.run.case.spacing
    # Layers are counted in the matter at rest.
    slow, fast = (round(wave.speed * times[1] / spacing) for wave in (plastic, limit))
    stress = end.mean("stress")
    flattest = slow + int(np.argmin(np.abs(np.diff(stress[slow:fast]))))
    behind = slice(int(0.3 * slow), int(0.7 * slow))
    level = float(0.5 * (stress[flattest] + stress[flattest + 1]))
    return Measured(speeds[0], speeds[1], level, float(stress[behind].mean()))


def _check(solved: Sequence[Solved]) -> list[Check]:
    found = [_measure(each) for each in solved]
    sizes = [1.0 / _layers(each, 0).start.size for each in solved]
    limit, plastic = _exact(solved[-1].run.case)

    def line(quantity: str, field: str, exact: float, unit: str) -> Check:
        scale = {"m/s": 1.0, "GPa": 1e9}[unit]
        bound = {"m/s": _SPEED_BOUND, "GPa": _STRESS_BOUND}[unit]
        values = [getattr(each, field) for each in found]
        return Check.within(
            quantity, values[-1] / scale, exact / scale, bound * exact / scale, unit,
            observed_order(sizes, [value - exact for value in values]),
        )  # fmt: skip

    return [
        line("speed of the precursor", "precursor", limit.speed, "m/s"),
        line("speed of the plastic wave", "plastic", plastic.speed, "m/s"),
        line("stress between the waves (elastic limit)", "limit", limit.stress, "GPa"),
        line("stress behind the plastic wave", "stress", plastic.stress, "GPa"),
    ]


def _draw(solved: Sequence[Solved], out: Out) -> None:
    case = solved[-1].run.case
    limit, plastic = _exact(case)
    ways = np.array([0.0, plastic.speed, plastic.speed, limit.speed, limit.speed, 1e4])
    ways /= limit.speed
    panels = []
    for name, label, unit in (
        ("stress", "stress [GPa]", 1e9),
        ("u_z", "velocity [m/s]", 1.0),
    ):
        field = {"u_z": "velocity"}.get(name, name)
        levels = [getattr(state, field) for state in (plastic, limit)]
        steps = np.repeat([*levels, 0.0], 2) / unit
        dots = {}
        for each in solved:
            layers = _layers(each, 2)
            way = layers.start / (limit.speed * each.run.snapshots[-1].time)
            dots[each.label] = (way, layers.mean(name) / unit)
        line = (ways, steps)
        panels.append(
            Panel("layer over way of the precursor", label, dots, line, (0, 1.15))
        )
    draw_panels(f"Impact of aluminium plates at {_VELOCITY:g} m/s", panels, out)


PROBLEM = Problem(
    "precursor",
    "Elastic precursor and plastic wave in aluminium",
    "Rankine-Hugoniot conditions of an elastic, perfectly plastic solid with the "
    "equation of state as programmed: limit close to Y (K + 4 G/3)/(2 G), precursor at "
    "sqrt((K + 4 G/3)/rho) (Davison, Fundamentals of Shock Wave Propagation in Solids, "
    "2008)",
    _setups,
    _check,
    _draw,
    "Means of layers of particles against the place of the layer at the start over the "
    "way that the precursor has passed.",
)
