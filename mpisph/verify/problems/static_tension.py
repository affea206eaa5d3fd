"""A bar and a wall are held under tension between rigid planes.

They start in equilibrium, with random velocities of a few m/s, and nothing is to happen
but that these die away. SPH under tension is unstable: neighbours attract each other,
if nothing holds them apart. The scheme is the program's default. The lower stress is
one that 6061-T6 bears; the higher one is near the spall strength of aluminium.
"""

from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.case.discretise import discretise
from mpisph.figures.style import Out
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved
from mpisph.verify.solids import ALUMINIUM, lost_distance, solid_case

_RADIUS = 2e-3
# Half of the thickness of the wall.

_LENGTH = 3.0 * _RADIUS
_INNER = 4.0 * _RADIUS
# Of the wall, a wide tube.

_LOW, _HIGH = 0.2e9, 1e9
_YIELD = 1.5 * _HIGH

_SPEED = 5.0
# Largest random velocity at the start [m/s].

_END, _SHORT = 100e-6, 40e-6
_OUTPUTS = 20

_MEAN_BOUND = 0.01
_STRESS_BOUND = 0.05
_DISTANCE_BOUND = 0.02
# Largest relative errors.


def _setups(quick: bool) -> list[Setup]:
    if quick:
        return [_setup("bar", 4, _LOW, _SHORT)]
    return [
        _setup("bar", 4, _LOW, _END),
        _setup("bar", 8, _LOW, _END),
        _setup("wall", 4, _LOW, _END),
        _setup("bar", 8, _HIGH, _END),
    ]


def _setup(name: str, count: int, stress: float, end: float) -> Setup:
    bar = {"radius": _RADIUS}
    wall = {"radius": _INNER + 2.0 * _RADIUS, "inner_radius": _INNER}
    body = {
        "shape": "cylinder", "length": _LENGTH, "position": 0.0,
        **(bar if name == "bar" else wall),
    }  # fmt: skip
    data = solid_case(
        f"{name} held under tension", body, _RADIUS / count,
        np.linspace(end / _OUTPUTS, end, _OUTPUTS).tolist(),
        yield_strength=_YIELD,
    )  # fmt: skip
    data["boundary"] = {"z_min": 0.0, "z_max": _LENGTH}
    del data["resolution"]["nph"], data["scheme"]["viscosity"]
    case = case_from_dict(data)
    start = discretise(case).fields()
    n = start["r"].size
    looser = 1.0 - stress / (3.0 * ALUMINIUM.bulk_modulus)
    stored = stress**2 / (2.0 * ALUMINIUM.young * ALUMINIUM.density)
    start["m"] = start["m"] * looser
    start["rho"] = start["rho"] * looser
    start["E"] = np.full(n, stored)
    start["S_zz"] = np.full(n, 2.0 / 3.0 * stress)
    start["S_rr"] = np.full(n, -stress / 3.0)
    random = np.random.default_rng(1)
    for component in ("u_r", "u_z"):
        start[component] = random.uniform(-_SPEED, _SPEED, n)
    label = f"{name}, {count} a radius, {stress / 1e9:g} GPa"
    return Setup(label.replace("wall, 4 a radius", "wall, 8 across"), case, start)


def _stresses(solved: Solved) -> tuple[Array, list[Array]]:
    """Return times [s] and the axial stress of each particle over the first one."""
    shots = solved.run.snapshots
    first = (shots[0]["S_zz"] - shots[0]["P"])[0]
    times = np.array([at.time for at in shots])
    return times, [(at["S_zz"] - at["P"]) / first for at in shots]


def _mean(solved: Solved) -> Array:
    """Return the mean axial stress over time, over the first one."""
    m = solved.first["m"]
    return np.array([np.average(each, weights=m) for each in _stresses(solved)[1]])


def _check(solved: Sequence[Solved]) -> list[Check]:
    checks = []
    for each in solved:
        means = _mean(each)
        last = _stresses(each)[1][-1]
        checks += [
            Check.within(
                f"{each.label}: mean stress over the first, farthest off",
                means[np.abs(means - 1.0).argmax()], 1.0, _MEAN_BOUND,
            ),
            Check.within(
                f"{each.label}: stress at the end, where it is farthest off",
                last[np.abs(last - 1.0).argmax()], 1.0, _STRESS_BOUND,
            ),
            Check.at_most(
                f"{each.label}: closest particles, lost distance",
                lost_distance(each)[1].max(), _DISTANCE_BOUND,
            ),
            Check.at_most(
                f"{each.label}: largest plastic strain",
                each.last["plastic_strain"].max(), 0.0,
            ),
        ]  # fmt: skip
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    spreads, distances, places = {}, {}, {}
    for each in solved:
        times, stresses = _stresses(each)
        ends = [(stress.min(), stress.max()) for stress in stresses]
        spreads[each.label] = (1e6 * np.repeat(times, 2), np.ravel(ends))
        times, closer = lost_distance(each)
        distances[each.label] = (1e6 * times, 1.0 - closer)
        places[each.label] = (1e3 * each.last["z"], 1e3 * each.last["r"])
    end = 1e6 * solved[0].last.time
    panels = [
        Panel("t [µs]", "stress over the first", spreads,
              ((0.0, end), (1.0, 1.0))),
        Panel("t [µs]", "least distance over the first", distances, None),
        Panel("z [mm]", "r [mm]", places, None),
    ]  # fmt: skip
    draw_panels("Held under tension", panels, out)


PROBLEM = Problem(
    "static-tension",
    "A bar and a wall bear tension for 100 µs, and their particles do not clump",
    "equilibrium under a uniform axial stress",
    _setups,
    _check,
    _draw,
    "Least and greatest axial stress of all particles, the least distance of two, and "
    "all particles at the end.",
)
