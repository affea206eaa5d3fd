"""Variable smoothing length (R10): equations only.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (20), (21).
"""

from numba import njit

from mpisph.core.jit import EXACT

FIXED = 0
CLASSIC = 1
AXISYMMETRIC = 2
MODES = {"fixed": FIXED, "classic": CLASSIC, "axisymmetric": AXISYMMETRIC}

DIMENSIONS = 2.0
"""N_D of eqs (20), (21): h follows lengths in the r-z plane."""

AXIS_SOFTENING = 0.01
"""u_r/r is taken as u_r r/(r^2 + (0.01 h)^2): a particle that crosses the axis within
one step would otherwise get an unbounded rate. On the first ring of a lattice (r =
dx/2, h = 2 dx) this changes the rate by 0.2 %."""


@njit(**EXACT)
def smoothing_rate(mode, h, div, u_r, r):
    """Return dh/dt (R10) [m/s]; ``div = -(drho/dt)/rho``.

    Parameters
    ----------
    mode : int
        One of `FIXED`, `CLASSIC` (20) and `AXISYMMETRIC` (21).
    h, r : float
        Smoothing length and radius [m].
    div : float
        Velocity divergence [1/s].
    u_r : float
        Radial velocity [m/s].
    """
    if mode == FIXED:
        return 0.0
    if mode == CLASSIC:
        return h / DIMENSIONS * div
    soft = AXIS_SOFTENING * h
    hoop = u_r * r / (r * r + soft * soft)
    return h / DIMENSIONS * (div - hoop)
