"""Taylor's test of a rod that hits a rigid wall without friction.

References
----------
Wilkins and Guinan (1973), J. Appl. Phys. 44, 1200-1206.
Gust (1982), J. Appl. Phys. 53, 3566-3575.
House, Lewis, Gillis, Wilson (1995), Int. J. Impact Eng. 16, 189-200.
"""

import math

from scipy.optimize import least_squares

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


RODS_6061_T6 = {
    "Wilkins and Guinan (1973)": (
        (50.0, 0.993), (169.0, 0.920), (191.0, 0.906), (262.0, 0.844), (283.0, 0.806),
        (306.0, 0.784), (373.0, 0.703), (478.0, 0.562), (603.0, 0.370), (51.0, 0.995),
        (69.0, 0.988), (90.0, 0.978), (132.0, 0.952), (207.0, 0.888), (275.0, 0.823),
        (367.0, 0.722), (412.0, 0.660), (434.0, 0.626), (484.0, 0.552), (222.0, 0.896),
        (236.0, 0.888), (244.0, 0.876), (262.0, 0.852), (285.0, 0.814), (324.0, 0.773),
        (482.0, 0.561), (580.0, 0.404), (591.0, 0.412),
    ),
    "Gust (1982)": (
        (252.0, 0.848), (257.0, 0.841), (361.0, 0.717), (406.0, 0.663), (200.0, 0.903),
        (358.0, 0.735),
    ),
    "House et al. (1995)": (
        (227.0, 0.895), (235.0, 0.869), (339.0, 0.729), (212.0, 0.895), (224.0, 0.876),
        (240.0, 0.849), (263.0, 0.823), (328.0, 0.750), (248.0, 0.851), (279.0, 0.812),
        (226.0, 0.872), (231.0, 0.853), (282.0, 0.810), (170.0, 0.916), (244.0, 0.861),
        (295.0, 0.787), (236.0, 0.869), (242.0, 0.851), (251.0, 0.851), (276.0, 0.815),
        (235.0, 0.876), (256.0, 0.840), (271.0, 0.829),
    ),
}  # fmt: skip
"""Measured rods of 6061-T6 at 295 K: velocities [m/s], lengths over the first ones.

Their lengths are 1.5 to 11 diameters. As listed by B. Banerjee in
``TaylorData/MATLAB/plot6061T6Al.m`` of github.com/bbanerjee/HighRateExptData.
"""


def stopped_length(density: float, strength: float, velocity: float) -> float:
    """Return the length over the first one of a rod that a constant stress stops.

    ``L/L0 = exp(-rho U**2/(2 Y))``: `final_length` with the plastic front at the wall.
    """
    return math.exp(-density * velocity**2 / (2.0 * strength))


def strength_of(density: float) -> float:
    """Return the stress with which `stopped_length` fits `RODS_6061_T6` best [Pa].

    The lengths scatter by 0.010 L0 about it (root mean square), at most by 0.023 L0.
    """
    rods = [rod for rods in RODS_6061_T6.values() for rod in rods]

    def misses(strength: float) -> list[float]:
        return [stopped_length(density, strength, U) - ratio for U, ratio in rods]

    scale = 1e9
    found = least_squares(lambda x: misses(scale * x[0]), [0.5])
    return float(scale * found.x[0])
