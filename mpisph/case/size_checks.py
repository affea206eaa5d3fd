"""Rules on sizes: what would be too coarse, too far, too many or too long to run."""

from __future__ import annotations

from collections.abc import Iterator

from mpisph.case.bodies import particle_count
from mpisph.case.partial_case import Parts, find_spacing, spacing_key
from mpisph.case.times import exposure_times
from mpisph.inputs.findings import Finding, Key

__all__ = ["FARTHEST", "SIZE_RULES"]

_MOST_PARTICLES = 10**9
_MOST_STEPS = 10**8
_MOST_SNAPSHOTS = 100_000

FARTHEST = 1e6
"""Spacings from the origin. The neighbour search keeps a table of all rows of cells
between the outermost particles, and positions must not lose their digits."""


def _check_walls(parts: Parts) -> Iterator[Finding]:
    """Require walls and layers that particles can stand for."""
    spacing = _spacing(parts)
    for i, body in enumerate(parts.bodies):
        if body is None or spacing is None:
            continue
        for axis, thickness, least in body.section.walls:
            if 0.0 < thickness < least * spacing:
                share = "" if least == 1.0 else f"{least:g} of "
                yield Finding(
                    ("bodies", i),
                    f'"{body.name}" ({thickness:g} m along {axis}) is thinner than '
                    f"{share}the particle spacing ({spacing:g} m)",
                )


def _check_distances(parts: Parts) -> Iterator[Finding]:
    """Require that the bodies stay within reach of the neighbour search."""
    spacing = _spacing(parts)
    last = _last_time(parts)
    for i, body in enumerate(parts.bodies):
        if body is None or spacing is None:
            continue
        farthest = FARTHEST * spacing
        limit = f"expected at most {FARTHEST:g} particle spacings, {farthest:g} m"
        distance = body.section.extent
        if distance > farthest:
            text = f'"{body.name}" reaches {distance:g} m from the origin; {limit}'
            yield Finding(("bodies", i), text)
        elif last is not None and abs(body.velocity) * last[1] > farthest:
            key, end = last
            path = abs(body.velocity) * end
            text = f'"{body.name}" moves {path:g} m within {end:g} s; {limit}'
            yield Finding(key, f"{text}; is the unit right?")


def _check_count(parts: Parts) -> Iterator[Finding]:
    """Require a number of particles that some machine could hold."""
    spacing = _spacing(parts)
    if parts.resolution is None or spacing is None:
        return
    bodies = [body for body in parts.bodies if body is not None]
    count = particle_count(bodies, spacing)
    if count > _MOST_PARTICLES:
        yield Finding(
            spacing_key(parts.resolution),
            f"about {count:.1e} particles; expected at most {_MOST_PARTICLES:.0e}",
        )


def _check_steps(parts: Parts) -> Iterator[Finding]:
    """Require a number of steps that could be waited for."""
    step, last = _least_step(parts), _last_time(parts)
    if step is None or last is None:
        return
    key, end = last
    if end / step > _MOST_STEPS:
        yield Finding(
            key,
            f"about {end / step:.1e} steps of {step:.1e} s up to {end:g} s; expected "
            f"at most {_MOST_STEPS:.0e}; is the unit right?",
        )


def _least_step(parts: Parts) -> float | None:
    """Return the fixed step, or what an automatic one surely does not exceed [s]."""
    time, spacing = parts.time, _spacing(parts)
    if time is None:
        return None
    if time.step == "fixed":
        return time.dt
    limits = [] if time.dt is None else [time.dt]
    used = (parts.materials.get(name or "") for name in parts.material_names)
    fastest = max((m.sound_speed for m in used if m is not None), default=None)
    if fastest is not None and spacing is not None and parts.resolution is not None:
        limits.append(time.cfl * parts.resolution.nph * spacing / fastest)
    return min(limits, default=None)


def _check_snapshots(parts: Parts) -> Iterator[Finding]:
    """Require a sensible number of snapshots."""
    last = _last_time(parts)
    if parts.output is None or parts.output.every is None or last is None:
        return
    _, end = last
    if end / parts.output.every > _MOST_SNAPSHOTS:
        yield Finding(
            ("output", "every"),
            f"expected at most {_MOST_SNAPSHOTS} snapshots up to {end:g} s",
        )


def _spacing(parts: Parts) -> float | None:
    if parts.resolution is None:
        return None
    return find_spacing(parts.resolution, parts.bodies)


def _last_time(parts: Parts) -> tuple[Key, float] | None:
    """Return the end of the run [s] with the key that sets it, if there is one."""
    if parts.time is None or parts.output is None:
        return None
    if parts.time.end is not None:
        return ("time", "end"), parts.time.end
    times: list[tuple[float, Key]] = [
        (time, ("output", "times", i)) for i, time in enumerate(parts.output.times)
    ]
    if parts.measured is not None:
        for i, exposure in enumerate(parts.measured.exposures):
            key: Key = ("measured", "exposures", i, "time")
            times += [(t, key) for t in exposure_times(exposure, parts.measured)]
    if not times:
        return None
    end, latest = max(times)
    return latest, end


SIZE_RULES = (
    _check_walls,
    _check_distances,
    _check_count,
    _check_steps,
    _check_snapshots,
)
