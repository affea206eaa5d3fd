"""Artificial heat conduction (R6): equations only.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (13), (14), with the factor 4 and the
neighbour's mass that dimensions require.
"""

from mpisph.core.jit import EXACT, INLINE
from mpisph.core.jitted import jitted


@jitted(**EXACT)
def diffusivity(g1, g2, h, c, div):
    """Return zeta, the artificial diffusivity of a particle (R6) [m2/s]."""
    return g1 * h * c + g2 * h * h * (abs(div) - div)


@jitted(**INLINE)
def heat_flow(two_zeta_ab, E_a, E_b):
    """Return the heating of a by b, over ``m_b F A0/rho`` (R6) [m4/s3].

    Parameters
    ----------
    two_zeta_ab : float
        Sum of the two diffusivities [m2/s].
    E_a, E_b : float
        [J/kg].
    """
    return two_zeta_ab * (E_a - E_b)
