"""When the cloud of a shield reaches the wall, and which moments of a run to show."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case.model import Case
from mpisph.case.times import same_time
from mpisph.diagnostics.probes import BODY_QUANTITIES
from mpisph.diagnostics.series import column_name
from mpisph.io.verdict import WallRecord

__all__ = [
    "ARRIVED",
    "MOMENTUM",
    "Moment",
    "cloud_moments",
    "wall_arrival",
    "wall_moments",
]

MOMENTUM = next(
    quantity for quantity in BODY_QUANTITIES if quantity.name == "momentum_z"
)
"""What the bodies exchange."""

ARRIVED = 0.01
"""Share of the projectile's momentum by which the wall shows that it is hit."""

_THROUGH = 2.0
# Times of flight through the projectile and the first bumper after which these have
# become a cloud.


class Moment(NamedTuple):
    """A time of a run that is shown.

    Attributes
    ----------
    number : int
        Of the snapshot or record that is shown, from 0.
    words : str
        What happens then.
    """

    number: int
    words: str


def wall_arrival(case: Case, bodies: npt.NDArray[Any]) -> float | None:
    """Return when the cloud has reached the wall [s]; None where it has not.

    Parameters
    ----------
    case : Case
        With a shield.
    bodies : structured ndarray, shape (lines,)
        From ``bodies.csv``.
    """
    assert case.shield is not None, "only shields have a wall"
    if not bodies.size:
        return None
    projectile, wall = (
        bodies[column_name(MOMENTUM, case.bodies[k].name)] for k in (0, -1)
    )
    hit = np.flatnonzero(wall > ARRIVED * projectile[0])
    return float(bodies["time_s"][hit[0]]) if hit.size else None


def cloud_moments(
    case: Case, times: Sequence[float], arrival: float | None
) -> list[Moment]:
    """Choose the times at which a cut through the shield is shown.

    The cloud behind the first bumper; halfway to the wall; its arrival there; the end.

    Parameters
    ----------
    case : Case
        With a shield.
    times : sequence of float
        Of the snapshots, rising [s].
    arrival : float or None
        From `wall_arrival`.

    Returns
    -------
    list of Moment
        Each snapshot once; fewer of a run that has few.
    """
    shield = case.shield
    assert shield is not None, "only shields are cut"
    projectile, first = shield.projectile, shield.bumpers[0]
    through = _THROUGH * (projectile.diameter + first.thickness) / projectile.velocity
    bumper = "bumper" if len(shield.bumpers) == 1 else "first bumper"
    start = _first(times, through)
    chosen = [Moment(start, f"behind the {bumper}")]
    if arrival is not None:
        middle = 0.5 * (times[start] + arrival)
        halfway = int(np.argmin(np.abs(np.asarray(times) - middle)))
        chosen.append(Moment(halfway, "halfway to the wall"))
        chosen.append(Moment(_first(times, arrival), "at the wall"))
    chosen.append(Moment(len(times) - 1, "at the end"))
    return _once(chosen)


def wall_moments(case: Case, walls: Sequence[WallRecord]) -> list[Moment]:
    """Choose the times at which the wall is shown close by.

    While it is loaded, when it moves fastest; at the earlier of the verdicts; the end.

    Parameters
    ----------
    case : Case
        With a shield.
    walls : sequence of WallRecord
        By time.

    Returns
    -------
    list of Moment
        Each record once; fewer of a run that has few.
    """
    fastest = int(np.argmax([wall.velocity for wall in walls]))
    chosen = [Moment(fastest, "loaded")]
    chosen += [
        Moment(number, "earlier verdict")
        for number, wall in enumerate(walls)
        if same_time(wall.time, case.verdict_time)
    ]
    chosen.append(Moment(len(walls) - 1, "end"))
    return _once(chosen)


def _first(times: Sequence[float], wanted: float) -> int:
    """Return the index of the first time that is not before another; else the last."""
    return min(int(np.searchsorted(times, wanted)), len(times) - 1)


def _once(chosen: Sequence[Moment]) -> list[Moment]:
    """Return the moments by time, each number once: what is said last of it counts."""
    by_number = {moment.number: moment for moment in chosen}
    return [by_number[number] for number in sorted(by_number)]
