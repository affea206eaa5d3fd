"""A cold ball that expands uniformly: density, smoothing length, and its energy."""

from collections.abc import Sequence

import numpy as np

from mpisph.case import case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import (
    Array,
    Check,
    Problem,
    Setup,
    Solved,
    observed_order,
)

RATE = 1.0
# H of u = H x [1/s]; the ball has a radius of 1 m.

END = 1.0
# By then all lengths have doubled [s].

SOON = 1e-3
# After which the first rates are taken [s].

INSIDE = 0.55
# Share of the radius within which no kernel reaches the surface at the start.


def _setups(quick: bool) -> list[Setup]:
    return [_setup(n) for n in ((12, 24) if quick else (20, 40))]


def _setup(n: int) -> Setup:
    matter = {
        "rho0": 1000.0,
        "eos": "linear",
        "strength": "none",
        "linear": {"bulk_modulus": 1.0},
    }
    ball = {"name": "ball", "shape": "sphere", "radius": 1.0, "material": "dust"}
    case = case_from_dict(
        {
            "title": f"uniform expansion, dx = 1/{n}",
            "bodies": [{**ball, "radial_velocity": f"{RATE} * s"}],
            "materials": {"dust": matter},
            "resolution": {"npr": n, "nph": 1.5},
            # Matter without tension: nothing holds it back.
            "scheme": {"heat": {"enabled": False}, "p_min": {"value": 0.0}},
            "output": {"times": [SOON, END], "figures": False},
        }
    )
    return Setup(f"1/{n}", case)


def _inside(solved: Solved) -> Array:
    """Return which particles see no surface, by where they were at the start."""
    start = solved.first
    inside: Array = np.hypot(start["r"], start["z"]) < INSIDE
    return inside


def _divergence(solved: Solved) -> Array:
    """Return the rate at which the density falls at the start, over H."""
    start, soon = solved.run.snapshots[:2]
    rate: Array = -np.log(soon["rho"] / start["rho"]) / (RATE * SOON)
    return rate


def _errors(solved: Solved) -> list[float]:
    """Return the largest relative errors of density and smoothing length."""
    start, last = solved.first, solved.last
    inside, factor = _inside(solved), 1.0 + RATE * END
    rho = last["rho"] / start["rho"] * factor**3
    h = last["h"] / start["h"] / factor
    return [float(np.abs(x[inside] - 1.0).max()) for x in (rho, h)]


def _check(solved: Sequence[Solved]) -> list[Check]:
    finest = solved[-1]
    first_ring = _inside(finest) & (finest.first["r"] < finest.run.case.spacing)
    expected = np.log1p(RATE * SOON) / (RATE * SOON) * 3.0
    div = _divergence(finest) * 3.0 / expected
    errors = np.array([_errors(each) for each in solved])
    spacings = [each.run.case.spacing for each in solved]
    last = finest.last
    kinetic = 0.5 * (last["m"] * (last["u_r"] ** 2 + last["u_z"] ** 2)).sum()
    heat = np.abs(last["m"] * last["E"]).sum() / kinetic
    others = div[_inside(finest) & ~first_ring]
    worst = others[np.abs(others - 3.0).argmax()]
    orders = [observed_order(spacings, column) for column in errors.T]
    return [
        Check.within(
            "div u / H on the innermost rings", div[first_ring].mean(), 3.0, 0.01
        ),
        Check.within("div u / H, worst of the other rings", worst, 3.0, 0.01),
        Check.at_most(
            "density, largest relative error", errors[-1, 0], 0.01, order=orders[0]
        ),
        Check.at_most(
            "smoothing length, largest relative error",
            errors[-1, 1],
            0.01,
            order=orders[1],
        ),
        Check.at_most("internal over kinetic energy", heat, 1e-9),
    ]


def _draw(solved: Sequence[Solved], out: Out) -> None:
    div, rho = {}, {}
    for each in solved:
        inside = _inside(each)
        radius = each.first["r"][inside]
        div[each.label] = radius, _divergence(each)[inside]
        rho[each.label] = radius, (each.last["rho"] / 1000.0)[inside]
    line = np.array([0.0, INSIDE])
    exact = (1.0 + RATE * END) ** -3
    draw_panels(
        PROBLEM.title,
        [
            Panel(
                "first radius, m", "div u / H at the start", div, (line, 0 * line + 3.0)
            ),
            Panel(
                "first radius, m",
                "density over the first",
                rho,
                (line, 0 * line + exact),
            ),
        ],
        out,
    )


PROBLEM = Problem(
    name="uniform-expansion",
    title="Uniform expansion of a cold ball",
    source="u = H x stays so: div u = 3 H, rho (1 + H t)^3 and h / (1 + H t) constant",
    setups=_setups,
    check=_check,
    draw=_draw,
    caption="Particles that see no surface, by the radius at which they started.",
)
