"""The state in which a body's particles start: as its keys say, at each place."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case.bodies import Body
from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.expressions import (
    DENSITIES,
    ENERGIES,
    VELOCITIES,
    Profile,
    evaluate,
)
from mpisph.inputs.printing import printable

__all__ = ["PROFILES", "StartingState", "has_expressions", "starting_state"]

FloatArray = npt.NDArray[np.float64]

PROFILES: Mapping[str, Profile] = {
    "radial_velocity": VELOCITIES,
    "density": DENSITIES,
    "energy": ENERGIES,
}
"""Keys of a body that may be expressions."""

_LONGEST = 60


class StartingState(NamedTuple):
    """How particles of a body start.

    Attributes
    ----------
    u_r, u_z : ndarray, shape (n,)
        Velocity [m/s].
    rho : ndarray, shape (n,)
        Density [kg/m^3].
    E : ndarray, shape (n,)
        Specific internal energy [J/kg].
    """

    u_r: FloatArray
    u_z: FloatArray
    rho: FloatArray
    E: FloatArray


def has_expressions(body: Body) -> bool:
    """Say whether any of a body's `PROFILES` is an expression."""
    return any(isinstance(getattr(body, key), str) for key in PROFILES)


def starting_state(
    body: Body, rest_density: FloatArray | float, r: FloatArray, z: FloatArray
) -> StartingState:
    """Return the state of some particles of a body at the start.

    Parameters
    ----------
    body : Body
    rest_density : float or ndarray, shape (n,)
        Density of its material at rest [kg/m^3].
    r, z : ndarray, shape (n,)
        Where they are [m].

    Raises
    ------
    CaseError
        With the first place where an expression is out of its bounds.
    """
    n_r, n_z = body.section.outward(r, z)
    speed, density, energy = (_values(body, key, r, z) for key in PROFILES)
    if body.density is None:
        density = np.full(r.shape, rest_density, np.float64)
    return StartingState(speed * n_r, body.velocity + speed * n_z, density, energy)


_SAMPLES = 9
# Heights of a body, and radii at each, at which an expression is looked at.


def sampled_densities(body: Body, rest_density: float) -> FloatArray:
    """Return densities at the start of a body, from a few places [kg/m^3].

    Parameters
    ----------
    body : Body
    rest_density : float
        Density of its material at rest [kg/m^3], which is returned where an expression
        is out of its bounds: `starting_state` tells of the particle that has it.

    Returns
    -------
    ndarray, shape (n,)
    """
    bottom, top = body.section.ends
    part = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    z = bottom + (top - bottom) * part
    inner, outer = body.section.radii(z)
    r = inner + (outer - inner) * part[:, None]
    z = np.broadcast_to(z, r.shape)
    try:
        return starting_state(body, rest_density, r.ravel(), z.ravel()).rho
    except CaseError:
        return np.full(1, rest_density)


def _values(body: Body, key: str, r: FloatArray, z: FloatArray) -> FloatArray:
    """Return the values of a number or an expression at places."""
    given = getattr(body, key)
    if not isinstance(given, str):
        return np.full(r.shape, math.nan if given is None else given)
    s = np.hypot(r, z - body.section.middle)
    values, bounds = evaluate(given, {"r": r, "z": z, "s": s}), PROFILES[key]
    wrong = np.flatnonzero(~((values >= bounds.low) & (values <= bounds.high)))
    if wrong.size:
        k = wrong[0]
        found = "no number" if math.isnan(values[k]) else f"{values[k]:g}"
        text = (
            f"at r = {r[k]:g} m, z = {z[k]:g} m it is {found}; expected "
            f"{bounds.low:g} to {bounds.high:g} {bounds.unit}"
        )
        value = printable(f'"{given}"', _LONGEST)
        raise CaseError([Problem(text, key=f"bodies.{body.name}.{key}", value=value)])
    return values
