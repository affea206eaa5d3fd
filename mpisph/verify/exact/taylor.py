"""Taylor's test of a rod that hits a rigid wall without friction.

References
----------
Wilkins and Guinan (1973), J. Appl. Phys. 44, 1200-1206.
"""

import math

FOOT = 0.12
"""Height of the plastic zone at the wall over the length of the rod."""


def final_length(
    length: float, density: float, yield_strength: float, velocity: float
) -> float:
    """Return the length of a perfectly plastic rod after its impact [m].

    A plastic front stands at the height ``FOOT L0`` above the wall, and the matter
    that comes to it is brought to rest by the yield strength: ``rho (L - FOOT L0)
    dU/dt = -Y`` and ``dL/dt = -U`` give ``(L - FOOT L0)/(L0 (1 - FOOT)) = exp(-rho
    U**2/(2 Y))``. It is a fit to computed rods, no exact solution.

    Parameters
    ----------
    length : float
        At the start [m].
    density : float
        [kg/m3].
    yield_strength : float
        [Pa].
    velocity : float
        Of the impact [m/s].
    """
    shorter = math.exp(-density * velocity**2 / (2.0 * yield_strength))
    return length * ((1.0 - FOOT) * shorter + FOOT)
