"""Craters of metal spheres in thick metal targets: fits to experiments.

References
----------
Cour-Palais (1987), Int. J. Impact Engng 5, 221-237, as in Christiansen et al. (2009),
NASA/TM-2009-214785: depth of craters.
Love, Brownlee, King, Hoerz (1995), Int. J. Impact Engng 16, 405-418: their shape.
"""

import math

SHALLOWEST, DEEPEST = 0.56, 0.60
"""Depth over diameter of craters in aluminium above 5 km/s, of any hardness."""


def crater_depth(
    diameter: float,
    density: float,
    velocity: float,
    target_density: float,
    hardness: float,
    sound_speed: float,
) -> float:
    """Return the depth of a crater below the face of its target [m].

    With lengths in cm it is ``5.24 d**(19/18) H**(-1/4) (rho_p/rho_t)**(1/2) (V/C)**
    (2/3)``.

    Parameters
    ----------
    diameter : float
        Of the sphere [m].
    density : float
        Of the sphere [kg/m3].
    velocity : float
        [m/s].
    target_density : float
        [kg/m3].
    hardness : float
        Of the target, by Brinell.
    sound_speed : float
        Of a bar of the target's metal [m/s].
    """
    cm: float = 5.24 * (100.0 * diameter) ** (19.0 / 18.0) * hardness**-0.25
    cm *= math.sqrt(density / target_density) * (velocity / sound_speed) ** (2.0 / 3.0)
    return 0.01 * cm
