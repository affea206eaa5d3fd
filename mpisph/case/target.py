"""What is hit, from which side, and what stands behind it."""

from __future__ import annotations

from collections.abc import Sequence

from mpisph.case.bodies import Body, Plate
from mpisph.case.shapes.section import rounding_of

__all__ = [
    "bodies_before",
    "bodies_behind",
    "default_plate",
    "direction_of_impact",
    "front_face",
    "rear_position",
]


def default_plate(bodies: Sequence[Body]) -> Plate | None:
    """Return the plate that is hit first, or of plates that touch it the last.

    Parameters
    ----------
    bodies : sequence of Body
        What is hit is the slowest of the plates, whichever way it moves; of two as
        slow, what moves along -z.

    Returns
    -------
    Plate or None
    """
    plates = [body for body in bodies if isinstance(body, Plate)]
    if not plates:
        return None
    slowest = min(plates, key=lambda plate: (abs(plate.velocity), plate.velocity))
    alike = [plate for plate in plates if plate.velocity == slowest.velocity]
    direction = direction_of_impact(bodies, slowest)
    first, *others = sorted(alike, key=lambda plate: front_face(plate, direction))
    for plate in others:
        rear = front_face(first, direction) + first.thickness
        if abs(front_face(plate, direction) - rear) <= _rounding(first, plate):
            first = plate
    return first


def direction_of_impact(bodies: Sequence[Body], plate: Plate | None) -> float:
    """Return 1.0 where what hits a plate flies along +z, -1.0 along -z."""
    still = 0.0 if plate is None else plate.velocity
    relative = [body.velocity - still for body in bodies]
    return -1.0 if max(relative, key=abs, default=0.0) < 0.0 else 1.0


def front_face(body: Body, direction: float) -> float:
    """Return how far along the direction of the impact a body begins [m]."""
    return min(direction * end for end in body.section.ends)


def rear_position(plate: Plate, direction: float) -> float:
    """Return the axial position of a plate's face away from what hits it [m]."""
    return plate.rear_face if direction > 0.0 else plate.position


def bodies_behind(bodies: Sequence[Body], plate: Plate) -> list[int]:
    """Return the indices of the bodies that lie wholly behind a plate, nearest first.

    Parameters
    ----------
    bodies : sequence of Body
    plate : Plate
        One of them.
    """
    direction = direction_of_impact(bodies, plate)
    rear = front_face(plate, direction) + plate.thickness
    begins = [front_face(body, direction) for body in bodies]
    behind = [
        k
        for k, body in enumerate(bodies)
        if body is not plate and begins[k] >= rear - _rounding(plate, body)
    ]
    return sorted(behind, key=lambda k: begins[k])


def bodies_before(
    bodies: Sequence[Body], which: int, direction: float
) -> tuple[int, ...]:
    """Return the indices of the bodies that lie wholly before one of them."""
    begin = front_face(bodies[which], direction)
    ends = [-front_face(body, -direction) for body in bodies]
    return tuple(
        k
        for k, body in enumerate(bodies)
        if k != which and ends[k] <= begin + _rounding(bodies[which], body)
    )


def _rounding(one: Body, other: Body) -> float:
    return rounding_of(*one.section.ends, *other.section.ends)
