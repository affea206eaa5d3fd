"""When bodies first meet, by their shapes and initial velocities alone."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from mpisph.case.bodies import Body
from mpisph.case.sections import Boundary
from mpisph.case.shapes.section import FloatArray, Section

__all__ = ["first_contact", "meeting_time", "plane_times", "time_origin"]

_HEIGHTS = 1025
"""Heights at which a section is looked at."""

_RADII = 129
"""Radii at which the gap between two sections is looked at."""

_UNSEEN = 1e-3
"""Way before the contact over the extent of the bodies that makes no difference."""

_SAMPLING = 1e-6
"""Error of a gap over the extent of the bodies: shapes are looked at in samples."""


def first_contact(bodies: Sequence[Body], boundary: Boundary) -> float:
    """Return when the first two bodies meet that move against each other [s].

    A plane counts as a body.

    Parameters
    ----------
    bodies : sequence of Body
    boundary : Boundary

    Returns
    -------
    float
        Infinity where none ever do.
    """
    times = [
        meeting_time(one, other)
        for k, one in enumerate(bodies)
        for other in bodies[:k]
        if one.velocity != other.velocity
    ]
    times += [time for body in bodies for time in plane_times(boundary, body)]
    return min(times, default=math.inf)


def time_origin(bodies: Sequence[Body], boundary: Boundary) -> str:
    """Return in words what the times of a run count from.

    They count from its start. That is the first contact where the bodies touch then, or
    move so little before that no one would tell the two apart.
    """
    contact = first_contact(bodies, boundary)
    if contact == 0.0:
        return "after first contact"
    speed = max((abs(body.velocity) for body in bodies), default=0.0)
    extent = max((body.section.extent for body in bodies), default=0.0)
    near = speed * contact < _UNSEEN * extent
    return "after first contact" if near else "after the start"


def meeting_time(one: Body, other: Body, anywhere: bool = False) -> float:
    """Return when two bodies meet that keep shape and velocity [s].

    Parameters
    ----------
    one, other : Body
    anywhere : bool, optional
        Whether they may miss each other in radius, as debris of the one may not.

    Returns
    -------
    float
        Infinity where they never do; zero for those that touch and move alike.
    """
    gap, behind, ahead = _gap(one, other, anywhere)
    closing = behind.velocity - ahead.velocity
    extent = max(one.section.extent, other.section.extent)
    touching = gap <= _SAMPLING * extent
    if touching and (closing >= 0.0 or gap < -_SAMPLING * extent):
        return 0.0
    return gap / closing if closing > 0.0 else math.inf


def plane_times(boundary: Boundary, body: Body) -> tuple[float, float]:
    """Return when a body that keeps its velocity comes to each plane [s].

    Parameters
    ----------
    boundary : Boundary
    body : Body

    Returns
    -------
    tuple of float
        Of the lower and the upper plane; infinite where it never does.
    """
    (low, high), (bottom, top) = boundary.planes, body.section.ends
    gaps, speeds = (bottom - low, high - top), (-body.velocity, body.velocity)
    # A gap below zero is the rounding of a body that touches.
    lower, upper = (
        max(gap, 0.0) / speed if speed > 0.0 else math.inf
        for gap, speed in zip(gaps, speeds, strict=True)
    )
    return lower, upper


def _gap(one: Body, other: Body, anywhere: bool) -> tuple[float, Body, Body]:
    """Return the least distance along z, the body at the lower z, and the other.

    It is negative where one lies within the hollow of the other, infinite where no
    radius has both.
    """
    first, second = sorted((one, other), key=lambda body: sum(body.section.ends))
    lower, upper = first.section, second.section
    if anywhere:
        return upper.ends[0] - lower.ends[1], first, second
    inner = max(_narrowest(lower), _narrowest(upper))
    outer = min(lower.widest, upper.widest)
    if inner >= outer:
        return math.inf, first, second
    r = np.linspace(inner, outer, _RADII)
    tops, bottoms = _surfaces(lower, r)[1], _surfaces(upper, r)[0]
    return float((bottoms - tops).min()), first, second


def _narrowest(section: Section) -> float:
    return float(section.radii(_sampled_heights(section))[0].min())


def _surfaces(section: Section, r: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and the highest z of a section at radii [m]."""
    z = _sampled_heights(section)
    inner, outer = section.radii(z)
    within = (inner[:, None] <= r) & (r <= outer[:, None])
    lowest = np.where(within, z[:, None], math.inf).min(axis=0)
    highest = np.where(within, z[:, None], -math.inf).max(axis=0)
    return lowest, highest


def _sampled_heights(section: Section) -> FloatArray:
    return np.unique([*np.linspace(*section.ends, _HEIGHTS), *section.knots])
