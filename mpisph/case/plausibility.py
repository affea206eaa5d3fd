"""What a case may ask for but hardly means: warnings, each with what to do."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from mpisph.case.contact import first_contact, meeting_time, plane_times
from mpisph.case.model import Case
from mpisph.case.profiles import sampled_densities
from mpisph.case.sections import Resolution, Scheme, Viscosity
from mpisph.case.shapes.section import FloatArray
from mpisph.case.shield import shield_doubts
from mpisph.inputs.quantities import FrozenModel
from mpisph.materials.doubts import doubtful_constants, doubtful_elongation
from mpisph.physics.eos import GASES
from mpisph.physics.eos.table import Tabulated
from mpisph.physics.failure.minimum_pressure import MinimumPressure
from mpisph.physics.response import KINDS, MaterialModels

__all__ = ["find_warnings"]

_SLOW, _FAST = 100.0, 30e3
"""Impact velocities [m/s] beyond which a unit is likely wrong: km/h for km/s gives some
2 m/s, a number in m/s with the unit km/s some 7000 km/s. Guns reach 12 km/s."""

_STRENGTH_COUNTS = 3e3
"""Impact velocity [m/s] below which strength decides what comes out of an impact."""

_ADVISED_ROWS = 3
"""Particles across a wall: one has no inside, and with two it splits along its middle.
Of two there is no warning: the paper's resolution gives shot 4-1283 no more."""

_DENSE = 0.5
"""Relative change of a solid's density at the start that is hardly meant."""

_FEWEST_NPR = 4

_LEAST_NPH = 0.8
_LEAST_VISCOSITY = 1.0
"""Measured on shots 4-1283 and 4-1353 at NPR 5 and 6, lowest internal energy over the
kinetic energy per mass of the impact: not below zero for alpha = beta of 1 and more
and NPH of 0.7 and more; -0.001 at 0.5, -0.02 to -0.18 at 0. With an NPH of 0.6 it is
-0.03, with 0.5 it is -0.04 to -0.16."""

LEAST_DAMPING, LARGEST_CFL = 0.3, 0.2
"""Measured on a torus that breathes for 30 passes of a wave: stable for an alpha of 0.3
at any Courant factor up to 0.3, and of 0.1 up to 0.25; at 0.1 and 0.3 its outermost
particles gain energy until the run breaks down."""


_LIGHT, _GAS_CFL = 1.0 / 500.0, 0.05
"""Measured on a gas before an aluminium sphere of 1 to 7 km/s at NPR 5. With a Courant
factor of 0.3 runs complete for 1/280 of the sphere's density, and break down in the
first step for 1/700; with 0.05 they complete for 1/2300."""


def find_warnings(case: Case) -> list[str]:
    """Return what makes no physical sense in a sound case, or hardly any.

    Parameters
    ----------
    case : Case

    Returns
    -------
    list of str
        Each names the keys to blame and says what to do.
    """
    rules = (
        _warn_of_meeting,
        _warn_of_velocity,
        _warn_of_starting_state,
        _warn_of_thin_walls,
        _warn_of_shield,
        _warn_of_foam,
        _warn_of_scheme,
        _warn_of_materials,
        _warn_of_heat,
        _warn_of_smoothing,
        _warn_of_viscosity,
        _warn_of_light_gas,
        _warn_of_gauges,
    )
    return [text for rule in rules for text in rule(case)]


def _warn_of_meeting(case: Case) -> Iterator[str]:
    """Warn of bodies that never meet, or not before the end of the run.

    A plane counts as a body that all may hit.
    """
    bodies, end = case.bodies, case.end_time
    # Shapes say nothing of particles of one's own.
    if case.initial is not None or _moves_by_itself(case):
        return
    if len(bodies) == 1 and not case.boundary.exists:
        yield f"bodies: there is only {bodies[0].name}, which nothing hits"
        return
    meeting = first_contact(bodies, case.boundary)
    if math.isinf(meeting):
        listed = ", ".join(f"{b.name} at {b.velocity:g} m/s" for b in bodies)
        none = "no two bodies ever meet"
        if case.boundary.exists:
            none = "no body ever meets another one or a plane"
        yield (
            f"bodies.*.velocity: {none} ({listed}); velocities are "
            "along +z: look at their signs, and at the positions"
        )
        return
    what = "the first bodies meet"
    if case.boundary.exists:
        what = "the first bodies or planes meet"
    if meeting > end:
        yield (
            f"time.end: {what} at {_us(meeting)}, after the end of the "
            f"run at {_us(end)}; let it last longer, or narrow the gap (bodies.*."
            "position)"
        )
        return
    if meeting > 0.0:
        yield (
            f"bodies.*.position: {what} at {_us(meeting)} only, and "
            "times count from the start of the run; bodies that touch at the start "
            "save these steps"
        )
    for body in bodies:
        others = [other for other in bodies if other is not body]
        times = [meeting_time(body, other, anywhere=True) for other in others]
        soonest = min(*times, *plane_times(case.boundary, body))
        if soonest > end:
            when = "ever" if math.isinf(soonest) else f"before {_us(soonest)}"
            yield (
                f"bodies.{body.name}: nothing reaches {body.name} {when}, and the run "
                f"ends at {_us(end)}; look at time.end, its position and velocity"
            )


def _impact_speed(case: Case) -> float:
    """Return the largest velocity of an impact [m/s], on a plane as well."""
    onto_planes = (
        abs(body.velocity)
        for body in case.bodies
        if not math.isinf(min(plane_times(case.boundary, body)))
    )
    return max(case.impact_velocity, *onto_planes, 0.0)


def _warn_of_velocity(case: Case) -> Iterator[str]:
    """Warn of velocities that look like a slip of the unit."""
    if _has_gas(case):  # its problems may be in units of any size
        return
    velocity = _impact_speed(case)
    if 0.0 < velocity < _SLOW or velocity > _FAST:
        yield f"bodies.*.velocity: the impact has {velocity:.4g} m/s; {_IN_SI}"
    for body in case.bodies if case.initial is None else ():
        radial = body.radial_velocity
        if isinstance(radial, float) and abs(radial) > _FAST:
            key = f"bodies.{body.name}.radial_velocity"
            yield f"{key}: {body.name} has {radial:.4g} m/s; {_IN_SI}"


_IN_SI = (
    'a number is in m/s, and a string carries its unit, as in "6.7 km/s": is the unit '
    "right?"
)


def _warn_of_thin_walls(case: Case) -> Iterator[str]:
    """Warn of walls of one particle."""
    for body in case.bodies if case.initial is None else ():
        axis, thickness, _ = min(body.section.walls, key=lambda wall: wall.thickness)
        rows = max(1, round(thickness / case.spacing))
        if rows > 1:
            continue
        finer = f"resolution.spacing = {thickness / _ADVISED_ROWS:.3g}"
        if case.resolution.npr is not None:
            needed = case.resolution.npr * case.spacing * _ADVISED_ROWS / thickness
            # A whole number but for rounding is that number.
            finer = f"resolution.npr = {math.ceil(needed * (1.0 - 1e-9))}"
        yield (
            f"bodies.{body.name}: along {axis} it has 1 particle: no wave can run "
            f"through it; {finer} gives it {_ADVISED_ROWS}"
        )


def _warn_of_shield(case: Case) -> Iterator[str]:
    """Warn of a shield whose verdict is doubtful."""
    if case.shield is not None:
        rows = [layer.thickness / case.spacing for layer in case.shield.layers]
        yield from shield_doubts(case.shield, rows)


def _warn_of_foam(case: Case) -> Iterator[str]:
    """Warn of strong matter that bears no tension where strength decides."""
    velocity = _impact_speed(case)
    if not 0.0 < velocity < _STRENGTH_COUNTS:
        return
    foams = [m for m in case.material_table if _strong_without_tension(m)]
    ductile = any(m.names["ductile"] != "none" for m in foams)
    off = "" if ductile else ', or mode = "off"'
    for models in {m.material: m for m in foams}.values():
        material = case.materials[models.material]
        # In the scheme it would take the place of what other cards choose.
        named = not case.scheme.model_fields_set.isdisjoint({"failure", "p_min"})
        if named and material.constants(_LIMIT) is None:
            key = f"scheme.p_min, for {models.material}"
        else:
            key = f"materials.{models.material}.{_LIMIT}"
        yield (
            f"{key}: with a minimum pressure of 0 the material bears no tension, and "
            f"at {velocity:g} m/s what has strength turns to foam; set a spall "
            f'strength as value there, such as "-1.2 GPa"{off}; or give it failure '
            '= "spall" with a strength'
        )


_LIMIT = "minimum-pressure"


def _strong_without_tension(models: MaterialModels) -> bool:
    strength, failure = (models.names[kind] for kind in ("strength", "failure"))
    if strength == "none" or failure != _LIMIT:
        return False
    constants: Any = models.constants
    limit, yields = constants[failure], 1.0
    if strength == "elastic-plastic":
        yields = constants[strength].yield_strength
    return bool(yields > 0.0 and limit.value == 0.0 and limit.mode != "off")


def _bears_any_tension(models: MaterialModels) -> bool:
    if models.names["failure"] != _LIMIT:
        return models.names["failure"] == "none"
    limit: Any = models.constants[_LIMIT]
    return bool(limit.mode == "off" or limit.value == -math.inf)


def _warn_of_scheme(case: Case) -> Iterator[str]:
    """Warn of models for all materials that none of them takes."""
    scheme, table = case.scheme, case.material_table
    for kind in KINDS:
        chosen, default = getattr(scheme, kind), Scheme.model_fields[kind].default
        if chosen == default or chosen in {m.names[kind] for m in table}:
            continue
        where = " or ".join(f"materials.{name}.{kind}" for name in case.materials)
        bodies = ", or of their bodies" if kind == "eos" else ""
        yield (
            f'scheme.{kind}: no material takes "{chosen}", for all name a model of '
            f"their own; change {where}{bodies}"
        )
    limits = [m.constants[_LIMIT] for m in table if m.names["failure"] == _LIMIT]
    if scheme.p_min != MinimumPressure() and scheme.p_min not in limits:
        yield (
            "scheme.p_min: no material takes it, for each fails by another model, or "
            f"has a table {_LIMIT} of its own; change those, or leave it out"
        )


def _warn_of_materials(case: Case) -> Iterator[str]:
    """Warn of constants that no matter has, and of models without effect."""
    seen: set[str] = set()
    for models in case.material_table:
        elongation = case.materials[models.material].elongation
        key = f"materials.{models.material}"
        for text in (*_doubts(models), *doubtful_elongation(key, elongation)):
            if text not in seen:
                yield text
            seen.add(text)


def _doubts(models: MaterialModels) -> Iterator[str]:
    """Yield what is doubtful about a material's choice of models and constants."""
    key = f"materials.{models.material}"
    chosen: dict[str, Any] = {
        name: models.constants[name]
        for name in models.names.values()
        if name in models.constants
    }
    if not models.gas:
        bulk = models.rho0 * models.bulk_sound_speed**2
        yield from doubtful_constants(key, models.rho0, bulk, chosen)
    if models.names["strength"] == "none":
        ductile = "johnson-cook-damage"
        for kind, model in (("failure", "grady-kipp"), ("ductile", ductile)):
            if models.names[kind] == model:
                yield (
                    f"{key}.{kind}: without strength there is neither shear modulus "
                    f"nor plastic strain, and {model} breaks nothing; give it "
                    f"strength, or set {kind} to another model"
                )
    elif models.names["ductile"] != "none" and _bears_any_tension(models):
        yield (
            f"{key}.failure: tension from all sides strains nothing plastically, and "
            "without a limit to it matter bears any; set failure = "
            f'"spall", or {_LIMIT} with a finite value'
        )


def _warn_of_heat(case: Case) -> Iterator[str]:
    """Warn of artificial heat that spoils temperatures."""
    heat = case.scheme.heat
    warm = [m.material for m in case.material_table if m.names["thermal"] != "none"]
    if warm and heat.enabled and heat.g1 > 0.0:
        yield (
            f"scheme.heat.g1: with {heat.g1:g} heat is conducted everywhere, so that "
            f"temperatures and melting of {', '.join(dict.fromkeys(warm))} are wrong; "
            "set it to 0"
        )


def _default(section: type[FrozenModel], name: str) -> str:
    """Return the default of a setting as text."""
    return f"{section.model_fields[name].default:g}"


def _warn_of_smoothing(case: Case) -> Iterator[str]:
    """Warn of too few particles, or too few neighbours."""
    npr, nph = case.resolution.npr, case.resolution.nph
    if npr is not None and npr < _FEWEST_NPR:
        yield (
            f"resolution.npr: {npr} particles along a radius resolve no shock; take "
            f"{_FEWEST_NPR} for a trial and 10 or more for results"
        )
    if nph < _LEAST_NPH:
        yield (
            f"resolution.nph: with {nph:g} a particle has too few neighbours, and "
            "internal energies fall far below zero; take "
            f"{_LEAST_NPH:g} or more (default {_default(Resolution, 'nph')})"
        )


def _warn_of_viscosity(case: Case) -> Iterator[str]:
    """Warn of an artificial viscosity that stops no particles from passing through."""
    viscosity = case.scheme.viscosity
    if viscosity.alpha < _LEAST_VISCOSITY:
        yield (
            f"scheme.viscosity.alpha: with {viscosity.alpha:g} particles pass through "
            "each other at a shock, and internal energies fall below zero; take "
            f"{_LEAST_VISCOSITY:g} or more (default {_default(Viscosity, 'alpha')})"
        )
    elastic = any(m.names["strength"] != "none" for m in case.material_table)
    if (
        elastic
        and viscosity.alpha < LEAST_DAMPING
        and case.time.step == "automatic"
        and case.time.cfl > LARGEST_CFL
    ):
        yield (
            f"time.cfl: with {case.time.cfl:g} and an alpha of {viscosity.alpha:g} the "
            "surfaces of an elastic body vibrate more and more; take "
            f"{LARGEST_CFL:g} or less"
        )


def _warn_of_light_gas(case: Case) -> Iterator[str]:
    """Warn of steps that are too long for a light gas before a solid."""
    if (
        case.initial is not None
        or case.time.step == "fixed"
        or case.time.dt is not None
    ):
        return
    gases = [b for b in case.bodies if case.body_models(b).gas]
    solids = [body for body in case.bodies if body not in gases]
    if not gases or not solids or case.time.cfl <= _GAS_CFL:
        return
    densest = max(case.body_models(body).rest_density for body in solids)
    for body in gases:
        rho0 = case.body_models(body).rest_density
        density = float(sampled_densities(body, rho0).min())
        if density < _LIGHT * densest and case.impact_velocity > 0.0:
            yield (
                f"time.cfl: with {case.time.cfl:g} the steps may be too long for "
                f"{body.name}, which has 1/{densest / density:.0f} of the density of "
                f"the solid that moves into it; take {_GAS_CFL:g}, or a short time.dt"
            )


def _warn_of_gauges(case: Case) -> Iterator[str]:
    """Warn of gauges behind a plane, and of moving ones that do not begin in matter."""
    low, high = case.boundary.planes
    for gauge in case.gauges:
        if not low <= gauge.z <= high:
            yield (
                f"gauges.{gauge.name}.z: {gauge.z:g} m is behind a rigid plane "
                f"(boundary), where no matter ever comes"
            )
    if case.initial is not None:
        return
    for gauge in case.gauges:
        if gauge.kind == "moving" and not any(
            body.section.holds(gauge.r, gauge.z) for body in case.bodies
        ):
            yield (
                f"gauges.{gauge.name}: it moves with the particle that is nearest to "
                f"r = {gauge.r:g} m, z = {gauge.z:g} m, and no body is there; look at "
                'r and z, or set kind = "fixed"'
            )


def _warn_of_starting_state(case: Case) -> Iterator[str]:
    """Warn of energies without effect, and of densities that no solid has."""
    for body in case.bodies if case.initial is None else ():
        models = case.body_models(body)
        if models.names["eos"] == "linear" and body.energy != 0.0:
            yield (
                f"bodies.{body.name}.energy: the linear equation of state knows no "
                "energy, so it changes no motion; take another one (eos)"
            )
        constants = models.constants[models.names["eos"]]
        if isinstance(constants, Tabulated) and not models.gas:
            yield from _warn_of_reference_pressure(body.name, constants, models)
        gas = models.gas
        ideal = models.names["eos"] in GASES
        if ideal and body.energy == body.velocity == body.radial_velocity == 0.0:
            yield (
                f"bodies.{body.name}.energy: a gas at rest without energy has no "
                "pressure; P / ((gamma - 1) rho) gives it the pressure P"
            )
        ratio = _unlike(
            sampled_densities(body, models.rest_density) / models.rest_density
        )
        low, high = case.limits.density_ratio_min, case.limits.density_ratio_max
        value = f"{ratio * models.rest_density:.4g} kg/m^3 is {ratio:.3g} times"
        about = f"{value} the reference density of {models.material}"
        if not low <= ratio <= high:
            yield (
                f"bodies.{body.name}.density: {about}, and the run ends at once as "
                f"unstable (limits.density_ratio_*: {low:g} to {high:g}); is the unit "
                "right?"
            )
        elif not gas and abs(ratio - 1.0) > _DENSE:
            yield f"bodies.{body.name}.density: {about}: is the unit right?"


_LARGEST_REST_PRESSURE = 1e-3
"""Of the bulk modulus, for a solid that is meant to be at rest."""


def _warn_of_reference_pressure(
    name: str, constants: Tabulated, models: MaterialModels
) -> Iterator[str]:
    """Warn of a reference density that is not that of a table."""
    P = constants.reference_pressure(models.rho0)
    bulk = models.rho0 * models.bulk_sound_speed**2
    if abs(P) > _LARGEST_REST_PRESSURE * bulk:
        yield (
            f"bodies.{name}.material: {models.material} has a pressure of {P:.3g} Pa "
            f"at rho0 = {models.rho0:g} kg/m^3 and its reference temperature; is that "
            "the density of the table?"
        )


def _unlike(ratios: FloatArray) -> float:
    """Return the ratio that is farthest from one, in either direction."""
    return float(ratios[np.abs(np.log(ratios)).argmax()])


def _moves_by_itself(case: Case) -> bool:
    """Say whether bodies do not need each other to move."""
    return _has_gas(case) or any(
        body.radial_velocity != 0.0 or body.energy != 0.0 or body.density is not None
        for body in case.bodies
    )


def _has_gas(case: Case) -> bool:
    return any(models.gas for models in case.material_table)


def _us(time: float) -> str:
    """Return a time [s] for people."""
    return f"{1e6 * time:.4g} us"
