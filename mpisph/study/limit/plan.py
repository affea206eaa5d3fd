"""What is sought at which points, and the case of a shield at each try."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from scipy.optimize import brentq

from mpisph.analysis.ballistic import Whipple, critical_diameter
from mpisph.case import Case, CaseSource
from mpisph.case.identity import case_key
from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.quantities import si_value
from mpisph.inputs.spelling import nearest
from mpisph.materials.alloys import card_yield

__all__ = [
    "QUANTITIES",
    "Plan",
    "Point",
    "Quantity",
    "Try",
    "equation_limit",
    "first_guess",
    "make_plan",
    "make_try",
    "parse_between",
    "parse_points",
    "whipple",
]


class Quantity(NamedTuple):
    """What a limit may be sought in, or along.

    Attributes
    ----------
    name, label : str
        For options, and for people.
    key : str
        Of the case.
    si, unit : str
        SI unit, and the one that is shown.
    scale : float
        Of the latter in the former.
    harder : int
        1 where more is harder to stop, -1 where less is, 0 where that is not said.
    """

    name: str
    label: str
    key: str
    si: str
    unit: str
    scale: float
    harder: int


_MM, _KM_PER_S = 1e-3, 1e3

QUANTITIES = {
    q.name: q
    for q in (
        Quantity(
            "diameter", "diameter of the projectile", "shield.projectile.diameter",
            "m", "mm", _MM, 1,
        ),
        Quantity(
            "velocity", "impact velocity", "shield.projectile.velocity",
            "m/s", "km/s", _KM_PER_S, 1,
        ),
        Quantity(
            "thickness", "thickness of the wall", "shield.wall.thickness",
            "m", "mm", _MM, -1,
        ),
        Quantity(
            "standoff", "standoff", "shield.bumpers.0.standoff", "m", "mm", _MM, 0
        ),
    )
}  # fmt: skip
"""By the name that the options of `mpisph limit` take."""


class Point(NamedTuple):
    """A point of the limit: the value along the axis, None for that of the case."""

    at: float | None


class Plan(NamedTuple):
    """What is sought.

    Attributes
    ----------
    source : CaseSource
        The case, of which variants are made.
    overrides : tuple of str
        Of all of them.
    case : Case
        With these.
    find : Quantity
    along : Quantity or None
    points : tuple of Point
    between : tuple of float, or None
        Values between which the limit is sought at first [SI].
    """

    source: CaseSource
    overrides: tuple[str, ...]
    case: Case
    find: Quantity
    along: Quantity | None
    points: tuple[Point, ...]
    between: tuple[float, float] | None


class Try(NamedTuple):
    """A run of a search.

    Attributes
    ----------
    point : int
        Number of the point.
    value : float
        Of the quantity that is sought [SI].
    case : Case
    key : str
        See `case_key`.
    """

    point: int
    value: float
    case: Case
    key: str


def parse_points(text: str) -> tuple[Quantity, list[float]]:
    """Return the quantity and the values of an option such as ``velocity=2,3,4km/s``.

    A number without a unit takes that of the last one.

    Parameters
    ----------
    text : str

    Raises
    ------
    ValueError
        With what was expected.
    """
    name, separator, listed = text.partition("=")
    name = name.strip()
    if name not in QUANTITIES:
        guess = nearest(name, QUANTITIES)
        hint = f"; did you mean {guess}?" if guess else ""
        raise ValueError(f"expected one of {', '.join(QUANTITIES)}{hint}")
    quantity = QUANTITIES[name]
    words = [word.strip() for word in listed.split(",")]
    if not separator or not all(words):
        raise ValueError(f"expected values, such as {name}=2,3,4{quantity.unit}")
    return quantity, [parse_value(word, quantity, words[-1]) for word in words]


def parse_value(word: str, quantity: Quantity, last: str = "") -> float:
    """Return a positive value [SI]; without a unit it has that of another one.

    Raises
    ------
    ValueError
        With what was expected.
    """
    number, unit = _split(word)
    unit = unit or _split(last)[1] or quantity.unit
    try:
        value = si_value(f"{number} {unit}", quantity.si)
    except ValueError as error:
        raise ValueError(f"{word!r}: {error}") from None
    if not value > 0.0:
        raise ValueError(f"{word!r}: expected more than 0")
    return value


def _split(word: str) -> tuple[str, str]:
    """Return a number and its unit as text."""
    end = len(word)
    while end > 0 and not _is_number(word[:end]):
        end -= 1
    return word[:end].strip(), word[end:].strip()


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def make_plan(
    source: CaseSource,
    overrides: Sequence[str],
    find: Quantity,
    along: tuple[Quantity, Sequence[float]] | None,
    between: tuple[float, float] | None,
) -> Plan:
    """Return what is sought; every point's first case is checked.

    Parameters
    ----------
    source : CaseSource
    overrides : sequence of str
    find : Quantity
    along : tuple of Quantity and values, optional
        By default one point, of the case as it is.
    between : tuple of float, optional
        [SI].

    Raises
    ------
    CaseError
        If the case is not sound or has no shield, or at a value of `along`.
    """
    case = source.case(overrides)
    if case.shield is None:
        text = "required: `mpisph limit` seeks the limit of a shield"
        raise CaseError([Problem(text, file=str(source.path), key="shield")])
    if along is not None and along[0] == find:
        raise CaseError([Problem(f"{find.name} is sought: it cannot be the axis too")])
    values = dict.fromkeys(along[1]) if along else [None]
    plan = Plan(
        source,
        tuple(overrides),
        case,
        find,
        along[0] if along else None,
        tuple(Point(value) for value in values),
        between,
    )
    for number in range(len(plan.points)):
        make_try(plan, number, first_guess(plan, number))
    return plan


def make_try(plan: Plan, point: int, value: float) -> Try:
    """Return the case of a try.

    Raises
    ------
    CaseError
        If it is not sound.
    """
    own = [] if plan.along is None else [_setting(plan.along, plan.points[point].at)]
    case = plan.source.case([*plan.overrides, *own, _setting(plan.find, value)])
    return Try(point, value, case, case_key(case))


def _setting(quantity: Quantity, value: float | None) -> str:
    assert value is not None, "a point along an axis has a value"
    return f"{quantity.key}={value:.12g}"


def whipple(case: Case) -> Whipple | None:
    """Return a shield for Christiansen's equation.

    None where it has not one bumper, or the yield of the wall's alloy is not listed.
    """
    shield = case.shield
    if shield is None or len(shield.bumpers) != 1:
        return None
    strength = card_yield(shield.wall.material)
    if strength is None:
        return None
    rho = [case.body_models(body).rest_density for body in case.bodies]
    (bumper,) = shield.bumpers
    return Whipple(
        bumper.thickness, rho[1], bumper.standoff, shield.wall.thickness, strength,
        rho[0],
    )  # fmt: skip


def first_guess(plan: Plan, point: int) -> float:
    """Return where to begin: the equation's limit where there is one, else the case's.

    Parameters
    ----------
    plan : Plan
    point : int
    """
    if plan.between is not None:
        return math.sqrt(plan.between[0] * plan.between[1])
    value = equation_limit(plan, point)
    own = _own_value(plan)
    return own if value is None else float(f"{value:.4g}")


def _own_value(plan: Plan) -> float:
    shield = plan.case.shield
    assert shield is not None, "checked"
    return {
        "diameter": shield.projectile.diameter,
        "velocity": shield.projectile.velocity,
        "thickness": shield.wall.thickness,
    }[plan.find.name]


def equation_limit(plan: Plan, point: int) -> float | None:
    """Return the limit by Christiansen's equation [SI]; None where it has none.

    Of velocities there may be several.

    Parameters
    ----------
    plan : Plan
    point : int
    """
    wall = whipple(plan.case)
    shield = plan.case.shield
    if wall is None or shield is None or plan.find.name == "velocity":
        return None
    projectile = shield.projectile
    velocity, diameter = projectile.velocity, projectile.diameter
    at = plan.points[point].at
    if plan.along is not None and at is not None:
        name = plan.along.name
        velocity = at if name == "velocity" else velocity
        diameter = at if name == "diameter" else diameter
        if name == "thickness":
            wall = wall._replace(wall_thickness=at)
        elif name == "standoff":
            wall = wall._replace(standoff=at)
    if plan.find.name == "diameter":
        return float(critical_diameter(wall, velocity))

    def excess(thickness: float) -> float:
        stronger = wall._replace(wall_thickness=thickness)
        return float(critical_diameter(stronger, velocity)) - diameter

    low, high = 1e-3 * diameter, 30.0 * diameter
    if excess(low) >= 0.0 or excess(high) <= 0.0:
        return None
    return float(brentq(excess, low, high, rtol=1e-6))


def parse_between(text: str, quantity: Quantity) -> tuple[float, float]:
    """Return the ends of an option such as ``2,6mm`` [SI].

    Raises
    ------
    ValueError
        With what was expected.
    """
    words = [word.strip() for word in text.split(",")]
    if len(words) != 2 or not all(words):
        raise ValueError(f"expected two values, such as 2,6{quantity.unit}")
    low, high = sorted(parse_value(word, quantity, words[-1]) for word in words)
    if low == high:
        raise ValueError("expected two different values")
    return low, high
