"""Cold matter in free flight: a ring that flies outwards, a rod that expands.

The ring's section keeps its shape and is stretched round the axis. The rod's is
stretched along r and round the axis; the smoothing length follows the section's area.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.exact.riemann import GasState
from mpisph.verify.gas import KM_S, GasBody, gas_setup
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved

END = 1.0
# [ms]; by then the radii of the rod have doubled.

ALONG = 1.0
# Axial velocity of all [km/s].

WITHIN = 0.01
# Of density and smoothing length, relative.

RING: dict[str, Any] = {
    "shape": "cylinder",
    "radius": 1.75,
    "inner_radius": 0.75,
    "position": 0.0,
    "length": 1.0,
    "radial_velocity": KM_S,
}
ROD: dict[str, Any] = {
    "shape": "cylinder",
    "radius": 1.0,
    "position": 0.0,
    "length": 1.5,
    "radial_velocity": f"{KM_S:g} * r",
}


def _setups(quick: bool) -> list[Setup]:
    n = 16 if quick else 32
    return [_setup("ring", RING, n), _setup("rod", ROD, n)]


def _setup(label: str, shape: dict[str, Any], n: int) -> Setup:
    gas = GasBody(shape, GasState(1.0, ALONG, 0.0))
    title = f"free flight of a {label}, dx = 1/{n}"
    return gas_setup(label, title, [gas], 1.0 / n, [END], 1.4)


def _stretch(solved: Solved) -> tuple[Array, Array, Array]:
    """Return density and h over their exact values, inside, and the first radius."""
    case, first, last = solved.run.case, solved.first, solved.last
    r, z = first["r"], first["z"]
    reach = case.scheme.kappa * case.smoothing_length + case.spacing
    body = ROD if solved.label == "rod" else RING
    inside = (r < body["radius"] - reach) & (z > reach) & (z < body["length"] - reach)
    if solved.label == "rod":
        rho, h = np.full_like(r, (1.0 + END) ** -2), (1.0 + END) ** 0.5
    else:
        inside &= r > body["inner_radius"] + reach
        rho, h = r / (r + END), 1.0
    return (
        (last["rho"] / first["rho"] / rho)[inside],
        (last["h"] / first["h"] / h)[inside],
        r[inside],
    )


def _check(solved: Sequence[Solved]) -> list[Check]:
    checks = []
    for each in solved:
        name, result = each.label, each.run.result
        assert result is not None, "the run is completed"
        errors = result.conservation
        rho, h, _ = _stretch(each)
        for quantity, ratio in (("density", rho), ("smoothing length", h)):
            worst = ratio[np.abs(ratio - 1.0).argmax()]
            text = f"{name}: {quantity} over the exact, worst"
            checks.append(Check.within(text, worst, 1.0, WITHIN))
        checks += [
            Check.at_most(f"{name}: energy error", errors.energy_error_max, 1e-12),
            Check.at_most(
                f"{name}: error of the axial momentum",
                abs(errors.momentum_z_error or 0.0),
                1e-13,
            ),
        ]
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    rho, h = {}, {}
    for each in solved:
        density, length, r = _stretch(each)
        rho[each.label], h[each.label] = (r, density), (r, length)
    line = np.array([0.0, 1.75])
    axis = "first radius, m"
    panels = [
        Panel(axis, "density over the exact", rho, (line, 0.0 * line + 1.0)),
        Panel(axis, "h over the exact", h, (line, 0.0 * line + 1.0)),
    ]
    draw_panels(PROBLEM.title, panels, out)


PROBLEM = Problem(
    name="free-flight",
    title="Free flight of cold matter",
    source="density times r (ring) or r^2 (rod) constant; h^2 as the section's area",
    setups=_setups,
    check=_check,
    draw=_draw,
    caption="Particles that see no surface, at the end, by the radius at the start.",
)
