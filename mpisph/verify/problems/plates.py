"""Equal plates hit each other: the state behind the shock.

Both equations of state of a card are looked at, and porous plates of two thirds of the
density (P-alpha), whose pores the shock crushes: behind it they are solid and hot.

By symmetry the matter behind the shock has half of the velocity of the impact. All
else follows from the jump conditions and the equation of state. The plates are fluid,
so that the speed of the shock is also that of the material's line ``c0 + s u``.

While the shock forms, artificial viscosity is wider than the shock has come, and heats
too much (wall heating). So the energy is measured twice: next to the shock, and nearer
to the contact.
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from mpisph.case import Case
from mpisph.figures.style import Out
from mpisph.physics.eos.mie_grueneisen import MieGrueneisen
from mpisph.verify.exact.shocks import Shocked, matter_of, plane_waves, sound_speed
from mpisph.verify.layers import Layers, layers_of, plates
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order
from mpisph.verify.profiles import outermost_crossing

_MATERIAL = "al-6061-t6"
_SPACING = 0.1e-3
_SPEEDS = (900.0, 3000.0, 7000.0)
_LAYERS = (40, 80)

_PORES = {
    "initial_distension": 1.5,
    "elastic_pressure": 0.0,  # no precursor runs ahead of the shock
    "solid_pressure": 0.2e9,
}
_POROUS = "porous"
_POROUS_SPEED = 3000.0

_WALL = 4
# Layers at the contact that are left out of all means.

_WAY = 0.8
# Part of the plates that the shock passes.

_WIDTH = 1.4
# Radius of the plates over their thickness.

_BOUND = 0.02
# Largest relative error.


def _setups(quick: bool) -> list[Setup]:
    """Return the runs: all velocities and equations of state, or one."""
    if quick:
        return [_setup("mie-grueneisen", 3000.0, 40)]
    whole = [
        (eos, velocity)
        for eos in ("mie-grueneisen", "tillotson")
        for velocity in _SPEEDS
    ]
    impacts = [*whole, (_POROUS, _POROUS_SPEED)]
    return [_setup(*impact, count) for impact in impacts for count in _LAYERS]


def _setup(kind: str, velocity: float, count: int) -> Setup:
    """Return the run of an equation of state, or of porous plates."""
    thickness = count * _SPACING
    eos, porosity = (kind, "none") if kind != _POROUS else ("mie-grueneisen", "p-alpha")

    def case(end: float) -> Case:
        return plates(
            _MATERIAL, _MATERIAL, velocity, count, _SPACING, _WIDTH * thickness, end,
            {_MATERIAL: {"p-alpha": _PORES}}, eos=eos, porosity=porosity,
            strength="none", viscosity={"alpha": 1.0, "beta": 2.0},
        )  # fmt: skip

    # The end follows from the exact speed, which a case of any end tells.
    end = _WAY * thickness / _exact(case(1e-6)).speed
    return Setup(f"{kind} {velocity / 1e3:g} km/s, {count} layers", case(end))


def _exact(case: Case) -> Shocked:
    """Return the state behind the shock."""
    flyer = case.bodies[0]
    return plane_waves(matter_of(case.body_models(flyer)), flyer.velocity / 2)[-1]


def _layers(solved: Solved, index: int) -> Layers:
    """Return the target's layers, as far out as no wave from the rims has come."""
    case = solved.run.case
    matter = matter_of(case.body_models(case.bodies[1]))
    reach = sound_speed(matter, _exact(case)) * solved.run.snapshots[index].time
    kernel = case.scheme.kappa * case.resolution.nph * case.spacing
    rim = float(solved.run.snapshots[0]["r"].max())
    return layers_of(solved.run, "target", index, rim - reach - kernel)


class Measured(NamedTuple):
    """What a run gives, in SI units; means of layers.

    Attributes
    ----------
    speed : float
        Of the shock, where the velocity is half of that behind it.
    density, energy, pressure : float
        Next to the shock.
    heated : float
        Energy from the contact to the middle, with the wall heating of the start.
    """

    speed: float
    density: float
    energy: float
    pressure: float
    heated: float


def _measure(solved: Solved) -> Measured:
    """Return the state behind the shock as computed."""
    half, end = (_layers(solved, index) for index in (1, 2))
    level = 0.5 * _exact(solved.run.case).velocity
    fronts = [
        outermost_crossing(at.mean("z"), at.mean("u_z"), level) for at in (half, end)
    ]
    times = [solved.run.snapshots[index].time for index in (1, 2)]
    way = _WAY * end.start.size
    near = slice(int(0.5 * way), int(0.7 * way))
    density, energy, pressure = (
        float(end.mean(name)[near].mean()) for name in ("rho", "E", "P")
    )
    return Measured(
        (fronts[1] - fronts[0]) / (times[1] - times[0]),
        density,
        energy,
        pressure,
        float(end.mean("E")[_WALL : near.start].mean()),
    )


def _check_all(solved: Sequence[Solved]) -> list[Check]:
    """Compare speed, density, energy and pressure with the exact state."""
    return [line for group in _groups(solved) for line in _check(group)]


def _groups(solved: Sequence[Solved]) -> Iterator[list[Solved]]:
    """Return the runs of each impact, the coarsest first."""
    names = dict.fromkeys(_impact(each) for each in solved)
    for name in names:
        yield [each for each in solved if _impact(each) == name]


def _impact(solved: Solved) -> str:
    return solved.label.partition(",")[0]


def _check(group: Sequence[Solved]) -> Iterator[Check]:
    found = [_measure(each) for each in group]
    sizes = [1.0 / _layers(each, 0).start.size for each in group]
    want = _exact(group[-1].run.case)
    name, models = _impact(group[-1]), group[-1].run.case.material_table[0]

    def line(
        quantity: str, field: str, target: float, unit: str, scale: float
    ) -> Check:
        values = [getattr(each, field) for each in found]
        order = observed_order(sizes, [value - target for value in values])
        return Check.within(
            f"{name}: {quantity}", values[-1] / scale, target / scale,
            _BOUND * target / scale, unit, order,
        )  # fmt: skip

    yield line("shock speed", "speed", want.speed, "km/s", 1e3)
    card = models.constants[models.names["eos"]]
    if isinstance(card, MieGrueneisen) and models.initial_distension == 1.0:
        straight = card.c0 + card.slope * want.velocity
        yield line("shock speed beside c0 + s u", "speed", straight, "km/s", 1e3)
    yield line("density", "density", want.density, "kg/m3", 1.0)
    yield line("energy", "energy", want.energy, "MJ/kg", 1e6)
    yield line("energy nearer to the contact", "heated", want.energy, "MJ/kg", 1e6)
    yield line("pressure", "pressure", want.pressure, "GPa", 1e9)


def _draw(solved: Sequence[Solved], out: Out) -> None:
    """Draw density, energy and pressure of the finest run of each impact."""
    quantities = {"rho": "density", "E": "energy", "P": "pressure"}
    dots: dict[str, dict[str, tuple[Array, Array]]] = {name: {} for name in quantities}
    for group in _groups(solved):
        last = group[-1]
        want = _exact(last.run.case)
        layers = _layers(last, 2)
        way = layers.start / (want.speed * last.run.snapshots[-1].time)
        for name, field in quantities.items():
            value = layers.mean(name) / getattr(want, field)
            dots[name][_impact(last)] = (way, value)
    panels = [
        Panel(
            "layer over way of the shock",
            f"{field} / exact",
            dots[name],
            ((0.0, 1.0), (1.0, 1.0)),
            x_limits=(0.0, 1.2),
        )
        for name, field in quantities.items()
    ]
    draw_panels("Symmetric impact of plates", panels, out)


PROBLEM = Problem(
    "plates",
    "Symmetric impact of aluminium plates: the state behind the shock",
    "Rankine-Hugoniot conditions with the equation of state as programmed; "
    "U_s = c0 + s u of Steinberg, UCRL-MA-106439 (1996)",
    _setups,
    _check_all,
    _draw,
    "Means of layers of particles behind the shock, over the exact state, against the "
    "place of the layer at the start over the way that the shock has passed.",
)
