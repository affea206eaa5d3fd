"""Spall of a plate: what its rear face tells, for a crack that opens against a tension.

In a symmetric impact the release of the flyer's rear face meets that of the target's
where the remaining target is as thick as the flyer was. From there on the tension would
be the pressure of the impact. A crack that takes energy lets through less and less.

References
----------
Antoun, Seaman, Curran, Kanel, Razorenov, Utkin (2003), Spall Fracture, Springer,
section 2: strength ``rho c du/2`` from the pull-back ``du`` of the rear face.
Romanchenko, Stepanov (1980), J. Appl. Mech. Tech. Phys. 21, 555-561: with strength.
"""

import math
from typing import NamedTuple

from mpisph.verify.exact.shocks import Matter

_STEPS = 1000
# Of an isentrope; the error falls with their square.


def velocity_in_tension(matter: Matter, tension: float) -> float:
    """Return the change of velocity in a wave that puts matter under tension [m/s].

    It is the integral of ``dP/(rho c)`` along the isentrope from rest, near ``tension/
    (rho c)``.

    Parameters
    ----------
    matter : Matter
        A fluid.
    tension : float
        [Pa].

    Raises
    ------
    ValueError
        If the equation of state has no such tension.
    """
    density, energy, P, velocity = matter.density, 0.0, 0.0, 0.0
    step = -tension / _STEPS
    slope = (matter.pressure(density * (1.0 + 1e-6), 0.0) - P) / (density * 1e-6)
    for _ in range(_STEPS):
        for _ in range(3):
            change = step / slope
            middle = density + 0.5 * change
            gained = (P + 0.5 * step) / middle**2 * change
            reached = matter.pressure(density + change, energy + gained) - P
            slope = reached / change
            if slope <= 0.0:
                raise ValueError(f"no tension of {tension:g} Pa")
        change = step / slope
        velocity += math.sqrt(step * change) / (density + 0.5 * change)
        density += change
        energy += (P + 0.5 * step) / (density - 0.5 * change) ** 2 * change
        P += step
    return velocity


def pull_back_of_solid(
    tension: float, density: float, bulk_speed: float, longitudinal_speed: float
) -> float:
    """Return the pull-back of a plate of an elastic, plastic solid [m/s].

    The release that the crack stops is a plastic wave, of the bulk sound speed; what
    comes from the crack is an elastic one and runs faster: the tension is ``rho du c_b
    c_l/(c_b + c_l)``.

    Parameters
    ----------
    tension : float
        Along the motion [Pa].
    density : float
        [kg/m3].
    bulk_speed, longitudinal_speed : float
        [m/s].
    """
    return tension / density * (1.0 / bulk_speed + 1.0 / longitudinal_speed)


class Crack(NamedTuple):
    """A plane crack that opens between acoustic waves.

    Its tension falls from the strength to zero as it opens, in proportion. The waves
    would give a constant tension without it, and open it by ``2 (load - tension)/(rho
    c)`` a time.

    Attributes
    ----------
    load : float
        Tension without a crack, above the strength [Pa].
    strength : float
        [Pa].
    energy : float
        That an area takes [J/m2].
    impedance : float
        ``rho c`` [kg/m2/s].
    """

    load: float
    strength: float
    energy: float
    impedance: float

    @property
    def _growth(self) -> float:
        """Time in which the opening grows by a factor of e [s]."""
        return self.impedance * self.energy / self.strength**2

    @property
    def opened(self) -> float:
        """Time from which on it lets nothing through [s]."""
        return self._growth * math.log(self.load / (self.load - self.strength))

    def tension(self, time: float) -> float:
        """Return the tension at a time since it began to open [Pa]."""
        if not 0.0 <= time <= self.opened:
            return 0.0
        grown = math.exp(time / self._growth)
        return self.load - (self.load - self.strength) * grown

    @property
    def impulse(self) -> float:
        """Integral of the tension, what it takes from a scab's momentum [Pa s]."""
        return self.load * self.opened - self.strength * self._growth
