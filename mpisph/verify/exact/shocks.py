"""Plane shocks in matter with any equation of state, elastic and perfectly plastic.

The jump conditions of Rankine and Hugoniot are solved for the pressure as it is
programmed. Slow impacts give two waves: an elastic precursor to the Hugoniot elastic
limit, and a plastic shock behind it; above a certain velocity the plastic shock
overtakes the precursor.

References
----------
Davison (2008), Fundamentals of Shock Wave Propagation in Solids, Springer, chapters 3
and 7.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from scipy.optimize import brentq

from mpisph.physics.eos import pressure
from mpisph.physics.response import MaterialModels, material_table

_DENSEST = 10.0
# Largest compression that is looked at.

_ROUNDING = 1e-14


class Matter(NamedTuple):
    """What shocks ask of a material.

    Attributes
    ----------
    density : float
        At rest [kg/m3].
    pressure : callable
        Of density [kg/m3] and energy [J/kg], returns [Pa].
    shear_modulus, yield_strength : float
        [Pa]; both zero for a fluid.
    """

    density: float
    pressure: Callable[[float, float], float]
    shear_modulus: float = 0.0
    yield_strength: float = 0.0


class Shocked(NamedTuple):
    """Matter behind a plane shock that runs into matter at rest or behind another.

    Attributes
    ----------
    speed : float
        Of the shock, in the frame of the matter at rest [m/s].
    velocity : float
        Of the matter behind it, in the same frame [m/s].
    density : float
        [kg/m3].
    energy : float
        Internal energy, with the elastic energy [J/kg].
    pressure : float
        [Pa].
    stress : float
        Compressive stress along the motion [Pa].
    """

    speed: float
    velocity: float
    density: float
    energy: float
    pressure: float
    stress: float


def matter_of(models: MaterialModels) -> Matter:
    """Return a material of a case, with its equation of state as programmed.

    Pores count in the density at rest alone: the shocks that are looked for crush them
    all, and what is behind has the pressure of the solid.
    """
    (row,) = material_table([models])

    def of(density: float, energy: float) -> float:
        return float(pressure(density, energy, row)[0])

    solid = models.names["strength"] == "elastic-plastic"
    strength = models.constants.get("elastic-plastic") if solid else None
    return Matter(
        models.rest_density,
        of,
        getattr(strength, "shear_modulus", 0.0),
        getattr(strength, "yield_strength", 0.0),
    )


def sound_speed(matter: Matter, state: Shocked) -> float:
    """Return the speed at which a release overtakes the shock, without strength [m/s].

    It is the slope of the isentrope, by a central difference.
    """
    small = 1e-5
    step = small * state.density
    work = state.pressure / state.density * small
    high = matter.pressure(state.density + step, state.energy + work)
    low = matter.pressure(state.density - step, state.energy - work)
    return math.sqrt((high - low) / (2.0 * step))


def elastic_limit(matter: Matter) -> Shocked:
    """Return the state behind an elastic precursor, the Hugoniot elastic limit.

    The stress rate of Jaumann in uniaxial strain integrates to a deviator of
    ``(4 G/3) ln(rho/rho0)``; it meets the yield strength at ``rho0 exp(Y/(2 G))``.
    For small strains the stress is ``Y (K + 4 G/3)/(2 G)`` and the speed
    ``sqrt((K + 4 G/3)/rho0)``.

    Raises
    ------
    ValueError
        For a fluid.
    """
    if not matter.shear_modulus:
        raise ValueError("a fluid has no elastic limit")
    strain = matter.yield_strength / (2.0 * matter.shear_modulus)
    density = matter.density * math.exp(strain)
    deviator = 2.0 / 3.0 * matter.yield_strength
    shortening = -math.expm1(-strain)

    def excess(energy: float) -> float:
        stress = matter.pressure(density, energy) + deviator
        return energy - 0.5 * stress * shortening / matter.density

    # The stress depends on energy weakly, so the root lies near the value at zero.
    top = -4.0 * excess(0.0)
    energy = brentq(excess, 0.0, top, xtol=top * _ROUNDING) if top > 0.0 else 0.0
    velocity = math.sqrt(2.0 * energy)
    P = matter.pressure(density, energy)
    return Shocked(velocity / shortening, velocity, density, energy, P, P + deviator)


def plane_waves(matter: Matter, velocity: float) -> list[Shocked]:
    """Return the states behind the waves that bring matter to a velocity.

    Parameters
    ----------
    matter : Matter
        At rest, without stress.
    velocity : float
        Of the matter behind all waves, positive [m/s].

    Returns
    -------
    list of Shocked
        The precursor first where there is one. The last has the velocity asked for.
    """
    rest = Shocked(0.0, 0.0, matter.density, 0.0, 0.0, 0.0)
    if not matter.shear_modulus:
        return [_shock(matter, rest, velocity, lambda _: 0.0)]
    limit = elastic_limit(matter)
    if velocity <= limit.velocity:
        G = matter.shear_modulus
        rate = 4.0 / 3.0 * G
        return [_shock(matter, rest, velocity, lambda x: rate * math.log(x))]
    deviator = 2.0 / 3.0 * matter.yield_strength
    plastic = _shock(matter, limit, velocity, lambda _: deviator)
    if plastic.speed < limit.speed:
        return [limit, plastic]
    return [_shock(matter, rest, velocity, lambda _: deviator)]


def _shock(
    matter: Matter,
    ahead: Shocked,
    velocity: float,
    deviator: Callable[[float], float],
) -> Shocked:
    """Return the state behind a shock into the state ahead.

    Parameters
    ----------
    deviator : callable
        Deviatoric compressive stress [Pa] of rho/rho0.
    """
    jump = velocity - ahead.velocity

    def behind(x: float) -> Shocked:
        """Return the state of a density, with the energy that the jump gives it."""
        density = x * matter.density
        volume = 1.0 / ahead.density - 1.0 / density
        flow = jump / volume
        stress = ahead.stress + flow * jump
        energy = ahead.energy + 0.5 * (stress + ahead.stress) * volume
        speed = ahead.velocity + flow / ahead.density
        return Shocked(speed, velocity, density, energy, stress - deviator(x), stress)

    def excess(x: float) -> float:
        state = behind(x)
        return matter.pressure(state.density, state.energy) - state.pressure

    low = ahead.density / matter.density * (1.0 + 1e-9)
    # The first root is looked for: beyond it an equation of state may turn over.
    high, step = low, 1e-2
    while excess(high) < 0.0:
        high = min(high * (1.0 + step), _DENSEST)
        if high == _DENSEST:
            raise ValueError(f"no shock gives {velocity:g} m/s")
    return behind(brentq(excess, low, high, xtol=_ROUNDING, rtol=_ROUNDING))


def contact(
    flyer: Matter, target: Matter, velocity: float
) -> tuple[list[Shocked], list[Shocked]]:
    """Return the waves in both bodies of a plane impact.

    Parameters
    ----------
    flyer, target : Matter
    velocity : float
        Of the flyer [m/s].

    Returns
    -------
    tuple of list of Shocked
        Those in the flyer, in its own frame with z reversed, and those in the target.
        The last of each have equal stress, and their velocities add up to that of the
        impact: the contact moves with that of the target.
    """

    def excess(u: float) -> float:
        ours = plane_waves(target, u)[-1].stress
        return ours - plane_waves(flyer, velocity - u)[-1].stress

    tiny = 1e-6 * velocity
    u = brentq(excess, tiny, velocity - tiny, xtol=velocity * _ROUNDING)
    return plane_waves(flyer, velocity - u), plane_waves(target, u)
