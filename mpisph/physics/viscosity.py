"""Artificial viscosity (R5): equations only.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (11), (12).
Monaghan, Gingold (1983), J. Comp. Phys. 52, 374-389.
"""

from numba import njit

from mpisph.core.jit import INLINE


@njit(**INLINE)
def approach(dr, dz, du_r, du_z, r_a, r_b, u_r_a, u_r_b, q, printed):
    """Return N, the averaged (u_a - u_b).(x_a - x_b) of two rings (R5) [m2/s].

    Parameters
    ----------
    dr, dz, du_r, du_z : float
        Differences a - b of position [m] and velocity [m/s].
    q : float
        ``1 - A1/A0``.
    printed : bool
        True for the products as printed in eq (12), False for the crossed ones that
        averaging gives.
    """
    swapped_a = u_r_a if printed else u_r_b
    swapped_b = u_r_b if printed else u_r_a
    return dr * du_r + dz * du_z + (r_a * swapped_a + r_b * swapped_b) * q


@njit(**INLINE)
def separation2(d2, ratio, epsilon, h):
    """Return D, the averaged squared distance of two rings, softened (R5) [m2].

    Parameters
    ----------
    d2 : float
        Squared distance in the r-z plane [m2].
    ratio : float
        ``xi q``: then ``2 r_a r_b q = h^2 ratio``.
    epsilon : float
        Softening, in units of h^2.
    h : float
        [m].
    """
    return d2 + (ratio + epsilon) * (h * h)


@njit(**INLINE)
def viscous_pressure(N, inv_D, h, alpha_c, beta, inv_rho_ab):
    """Return Pi, the viscous pressure over density squared (R5) [Pa m6/kg2].

    Zero for receding rings; a speed that is not a number stays one. `alpha_c` is alpha
    times the pair's mean sound speed [m/s].
    """
    closing = 0.0 if N > 0.0 else N
    mu = (h * inv_D) * closing
    return (beta * mu - alpha_c) * mu * inv_rho_ab
