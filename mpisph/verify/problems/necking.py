"""A bar that hardens is pulled apart: it necks, and breaks in the neck.

Heavy grips fly apart, and the bar between them starts with the velocity that stretches
it evenly, so that inertia is small. It is a little thinner in the middle, where the
load has its maximum at the strain of Considère. Beyond it the middle alone goes on,
until Johnson and Cook's strain to fracture is used up. Without artificial stress rows
of particles pair in the neck from a strain of 0.35 on, and part before it breaks.
"""

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.case.discretise import discretise
from mpisph.diagnostics.condition import BROKEN
from mpisph.figures.style import Out
from mpisph.verify.exact.elasticity import Elastic
from mpisph.verify.exact.necking import (
    Hardening,
    fracture_strain,
    nominal_stress,
    onset_of_neck,
)
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved
from mpisph.verify.solids import ALUMINIUM, material_of

_RADIUS = 2e-3
# Of the middle.

_HALF = 4.0 * _RADIUS
_GRIP = _RADIUS
_WIDER = 0.1
# The radius grows by that share to the ends, as the square of the distance.

_LAW = Hardening(200e6, 400e6, 0.5)
_FRACTURE = {"D1": 0.1, "D2": 0.6, "D3": -1.2, "D4": 0.0, "D5": 0.0}
_NEVER = 1e5
# Melting temperature [K]: nothing softens by heat.

_GRIP_DENSITY = 9e5
_RATE = 1e4
# Of strain, at the start [1/s].

_END = 36e-6
_OUTPUTS = 72
_FROM = 0.05
# Strain from which the load is compared; waves of the start have run out.

_COUNTS = (4, 8)
# Particles along the radius.

_LOAD_BOUND = 0.02
_STRAIN_BOUND = 0.05
_PLACE_BOUND = 0.5
# Largest relative errors; of the place in radii.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(count) for count in (_COUNTS[:1] if quick else _COUNTS)]


def _setup(count: int) -> Setup:
    never = {"melting_temperature": _NEVER}
    bar = material_of(ALUMINIUM) | {
        "strength": "johnson-cook",
        "johnson-cook": {
            "shear_modulus": ALUMINIUM.shear_modulus,
            "A": _LAW.A, "B": _LAW.B, "n": _LAW.n, "C": 0.0, "m": 1.0, **never,
        },
        "thermal": "heat-capacity",
        "heat-capacity": {"heat_capacity": 900.0, **never},
        "ductile": "johnson-cook-damage",
        "johnson-cook-damage": {**_FRACTURE, **never},
    }  # fmt: skip
    heavy = Elastic(_GRIP_DENSITY, ALUMINIUM.bulk_modulus, ALUMINIUM.shear_modulus)
    parts = (
        ("lower", -_HALF - _GRIP, _GRIP, "grip"),
        ("bar", -_HALF, 2.0 * _HALF, "bar"),
        ("upper", _HALF, _GRIP, "grip"),
    )
    case = case_from_dict(
        {
            "title": "necking bar",
            "bodies": [
                {
                    "name": name, "shape": "cylinder", "radius": _RADIUS,
                    "position": z, "length": length, "material": material,
                    "velocity": 0.0,
                }
                for name, z, length, material in parts
            ],
            "materials": {"bar": bar, "grip": material_of(heavy)},
            "resolution": {"spacing": _RADIUS / count},
            "scheme": {
                "viscosity": {"alpha": 0.5, "beta": 0.5},
                "heat": {"enabled": False},
            },
            "time": {"end": _END},
            "output": {"every": _END / _OUTPUTS, "figures": False},
        }
    )  # fmt: skip
    start = discretise(case).fields()
    z = start["z"]
    start["u_z"] = _RATE * np.clip(z, -_HALF, _HALF)
    start["u_r"] = np.where(np.abs(z) < _HALF, -0.5 * _RATE * start["r"], 0.0)
    start["r"] = start["r"] * _widening(z)
    start["m"] = start["m"] * _widening(z) ** 2
    return Setup(f"{count} a radius", case, start)


def _widening(z: Array) -> Array:
    """Return the first radius over that of the middle."""
    wider: Array = 1.0 + _WIDER * np.minimum(np.abs(z) / _HALF, 1.0) ** 2
    return wider


class _Middle:
    """Load and strain of the middle over time.

    Attributes
    ----------
    strain : ndarray
        Plastic strain.
    load : ndarray
        Over the first area of the middle [Pa].
    """

    def __init__(self, solved: Solved) -> None:
        first = solved.first
        near = np.abs(first["z"]) < 0.25 * _RADIUS
        z, m = first["z"][near], first["m"][near]
        strains, loads = [], []
        for at in solved.run.snapshots:
            stretch = float((at["z"][near] * z).sum() / (z * z).sum())
            axial = (at["S_zz"] - at["P"])[near] / at["rho"][near]
            strains.append(np.average(at["plastic_strain"][near], weights=m))
            volume = float((m / first["rho"][near]).sum())
            loads.append(float((axial * m).sum()) / volume / stretch)
        self.strain = np.array(strains)
        self.load = np.array(loads)

    def greatest(self) -> tuple[float, float]:
        """Return strain and load at its maximum, by a parabola about the largest."""
        k = int(self.load.argmax())
        near = np.abs(self.strain - self.strain[k]) < 0.2 * self.strain[k]
        near &= np.arange(near.size) <= 2 * k
        a, b, c = np.polyfit(self.strain[near], self.load[near], 2)
        at = -0.5 * b / a
        return float(at), float(c + 0.5 * b * at)

    def error(self) -> float:
        """Return the mean relative error of the load up to the onset of the neck."""
        onset = onset_of_neck(_LAW)
        within = (self.strain > _FROM) & (self.strain < onset)
        exact = np.array([nominal_stress(_LAW, x) for x in self.strain[within]])
        return float(np.abs(self.load[within] / exact - 1.0).mean())


def _sound(solved: Solved) -> Array:
    """Return the heights of what is not broken at the end, sorted [m]."""
    last = solved.last
    heights: Array = np.sort(last["z"][last["damage"] < BROKEN])
    return heights


def _broken_strain(solved: Solved) -> float:
    """Return the mean plastic strain of broken matter; NaN if nothing is."""
    last = solved.last
    broken = last["damage"] == BROKEN
    m, strain = last["m"][broken], last["plastic_strain"][broken]
    return float((m * strain).sum() / m.sum()) if broken.any() else math.nan


def _check(solved: Sequence[Solved]) -> list[Check]:
    last = solved[-1]
    middle = _Middle(last)
    strain, load = middle.greatest()
    exact = onset_of_neck(_LAW)
    greatest = nominal_stress(_LAW, exact) / 1e6
    fracture = fracture_strain(*(_FRACTURE[name] for name in ("D1", "D2", "D3")))
    heights = _sound(last)
    gaps = np.diff(heights)
    widest = int(gaps.argmax())
    place = 0.5 * (heights[widest] + heights[widest + 1]) / _RADIUS
    coarser = last.run.case.spacing * _COUNTS[-1] / _RADIUS
    pieces = 1 + int((gaps > 0.5 * _RADIUS).sum())
    return [
        Check.at_most(
            "load up to its maximum, mean error", middle.error(),
            _LOAD_BOUND * coarser,
        ),
        Check.within(
            "greatest load over the first area", load / 1e6, greatest,
            _LOAD_BOUND * greatest, "MPa",
        ),
        Check.within(
            "strain at the greatest load", strain, exact, _STRAIN_BOUND * exact
        ),
        Check.within(
            "strain of what is broken", _broken_strain(last), fracture,
            _STRAIN_BOUND * coarser * fracture,
        ),
        Check.within("pieces", pieces, 2.0, 0.0),
        Check.at_most(
            "place of the break from the middle, in radii", abs(place), _PLACE_BOUND
        ),
    ]  # fmt: skip


def _draw(solved: Sequence[Solved], out: Out) -> None:
    loads, strains = {}, {}
    for each in solved:
        middle = _Middle(each)
        loads[each.label] = (middle.strain, middle.load / 1e6)
        at = each.run.snapshots[int(middle.load.argmax())]
        strains[each.label] = (1e3 * each.first["z"], at["plastic_strain"])
    last = solved[-1].last
    broken = last["damage"] == BROKEN
    places = {
        solved[-1].label: (1e3 * last["z"][~broken], 1e3 * last["r"][~broken]),
        "broken": (1e3 * last["z"][broken], 1e3 * last["r"][broken]),
    }
    line = np.linspace(0.0, 0.5, 200)
    panels = [
        Panel("plastic strain of the middle", "load over the first area [MPa]", loads,
              (line, [nominal_stress(_LAW, x) / 1e6 for x in line])),
        Panel("first z [mm]", "plastic strain at the greatest load", strains, None),
        Panel("z [mm]", "r [mm]", places, None),
    ]  # fmt: skip
    draw_panels("Necking bar", panels, out)


PROBLEM = Problem(
    "necking",
    "A bar in tension hardens, necks and breaks in two",
    "Considère (1885): the neck begins where the slope of the stress is the stress; "
    "Johnson and Cook, Eng. Fract. Mech. 21 (1985) 31: strain to fracture",
    _setups,
    _check,
    _draw,
    "Load on the middle, strain along the bar at its maximum, and the broken bar; the "
    "line is without inertia, and without the pressure that the neck adds.",
)
