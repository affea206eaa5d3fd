"""Variable smoothing length (R10): equations only.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (20), (21).
"""

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted

FIXED = 0
CLASSIC = 1
AXISYMMETRIC = 2
PRINTED = 3
MODES = {
    "fixed": FIXED,
    "classic": CLASSIC,
    "axisymmetric": AXISYMMETRIC,
    "printed": PRINTED,
}

DIMENSIONS = 2.0
"""N_D of eqs (20), (21): h follows lengths in the r-z plane."""


@jitted(**EXACT)
def smoothing_rate(mode, h, div, hoop, u_r, r):
    """Return dh/dt (R10) [m/s].

    Parameters
    ----------
    mode : int
        One of `MODES`.
    h, r : float
        Smoothing length and radius [m].
    div, hoop : float
        Velocity divergence ``-(drho/dt)/rho`` and its hoop part, as the sums give it
        [1/s].
    u_r : float
        Radial velocity [m/s].
    """
    if mode == FIXED:
        return 0.0
    if mode == CLASSIC:
        return h / DIMENSIONS * div
    if mode == PRINTED:
        return h / DIMENSIONS * (div - u_r / r)
    return h / DIMENSIONS * (div - hoop)
