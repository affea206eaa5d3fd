"""Whether the wall of a shield holds: the rule, and what it says of a run.

A sheet tears where its rear face is tilted, over a way of one thickness, by more than
the elongation at break of its alloy. A block, which does not bend, is perforated where
less than `BLOCK_LIGAMENT` of it stays sound. Either is perforated by a hole, and fails
by spall where more than a grain has come off behind it.
"""

from __future__ import annotations

from collections.abc import Sequence

from mpisph.case.model import Case
from mpisph.case.shield import is_block
from mpisph.io.verdict import FAILED, Outcome, Verdict, WallRecord

__all__ = [
    "BLOCK_LIGAMENT",
    "GRAIN",
    "MARGIN",
    "damage_ratio",
    "judge",
    "judge_wall",
    "rest_time",
]

BLOCK_LIGAMENT = 1.0 - 1.0 / 1.8
"""Least sound share of a block that is not perforated: the thickness that a crater of a
depth P does not perforate is 1.8 P (Christiansen 2009, NASA/TP-2009-214785)."""

GRAIN = 0.1
"""Least mass that counts as detached spall, over density times thickness cubed: a scab
a third of the thickness thick and half of it wide has twice as much."""

MARGIN = 0.02
"""Relative distance from the critical value within which nothing is decided: as much as
a change of the time step alters it."""

AT_REST = 0.02
"""Change of the bulge, in thicknesses of the wall, that still counts as rest."""


def damage_ratio(case: Case, wall: WallRecord) -> float | None:
    """Return the figure that decides over its critical value.

    Parameters
    ----------
    case : Case
        With a shield.
    wall : WallRecord

    Returns
    -------
    float or None
        More than 1 fails; None where the alloy's elongation is not known.
    """
    shield = case.shield
    assert shield is not None, "only shields are judged"
    ratio = _load(case, wall)
    if ratio is None:
        return None
    detached = wall.detached / _grain(case)
    # A mass is compared by the length of a piece of it.
    ratio = max(ratio, detached ** (1.0 / 3.0) if detached > 1.0 else 0.0)
    if wall.hole > 0.0:
        ratio = max(ratio, 1.0 + wall.hole / shield.wall.thickness)
    return ratio


def _load(case: Case, wall: WallRecord) -> float | None:
    """Return what a sheet is tilted, or a block has lost, over what it bears.

    None where the elongation of a sheet's alloy is not known.
    """
    shield = case.shield
    assert shield is not None, "only shields are judged"
    if is_block(shield):
        return (1.0 - wall.ligament) / (1.0 - BLOCK_LIGAMENT)
    elongation = case.materials[shield.wall.material].elongation
    return None if elongation is None else wall.shear / elongation


def judge_wall(case: Case, wall: WallRecord) -> tuple[Outcome, str]:
    """Return what the rule says of the wall at one time, and what decides it.

    Parameters
    ----------
    case : Case
        With a shield.
    wall : WallRecord
    """
    shield = case.shield
    assert shield is not None, "only shields are judged"
    if wall.hole > 0.0:
        return "perforated", f"there is a hole of {_mm(wall.hole)} in the wall"
    load = _load(case, wall)
    if load is None:
        material = shield.wall.material
        text = f"the elongation at break of {material} is not known"
        return "undecided", f"{text}: give it as materials.{material}.elongation"
    if is_block(shield):
        text = f"{_percent(wall.ligament)} of the way through the block is sound"
        limit = f"{_percent(BLOCK_LIGAMENT)} hold"
    else:
        elongation = case.materials[shield.wall.material].elongation
        text = f"the rear face is tilted by {wall.shear:.3g} along a thickness"
        limit = f"the alloy stretches by {elongation:g}"
    if load > 1.0 + MARGIN:
        return "perforated", f"{text}, and {limit}"
    if wall.detached > _grain(case):
        mass = f"{1e3 * wall.detached:.3g} g"
        speed = f"{wall.detached_velocity:.3g} m/s"
        return "detached spall", f"{mass} have come off the rear face, at {speed}"
    if load >= 1.0 - MARGIN:
        return "undecided", f"{text}, and {limit}: too near to tell"
    return "holds", f"{text}, and {limit}"


def judge(case: Case, walls: Sequence[WallRecord], unstable: str | None) -> Verdict:
    """Return the verdict on the wall.

    Parameters
    ----------
    case : Case
        With a shield.
    walls : sequence of WallRecord
        At the output times reached.
    unstable : str or None
        Why the run broke down, if it did.
    """
    if not walls or unstable is not None:
        reason = "the run was stopped" if unstable is None else "the run broke down"
        last = walls[-1] if walls else None
        return Verdict(
            outcome="undecided",
            reason=reason if unstable is None else f"{reason}: {unstable}",
            damage=(damage_ratio(case, last) or 0.0) if last else 0.0,
            rest_time=None,
            earlier="undecided",
            wall=last,
        )
    last = walls[-1]
    before = [wall for wall in walls if wall.time <= case.verdict_time * (1.0 + 1e-9)]
    outcome, reason = judge_wall(case, last)
    earlier = judge_wall(case, before[-1])[0] if before else outcome
    if (earlier in FAILED) != (outcome in FAILED) and "undecided" not in (
        earlier,
        outcome,
    ):
        reason = (
            f"{earlier} at {_us(before[-1].time)}, {outcome} at {_us(last.time)}: the "
            "wall has not come to rest; let the run last longer (time.end)"
        )
        outcome = "undecided"
    return Verdict(
        outcome=outcome,
        reason=reason,
        damage=damage_ratio(case, last) or 0.0,
        rest_time=rest_time(case, walls),
        earlier=earlier,
        wall=last,
    )


def rest_time(case: Case, walls: Sequence[WallRecord]) -> float | None:
    """Return the first time from which the rear face stays where it is at the end [s].

    Parameters
    ----------
    case : Case
        With a shield.
    walls : sequence of WallRecord
        By time.

    Returns
    -------
    float or None
        None where it has moved since the last time but one.
    """
    assert case.shield is not None, "only shields are judged"
    allowed = AT_REST * case.shield.wall.thickness
    found = None
    for wall in reversed(walls):
        if abs(wall.bulge - walls[-1].bulge) > allowed:
            break
        found = wall.time
    return None if found is None or found >= walls[-1].time else found


def _grain(case: Case) -> float:
    """Return the least mass that counts as detached spall [kg]."""
    assert case.shield is not None, "only shields are judged"
    wall = case.shield.wall
    density: float = case.body_models(case.bodies[-1]).rest_density
    return GRAIN * density * wall.thickness**3


def _mm(length: float) -> str:
    return f"{1e3 * length:.3g} mm"


def _us(time: float) -> str:
    return f"{1e6 * time:.3g} us"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %"
