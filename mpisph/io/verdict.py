"""Records of a shield's wall and of the verdict on it, for ``result.json``."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

__all__ = ["FAILED", "Outcome", "Verdict", "WallRecord"]

Outcome = Literal["holds", "perforated", "detached spall", "undecided"]

FAILED: tuple[Outcome, ...] = ("perforated", "detached spall")
"""What counts as a failure of the wall (P in reports of tests)."""


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="strings")


class WallRecord(_Model):
    """The rear wall of a shield at one time."""

    time: float
    """[s]."""
    shear: float
    """Largest difference of the rear face's displacements over a way along it of one
    thickness, in thicknesses."""
    ligament: float
    """Least share of sound matter on any way through the wall."""
    sound_share: float
    """Least share of sound matter straight through the wall."""
    hole: float
    """Diameter of the hole in the sound wall [m]."""
    detached: float
    """Mass of what has come off behind the rear face, of any body [kg]."""
    detached_velocity: float
    """Mean axial velocity of that [m/s]."""
    detached_momentum: float
    """Axial momentum of that [kg m/s]."""
    bulge: float
    """Largest displacement of the rear face [m]."""
    crater_depth: float
    """Depth of the crater below the front face, displaced as the rear one is [m]."""
    crater_diameter: float
    """Diameter of the crater in that face [m]."""
    velocity: float
    """Largest axial speed of the sound wall, as the mean of a way through it [m/s]."""


class Verdict(_Model):
    """Whether the wall holds."""

    outcome: Outcome
    """What the wall does."""
    reason: str
    """What decides it, in words."""
    damage: float
    """The figure that decides over its critical value: more than 1 fails."""
    rest_time: float | None
    """Time from which the rear face no longer moves [s]; None where it still does."""
    earlier: Outcome
    """The outcome by the same rule at an earlier time of the run."""
    wall: WallRecord | None
    """The wall at the end."""
