"""An elastic bar that is stretched evenly, and springs back.

Its velocity is proportional to z at the start. The stress rises evenly in the middle
until the releases from the free ends meet there, and the bar then vibrates between
tension and pressure. Particles under tension tend to clump (the tensile instability):
their distances must stay those that the strain gives.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.case.discretise import discretise
from mpisph.figures.style import Out
from mpisph.verify.exact.elasticity import bar_stress
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order
from mpisph.verify.solids import (
    ALUMINIUM,
    lost_distance,
    solid_case,
    zero_crossings,
)

_RADIUS = 2e-3
_LENGTH = 16.0 * _RADIUS
_YIELD = 0.29e9
# That of 6061-T6.

_STRESS = 0.7 * _YIELD
# Largest stress.

_PASS = _LENGTH / ALUMINIUM.bar_speed
# A wave runs along the bar in this time; after half of it the middle bears the most.

_RATE = 2.0 * _STRESS / (ALUMINIUM.young * _PASS)
# Rate of strain at the start [1/s].

_MIDDLE = 0.05
# Particles no farther from it count as the middle, over the length.

_PASSES = 4.0
_OUTPUTS = 8
# In a pass.

_PASS_BOUND = 0.02
_STRESS_BOUND = 0.05
_CLUMPING_BOUND = 0.05
# Largest relative errors. The largest strain is 0.3 %.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(4, 1.25)] if quick else [_setup(4, _PASSES), _setup(8, _PASSES)]


def _setup(count: int, passes: float) -> Setup:
    times = np.arange(1, round(passes * _OUTPUTS) + 1) * _PASS / _OUTPUTS
    body = {
        "shape": "cylinder",
        "radius": _RADIUS,
        "length": _LENGTH,
        "position": -0.5 * _LENGTH,
    }
    data = solid_case(
        "stretched bar", body, _RADIUS / count, times.tolist(),
        yield_strength=_YIELD, viscosity=0.5,
    )  # fmt: skip
    case = case_from_dict(data)
    start = discretise(case).fields()
    start["u_z"] = _RATE * start["z"]
    return Setup(f"{count} a radius", case, start)


def _near(solved: Solved) -> Array:
    """Return which particles count as the middle."""
    near: Array = np.abs(solved.first["z"]) < _MIDDLE * _LENGTH
    return near


def _middle(solved: Solved) -> tuple[Array, Array]:
    """Return times [s] and the axial stress in the middle, positive in tension [Pa]."""
    near = _near(solved)
    shots = solved.run.snapshots
    stress = [
        np.average((at["S_zz"] - at["P"])[near], weights=at["m"][near]) for at in shots
    ]
    return np.array([at.time for at in shots]), np.array(stress)


def _exact(solved: Solved, times: Array) -> Array:
    """Return the exact mean stress of the same particles [Pa]."""
    first, near = solved.first, _near(solved)
    z, m = first["z"][near], first["m"][near]
    stresses = [bar_stress(ALUMINIUM, _RATE, _LENGTH, z, t) for t in times]
    return np.array([np.average(stress, weights=m) for stress in stresses])


def _check(solved: Sequence[Solved]) -> list[Check]:
    sizes = [each.run.case.spacing for each in solved]
    passes, peaks, exact = [], [], []
    for each in solved:
        exact.append(float(_exact(each, np.array([0.5 * _PASS]))[0]))
        times, stress = _middle(each)
        passes.append(zero_crossings(times[1:], stress[1:])[0])
        peaks.append(float(stress[times < passes[-1]].max()))
    times, closer = lost_distance(solved[-1])
    return [
        Check.within(
            "time of a pass", 1e6 * passes[-1], 1e6 * _PASS, 1e6 * _PASS_BOUND * _PASS,
            "µs", observed_order(sizes, [value - _PASS for value in passes]),
        ),
        Check.within(
            "largest tension in the middle", peaks[-1] / 1e6, exact[-1] / 1e6,
            _STRESS_BOUND * exact[-1] / 1e6, "MPa",
            observed_order(sizes, np.subtract(peaks, exact).tolist()),
        ),
        Check.at_most(
            f"closest particles: lost distance after {times[-1] / _PASS:g} passes",
            float(closer.max()), _CLUMPING_BOUND,
        ),
        Check.at_most(
            "largest plastic strain", solved[-1].last["plastic_strain"].max(), 0.0
        ),
    ]  # fmt: skip


def _draw(solved: Sequence[Solved], out: Out) -> None:
    stresses, distances, places = {}, {}, {}
    for each in solved:
        times, stress = _middle(each)
        stresses[each.label] = (times / _PASS, stress / 1e6)
        times, closer = lost_distance(each)
        distances[each.label] = (times / _PASS, 1.0 - closer)
        places[each.label] = (1e3 * each.last["z"], 1e3 * each.last["r"])
    line = np.linspace(0.0, times[-1], 400)
    panels = [
        Panel("passes of a wave", "stress [MPa]", stresses,
              (line / _PASS, _exact(solved[-1], line) / 1e6)),
        Panel("passes of a wave", "least distance over the first", distances, None),
        Panel("z [mm]", "r [mm]", places, None),
    ]  # fmt: skip
    draw_panels("Stretched elastic bar", panels, out)


PROBLEM = Problem(
    "tension",
    "An elastic bar under tension vibrates, and its particles do not clump",
    "d'Alembert's solution for a free bar (Timoshenko and Goodier, Theory of "
    "Elasticity, 1970, section 160), without lateral inertia",
    _setups,
    _check,
    _draw,
    "Axial stress in the middle, the least distance of two particles, and all "
    "particles at the end.",
)
