"""An impact seen from a moving frame: the same cloud."""

from collections.abc import Sequence

import numpy as np

from mpisph.figures.style import Out
from mpisph.verify.impact import impact_case
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved

FRAME = -2500.0
# [m/s]

BOUND = 1e-6
# Of what may differ by rounding, over the spacing, velocity and energy of the impact.


def _setups(quick: bool) -> list[Setup]:
    npr = 6 if quick else 12
    title = "Galilean shift"
    return [
        Setup("plate at rest", impact_case(f"{title}, plate at rest", npr)),
        Setup("moving frame", impact_case(f"{title}, moving frame", npr, FRAME)),
    ]


def _seen_at_rest(solved: Sequence[Solved]) -> list[dict[str, Array]]:
    """Return both ends as they are seen from the plate, particle by particle."""
    ends = []
    for each, frame in zip(solved, (0.0, FRAME), strict=True):
        last = dict(each.last.arrays)
        last["z"] = last["z"] - frame * each.run.case.end_time
        last["u_z"] = last["u_z"] - frame
        ends.append(last)
    return ends


def _check(solved: Sequence[Solved]) -> list[Check]:
    rest, moving = _seen_at_rest(solved)
    case = solved[0].run.case
    u = case.impact_velocity
    scales = {
        "r": case.spacing,
        "z": case.spacing,
        "u_r": u,
        "u_z": u,
        "E": u**2,
        "rho": rest["rho"],
        "h": case.smoothing_length,
    }
    steps = [each.run.result.step for each in solved if each.run.result is not None]
    checks = [
        Check.at_most(
            f"largest difference of {name}",
            np.abs((moving[name] - rest[name]) / scale).max(),
            BOUND,
        )
        for name, scale in scales.items()
    ]
    return [*checks, Check.within("steps", steps[1], steps[0], 0.0)]


def _draw(solved: Sequence[Solved], out: Out) -> None:
    ends = _seen_at_rest(solved)
    names = [each.label for each in solved]
    dots = {
        name: (1e3 * end["z"], 1e3 * end["r"])
        for name, end in zip(names, ends, strict=True)
    }
    panel = Panel("z, mm", "r, mm", dots, None)
    draw_panels(f"{PROBLEM.title}, as seen from the plate", [panel], out)


PROBLEM = Problem(
    name="galilean-shift",
    title="An impact seen from a moving frame",
    source="Galilean invariance",
    setups=_setups,
    check=_check,
    draw=_draw,
    caption="Both clouds as seen from the plate: those of the second cover the first.",
)
