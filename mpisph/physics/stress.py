"""Deviatoric stress (R7): its rate, and its return to the yield surface.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (15)-(17).
"""

import math

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitted


@jitted(**EXACT)
def jaumann_rate(L_rr, L_tt, L_rz, L_zr, L_zz, S_rr, S_zz, S_rz, mu):
    """Return the rates of S_rr, S_zz, S_rz (R7) [Pa/s].

    Parameters
    ----------
    L_rr, L_tt, L_rz, L_zr, L_zz : float
        Velocity gradient [1/s]; ``L_rz = d u_r / d z``.
    S_rr, S_zz, S_rz : float
        Deviatoric stress, tension positive [Pa].
    mu : float
        Shear modulus [Pa].
    """
    w = 0.5 * (L_rz - L_zr)
    third = (L_rr + L_tt + L_zz) / 3.0
    dS_rr = 2.0 * mu * (L_rr - third) + 2.0 * S_rz * w
    dS_zz = 2.0 * mu * (L_zz - third) - 2.0 * S_rz * w
    dS_rz = mu * (L_rz + L_zr) + (S_zz - S_rr) * w
    return dS_rr, dS_zz, dS_rz


@jitted(**EXACT)
def equivalent_stress(S_rr, S_zz, S_rz):
    """Return the von Mises stress sqrt(3 J2) (R7) [Pa]."""
    S_tt = -(S_rr + S_zz)
    J2 = 0.5 * (S_rr * S_rr + S_zz * S_zz + S_tt * S_tt) + S_rz * S_rz
    return math.sqrt(3.0 * J2)
