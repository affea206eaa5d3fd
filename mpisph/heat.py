"""Artificial heat conduction (R6): equations only.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (13), (14), with the factor 4 and the
neighbour's mass that dimensions require.
"""

from numba import njit

from mpisph.jit import EXACT, INLINE


@njit(**EXACT)
def diffusivity(g1, g2, h, c, div):
    """Return zeta, the artificial diffusivity of a particle (R6) [m2/s]."""
    return g1 * h * c + g2 * h * h * (abs(div) - div)


@njit(**INLINE)
def heat_flow(zeta_ab, rho_ab, E_a, E_b, F, A0):
    """Return the heating of a by unit mass of b (R6) [W/kg/kg], F = -2/h^2."""
    return 2.0 * F * (zeta_ab / rho_ab) * (E_a - E_b) * A0
