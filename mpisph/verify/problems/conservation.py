"""What an impact conserves: mass, axial momentum, energy."""

from collections.abc import Sequence

from mpisph.figures.style import Out
from mpisph.verify.impact import impact_case
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Check, Problem, Setup, Solved


def _setups(quick: bool) -> list[Setup]:
    return [_setup(npr) for npr in ((6,) if quick else (6, 12))]


def _setup(npr: int) -> Setup:
    return Setup(f"NPR {npr}", impact_case(f"conservation, NPR {npr}", npr))


def _check(solved: Sequence[Solved]) -> list[Check]:
    checks = []
    for each in solved:
        result = each.run.result
        assert result is not None, "the run is completed"
        errors = result.conservation
        checks += [
            Check.at_most(
                f"{each.label}: energy error", errors.energy_error_max, 1e-12
            ),
            Check.at_most(
                f"{each.label}: error of the axial momentum",
                abs(errors.momentum_z_error or 0.0),
                1e-13,
            ),
            Check.at_most(
                f"{each.label}: error of the mass", abs(errors.mass_error), 0.0
            ),
        ]
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    energy, heat = {}, {}
    for each in solved:
        history = each.run.history
        t = 1e6 * history["time"]
        total = history["kinetic_energy"] + history["internal_energy"]
        energy[each.label] = t, total / total[0] - 1.0
        heat[each.label] = t, history["internal_energy"] / total[0]
    line = [0.0, t.max()]
    panels = [
        Panel("t, µs", "change of the energy over its first", energy, (line, [0, 0])),
        Panel("t, µs", "internal energy over the first energy", heat, None),
    ]
    draw_panels(PROBLEM.title, panels, out)


PROBLEM = Problem(
    name="conservation",
    title="Mass, momentum and energy of an impact",
    source="conservation laws",
    setups=_setups,
    check=_check,
    draw=_draw,
    caption="Energy of an aluminium sphere on a plate at 6.7 km/s.",
)
