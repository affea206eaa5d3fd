"""What one field cannot tell by itself: rules between the parts of a case."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from mpisph.case.bodies import SHAPES, Plate
from mpisph.case.partial_case import Parts, default_reference, find_spacing
from mpisph.case.sections import Boundary
from mpisph.case.shapes.overlap import sections_overlap
from mpisph.case.shapes.section import rounding_of
from mpisph.case.size_checks import SIZE_RULES
from mpisph.case.times import requested_times
from mpisph.inputs.findings import Finding, Key
from mpisph.inputs.spelling import nearest_quoted
from mpisph.materials import card_names
from mpisph.materials.choice import chosen_models
from mpisph.materials.model import TABLES
from mpisph.physics.eos.table import Tabulated
from mpisph.physics.response import KINDS, MaterialModels

__all__ = ["find_problems"]


def find_problems(parts: Parts) -> list[Finding]:
    """Return every broken rule.

    Parameters
    ----------
    parts : Parts
        The case's parts; invalid ones are None.

    Returns
    -------
    list of Finding
        Empty for a sound case.
    """
    rules = (
        _check_names,
        _check_sizes,
        _check_overlaps,
        _check_boundary,
        _check_resolution,
        _check_materials,
        _check_models,
        _check_temperatures,
        _check_measured_plate,
        _check_clock,
        _check_time_step,
        _check_end,
        *SIZE_RULES,
    )
    return [finding for rule in rules for finding in rule(parts)]


def _check_names(parts: Parts) -> Iterator[Finding]:
    """Require a body, and unique names."""
    if not parts.names:
        yield Finding(("bodies",), "at least one body is needed")
    for table, kind, names in (
        ("bodies", "body", parts.names),
        ("gauges", "gauge", parts.gauge_names),
    ):
        seen: set[str] = set()
        for i, name in enumerate(names):
            if name is not None and name in seen:
                yield Finding((table, i, "name"), f"another {kind} has this name")
            if name is not None:
                seen.add(name)


def _check_sizes(parts: Parts) -> Iterator[Finding]:
    """Require sizes that do not contradict each other."""
    for i, body in enumerate(parts.bodies):
        for key, expected in body.mistakes() if body is not None else ():
            yield Finding(("bodies", i, key), expected)


def _check_overlaps(parts: Parts) -> Iterator[Finding]:
    """Require that no two bodies occupy the same space."""
    for j, body in enumerate(parts.bodies):
        for other in parts.bodies[:j]:
            if body is None or other is None:
                continue
            if sections_overlap(body.section, other.section):
                yield Finding(
                    ("bodies", j),
                    f'the bodies "{other.name}" and "{body.name}" overlap; '
                    "move one of them (touching is allowed)",
                )


_FEWEST_BETWEEN = 2.0
"""Least distance of two planes, in reaches of the kernel: images are not mirrored."""


def _check_boundary(parts: Parts) -> Iterator[Finding]:
    """Require that bodies lie between the planes, and room for the kernel there."""
    low, high = planes = (parts.boundary or Boundary()).planes
    for body in parts.bodies:
        if body is None:
            continue
        ends = body.section.ends
        for key, plane, depth in zip(
            ("z_min", "z_max"), planes, (low - ends[0], ends[1] - high), strict=True
        ):
            if depth > rounding_of(*ends):
                yield Finding(
                    ("boundary", key),
                    f'the body "{body.name}" reaches {depth:g} m through the plane '
                    f"z = {plane:g} m; move one of them (touching is allowed)",
                )
    if parts.resolution is None or parts.scheme is None:
        return
    spacing = find_spacing(parts.resolution, parts.bodies)
    if spacing is not None:
        reach = parts.scheme.kappa * parts.resolution.nph * spacing
        least = _FEWEST_BETWEEN * reach
        if high - low < least:
            yield Finding(
                ("boundary",),
                f"the planes are {high - low:g} m apart; expected at least "
                f"{_FEWEST_BETWEEN:g} reaches of the kernel, {least:g} m",
            )


def _check_resolution(parts: Parts) -> Iterator[Finding]:
    """Require one way to give the spacing, and a known reference body."""
    resolution = parts.resolution
    if resolution is None:
        return
    if (resolution.npr is None) == (resolution.spacing is None):
        found = "neither" if resolution.npr is None else "both"
        yield Finding(
            ("resolution",), f"expected one of npr and spacing, found {found}"
        )
    if not parts.bodies or None in parts.bodies or None in parts.names:
        return
    if resolution.reference is not None:
        yield from _check_known_body(
            ("resolution", "reference"), resolution.reference, parts.names
        )
    elif resolution.npr is not None and default_reference(parts.bodies) is None:
        shapes = [shape.label() for shape in SHAPES if shape.sets_spacing]
        yield Finding(
            ("resolution", "reference"),
            f"there is no {' or '.join(shapes)}: expected the name of the body whose "
            "radius npr divides",
        )


def _check_known_body(
    key: Key, name: str, names: Sequence[str | None]
) -> Iterator[Finding]:
    known = [other for other in names if other is not None]
    if name not in known:
        expected = f"expected the name of a body ({', '.join(known)})"
        yield Finding(key, expected, nearest_quoted(name, known))


def _check_materials(parts: Parts) -> Iterator[Finding]:
    """Require known materials."""
    known = sorted({*card_names(), *parts.materials})
    for i, name in enumerate(parts.material_names):
        if name is not None and name not in known:
            yield Finding(
                ("bodies", i, "material"),
                f"expected a material card or a name in [materials] "
                f"({', '.join(known)})",
                nearest_quoted(name, known),
            )


def _check_models(parts: Parts) -> Iterator[Finding]:
    """Require the constants of the models that are chosen."""
    if parts.scheme is None:
        return
    seen: set[tuple[str, str | None]] = set()
    for i, body in enumerate(parts.bodies):
        material = parts.materials.get(body.material) if body is not None else None
        if body is None or material is None or (body.material, body.eos) in seen:
            continue
        seen.add((body.material, body.eos))
        chosen = chosen_models(material, parts.scheme, body.eos)
        who = f'"{material.name}", the material of "{body.name}"'
        for kind, name in chosen.names.items():
            key: Key = ("scheme", kind)
            if kind == "eos" and body.eos:
                key = ("bodies", i, "eos")
            elif getattr(material, kind) is not None:
                key = ("materials", body.material, kind)
            if name in TABLES and name not in chosen.constants:
                label = KINDS[kind][name].label
                others = [x for x in KINDS[kind] if x in chosen.constants]
                known = f"; it has those of {', '.join(others)}" if others else ""
                fluid = _FLUID.get(kind, "") if not others else ""
                yield Finding(key, f"{who}, has no {label} constants{known}{fluid}")
        yield from _check_state_at_rest(chosen, ("materials", body.material))


_FLUID = {"strength": '; strength = "none" in its table makes it a fluid'}


def _check_state_at_rest(chosen: MaterialModels, key: Key) -> Iterator[Finding]:
    """Require the reference state in a table, and a solid around pores."""
    constants = chosen.constants.get(chosen.names["eos"])
    if isinstance(constants, Tabulated) and (text := constants.mistake(chosen.rho0)):
        yield Finding((*key, "table"), text)
    elif chosen.names["porosity"] != "none" and chosen.gas:
        text = f'"{chosen.material}" is a gas, which has no pores'
        yield Finding((*key, "porosity"), text)


def _check_temperatures(parts: Parts) -> Iterator[Finding]:
    """Require a thermal model where another model depends on the temperature."""
    if parts.scheme is None:
        return
    stated = "thermal" in parts.scheme.model_fields_set
    cold: list[str] = []
    for used in dict.fromkeys(body.material for body in parts.bodies if body):
        material = parts.materials.get(used)
        if material is None:
            continue
        chosen = chosen_models(material, parts.scheme)
        if chosen.names["thermal"] != "none":
            continue
        depend = {
            kind: name
            for kind, name in chosen.names.items()
            if name in chosen.constants and chosen.constants[name].needs_temperature
        }
        known = [model for model in KINDS["thermal"] if material.constants(model)]
        if stated and known and material.thermal is None:
            cold += [f'{name} of "{material.name}"' for name in depend.values()]
            continue
        remedy = "give it the constants of a thermal model, or take another model"
        if known:
            remedy = (
                f'set materials.{used}.thermal = "{known[0]}", for which it has '
                "constants"
            )
        for kind, name in depend.items():
            own = getattr(material, kind) is not None
            yield Finding(
                ("materials", used, kind) if own else ("scheme", kind),
                f'"{material.name}" has no temperature, on which {name} depends; '
                f"{remedy}",
            )
    if cold:
        yield Finding(
            ("scheme", "thermal"),
            f"{', '.join(cold)} cannot do without a temperature; expected a thermal "
            "model, or nothing, so that the cards choose",
        )


def _check_measured_plate(parts: Parts) -> Iterator[Finding]:
    """Require a plate for lengths to count from."""
    if parts.measured is None or None in parts.bodies or None in parts.names:
        return
    plates = [body.name for body in parts.bodies if isinstance(body, Plate)]
    name = parts.measured.plate
    if name is None and not plates:
        yield Finding(("measured",), "there is no plate from which to measure")
    if name is not None and name not in plates:
        listed = ", ".join(plates) or "there is none"
        yield Finding(
            ("measured", "plate"),
            f"expected the name of a plate ({listed})",
            nearest_quoted(name, plates),
        )


def _check_clock(parts: Parts) -> Iterator[Finding]:
    """Require that no exposure was made before the first contact."""
    if parts.measured is None or not parts.measured.exposures:
        return
    earliest = min(exposure.time for exposure in parts.measured.exposures)
    if earliest + parts.measured.clock_offset <= 0.0:
        yield Finding(
            ("measured", "clock_offset"),
            f"expected more than {-earliest:g} s, for the first exposure is at "
            f"{earliest:g} s",
        )


def _check_time_step(parts: Parts) -> Iterator[Finding]:
    """Require the size of a fixed step."""
    if parts.time is not None and parts.time.step == "fixed" and parts.time.dt is None:
        yield Finding(("time", "dt"), 'step = "fixed" needs a time step dt')


def _check_end(parts: Parts) -> Iterator[Finding]:
    """Require an end, not before any output time."""
    if parts.time is None or parts.output is None:
        return
    end = parts.time.end
    if end is None:
        asked = requested_times(parts.output, parts.measured)
        if not asked and not parts.measured_invalid:
            yield Finding(
                ("time", "end"),
                "required, because no output time is named (output.times or "
                "measured.exposures)",
            )
        return
    for i, time in enumerate(parts.output.times):
        if time > end:
            yield Finding(
                ("output", "times", i), f"expected at most time.end = {end:g} s"
            )
