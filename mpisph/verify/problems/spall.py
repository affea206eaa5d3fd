"""Two plates of aluminium meet, and a scab parts from the rear of the target.

The target is twice as thick as the flyer, so that the crack lies in its middle. The
metal is fluid, and its crack takes energy: without it the tension would last as long
as a crack takes to open, which no spacing resolves. All runs are made with two crack
energies. The rear face shows the strength by its pull-back, and the difference between
both scabs' velocities shows the energy, free of what numerical width adds to both. A
run without crack energy shows how many layers then break. In the last one the metal is
elastic and plastic, and parts where the tension along z reaches the strength.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from mpisph.case import Case, case_from_dict
from mpisph.figures.style import Out
from mpisph.verify.exact.shocks import Shocked, matter_of, plane_waves
from mpisph.verify.exact.spall import Crack, pull_back_of_solid, velocity_in_tension
from mpisph.verify.layers import layers_of
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Array, Check, Problem, Setup, Solved, observed_order

_MATERIAL = "al-6061-t6"
_VELOCITY, _SOLID_VELOCITY = 300.0, 400.0
# Of the flyer: fluid, and with a strength, which weakens the waves.

_STRENGTH = 1.2e9
_ENERGIES = (20e3, 40e3)
# [J/m2].

_FLYER = 1e-3
_TARGET = 2.0 * _FLYER

_RINGS = 5
# That are looked at; no wave from the rim reaches them.

_COUNT = 20
# Layers of the flyer, for which the bounds hold.

_PULL_BACK_BOUND = 0.10
_ENERGY_BOUND = 0.15
_THICKNESS_BOUND = 0.05
_LAYERS_OFF = 2
# A scab's thickness is not known better than by some layers.

_MOST_BROKEN = 8
# Layers that may break where there is no crack energy.


class Exact(NamedTuple):
    """What acoustic waves give.

    Attributes
    ----------
    shocked : Shocked
        State behind the shocks of the impact.
    sound : float
        Speed of the releases [m/s].
    meeting : float
        Time at which they meet [s].
    pull_back : float
        [m/s].
    """

    shocked: Shocked
    sound: float
    meeting: float
    pull_back: float

    def crack(self, energy: float, density: float) -> Crack:
        """Return the crack of an energy [J/m2] in matter of a density."""
        load = density * self.sound * self.shocked.velocity
        return Crack(load, _STRENGTH, energy, density * self.sound)


def _exact(case: Case) -> Exact:
    models = case.body_models(case.bodies[0])
    matter = matter_of(models)
    shocked = plane_waves(matter, 0.5 * case.bodies[0].velocity)[-1]
    sound = models.bulk_sound_speed
    meeting = (_FLYER + _TARGET) / sound
    return Exact(shocked, sound, meeting, 2.0 * velocity_in_tension(matter, _STRENGTH))


def _fastest(case: Case) -> float:
    """Return the speed of longitudinal waves [m/s]; without strength that of sound."""
    models = case.body_models(case.bodies[0])
    G = matter_of(models).shear_modulus
    return math.sqrt(models.bulk_sound_speed**2 + 4.0 * G / (3.0 * models.rho0))


def _solid_pull_back(case: Case) -> float:
    """Return the pull-back of the elastic, plastic plates [m/s]."""
    models = case.body_models(case.bodies[0])
    return pull_back_of_solid(
        _STRENGTH, models.rho0, models.bulk_sound_speed, _fastest(case)
    )


def _crack(case: Case) -> Crack:
    return _exact(case).crack(_energy(case), case.body_models(case.bodies[0]).rho0)


def _energy(case: Case) -> float:
    constants = case.body_models(case.bodies[0]).constants["spall"]
    return float(constants.crack_energy)  # type: ignore[attr-defined]


def _setups(quick: bool) -> list[Setup]:
    counts = (8,) if quick else (10, _COUNT)
    pairs = [(count, energy) for count in counts for energy in _ENERGIES]
    fluid = [_setup(count, energy) for count, energy in [*pairs, (counts[-1], 0.0)]]
    return [*fluid, _setup(counts[-1], max(_ENERGIES), solid=True)]


def _setup(count: int, energy: float, solid: bool = False) -> Setup:
    spacing = _FLYER / count

    def case(radius: float, end: float) -> Case:
        plate = {"shape": "plate", "radius": radius, "material": _MATERIAL}
        velocity = _SOLID_VELOCITY if solid else _VELOCITY
        flyer = {"name": "flyer", "position": -_FLYER, "velocity": velocity}
        spall = {"strength": _STRENGTH, "crack_energy": energy}
        # The exact solutions have a strength without rate.
        spall["relaxation_time"] = 0.0
        material = {"thermal": "none", "failure": "spall", "ductile": "none"}
        material["strength"] = "elastic-plastic" if solid else "none"
        criterion = "principal" if solid else "pressure"
        return case_from_dict(
            {
                "title": "Spall",
                "bodies": [
                    {**plate, **flyer, "thickness": _FLYER},
                    {
                        **plate,
                        "name": "target",
                        "position": 0.0,
                        "thickness": _TARGET,
                    },
                ],
                "materials": {
                    _MATERIAL: material | {"spall": spall | {"criterion": criterion}}
                },
                "resolution": {"spacing": spacing, "nph": 1.5},
                "scheme": {"viscosity": {"alpha": 0.5, "beta": 2.0}},
                "gauges": [{"name": "rear", "kind": "moving", "r": 0.0, "z": _TARGET}],
                "time": {"end": end},
                "output": {"figures": False},
            }
        )

    any_size = case(_TARGET, 1e-6)
    exact, density = _exact(any_size), any_size.materials[_MATERIAL].rho0
    slowest = exact.crack(max(_ENERGIES), density)
    end = exact.meeting + slowest.opened + _FLYER / exact.sound
    radius = 1.05 * _fastest(any_size) * end + 2 * _RINGS * spacing
    label = f"{count} layers, {energy / 1e3:g} kJ/m2" + (", solid" if solid else "")
    return Setup(label, case(radius, end))


class Measured(NamedTuple):
    """What a run gives, in SI units.

    Attributes
    ----------
    pull_back : float
    thickness : float
        Of the scab, from the middle of the damage on.
    velocity : float
        Of the scab's mass at the end.
    broken : float
        Layers that carry no tension.
    damage : ndarray, shape (n,)
        Of the target's layers.
    """

    pull_back: float
    thickness: float
    velocity: float
    broken: float
    damage: Array


def _measure(solved: Solved) -> Measured:
    case = solved.run.case
    last = layers_of(solved.run, "target", -1, _radius(case))
    time, velocity = _rear(solved)
    # From when the waves meet until the scab's own release is back at its rear face.
    unit = _FLYER / _fastest(case)
    seen = (time > 3.0 * unit) & (time < 6.0 * unit)
    damage = last.mean("damage")
    place = float((damage * last.start).sum() / damage.sum())
    scab = last.start > _TARGET - _FLYER
    return Measured(
        case.bodies[0].velocity - float(velocity[seen].min()),
        _TARGET - place,
        float(last.mean("u_z")[scab].mean()),
        float((damage > 0.99).sum()),
        damage,
    )


def _radius(case: Case) -> float:
    return _RINGS * case.spacing


def _rear(solved: Solved) -> tuple[Array, Array]:
    """Return times [s] and velocities [m/s] of the rear face."""
    gauges = solved.run.gauges
    return gauges["time_s"], gauges["u_z_rear_m_per_s"]


def _check(solved: Sequence[Solved]) -> list[Check]:
    *pairs, brittle, solid = solved
    cases = [each.run.case for each in pairs]
    found = [_measure(each) for each in pairs]
    spacings = [case.spacing for case in cases]
    exact, density = _exact(cases[-1]), cases[-1].materials[_MATERIAL].rho0
    coarse = spacings[-1] / (_FLYER / _COUNT)

    strong = _solid_pull_back(solid.run.case)
    low, high = (exact.crack(energy, density).impulse for energy in _ENERGIES)
    lost = (high - low) / (density * _FLYER)
    losses = [
        a.velocity - b.velocity for a, b in zip(found[::2], found[1::2], strict=True)
    ]
    pulls = [each.pull_back for each in found[1::2]]
    offs = (_THICKNESS_BOUND * _FLYER, _LAYERS_OFF * spacings[-1])
    checks = [
        Check.within(
            "pull-back velocity of the rear face", pulls[-1], exact.pull_back,
            coarse * _PULL_BACK_BOUND * exact.pull_back, "m/s",
            observed_order(spacings[1::2], [pull - exact.pull_back for pull in pulls]),
        ),
        Check.within(
            "velocity that twice the crack energy takes from the scab",
            losses[-1], lost, coarse * _ENERGY_BOUND * lost, "m/s",
            observed_order(spacings[1::2], [loss - lost for loss in losses]),
        ),
    ]  # fmt: skip
    checks.insert(
        1,
        Check.within(
            "pull-back velocity with strength",
            _measure(solid).pull_back,
            strong,
            coarse * _PULL_BACK_BOUND * strong,
            "m/s",
        ),
    )
    for each, name in ((found[-1], "tough"), (_measure(brittle), "brittle")):
        checks.append(
            Check.within(
                f"thickness of the scab, {name}",
                1e3 * each.thickness,
                1e3 * _FLYER,
                1e3 * max(offs),
                "mm",
            )
        )
    checks += [
        Check.at_least("damage of the crack, tough", found[-1].damage.max(), 1.0, 1.0),
        Check.at_most("broken layers, brittle", _measure(brittle).broken, _MOST_BROKEN),
    ]
    return checks


def _draw(solved: Sequence[Solved], out: Out) -> None:
    panels = []
    for energy in _ENERGIES:
        chosen = [each for each in solved[:-1] if _energy(each.run.case) == energy]
        case = chosen[-1].run.case
        exact, crack = _exact(case), _crack(case)
        dots = {}
        for each in chosen:
            time, velocity = _rear(each)
            dots[each.label.split(",")[0]] = (1e6 * time, velocity)
        begins = exact.meeting + _FLYER / exact.sound
        arrives = _TARGET / exact.shocked.speed
        opening = np.linspace(0.0, crack.opened, 50)
        pull = [2.0 * crack.tension(float(t)) / crack.impedance for t in opening]
        times = [0.0, arrives, arrives, begins, *(begins + opening), case.end_time]
        line = [
            0.0,
            0.0,
            _VELOCITY,
            _VELOCITY,
            *(_VELOCITY - np.array(pull)),
            _VELOCITY,
        ]
        panels.append(
            Panel(
                "time [µs]", "velocity of the rear face [m/s]", dots,
                (1e6 * np.array(times), np.array(line)),
                title=f"{energy / 1e3:g} kJ/m²",
            )
        )  # fmt: skip
    damages = {}
    for each, name in zip(solved[-3:], ("tough", "brittle", "solid"), strict=True):
        layers = layers_of(each.run, "target", -1, _radius(each.run.case))
        damages[name] = (1e3 * layers.start, layers.mean("damage"))
    panels.append(Panel("z at the start [mm]", "damage", damages, None))
    draw_panels("Spall of aluminium plates", panels, out)


PROBLEM = Problem(
    "spall",
    "Spall of an aluminium plate with a given strength and crack energy",
    "acoustic waves and a crack that opens against a tension in proportion (Hillerborg "
    "et al. 1976): pull-back 2 sigma/(rho c) of the rear face (Antoun et al., Spall "
    "Fracture, 2003), with the isentrope as programmed, and that of Romanchenko and "
    "Stepanov (J. Appl. Mech. Tech. Phys. 21 (1980) 555) with strength; scab as thick "
    "as the flyer",
    _setups,
    _check,
    _draw,
    "Velocity of the rear face with two crack energies; damage of the layers of the "
    "target.",
)
