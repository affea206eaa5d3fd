"""Artificial viscosity (R5): equations only.

The viscous force of a pair of points is averaged over the angle by a quadrature of two
nodes. Node k stands for the points whose ``1 - cos(theta)`` is ``t_k = tau_k q``, with
``q = 1 - A1/A0`` its mean. The nodes are such that the viscous stress of a uniform
strain rate, linear and quadratic term alike, is that of the Cartesian sum in every
direction (scripts/viscosity_nodes.py).

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (11), (12).
Monaghan, Gingold (1983), J. Comp. Phys. 52, 374-389.
"""

from typing import NamedTuple

from mpisph.core.jit import INLINE
from mpisph.core.jitted import jitted


class Nodes(NamedTuple):
    """Nodes of the average over the angle.

    Attributes
    ----------
    tau_1, tau_2 : float
        ``(1 - cos(theta))/q`` at each.
    w : float
        Weight of the first; that of the second is ``1 - w``.
    """

    tau_1: float
    tau_2: float
    w: float


FAR_TAU = 0.23052969
FAR_W = 0.72974322
FAR_NODES = Nodes(FAR_TAU, (1.0 - FAR_W * FAR_TAU) / (1.0 - FAR_W), FAR_W)
"""Nodes of a pair with ``xi >= XI_FAR``."""

PRINTED_NODES = Nodes(1.0, 1.0, 1.0)
"""One node at the mean, as in eq (12)."""


@jitted(**INLINE)
def near_nodes(q):
    """Return the nodes of a pair with ``xi < XI_FAR`` (R5).

    Fits in q for xi from 0.002 to 400 (scripts/viscosity_nodes.py): the viscous stress
    errs by less than 2e-3 of its largest component.
    """
    q2 = q * q
    q4 = q2 * q2
    tau = (
        (FAR_TAU - 0.060926044 * q)
        + q2 * (0.7797441 - 5.858177 * q)
        + q4 * ((14.380063 - 14.670895 * q) + 5.4422759 * q2)
    )
    w = (
        (FAR_W - 0.087682057 * q)
        + q2 * (1.7325921 - 10.479171 * q)
        + q4 * ((20.915266 - 18.545233 * q) + 6.2001408 * q2)
    )
    return tau, (1.0 - w * tau) / (1.0 - w), w


@jitted(**INLINE)
def hoop_approach(r_a, r_b, u_r_a, u_r_b, q, printed):
    """Return the closing speed times distance that a node adds per tau (R5) [m2/s].

    Parameters
    ----------
    q : float
        ``1 - A1/A0``.
    printed : bool
        True for the products as printed in eq (12), False for the crossed ones that
        averaging gives.
    """
    swapped_a = u_r_a if printed else u_r_b
    swapped_b = u_r_b if printed else u_r_a
    return (r_a * swapped_a + r_b * swapped_b) * q


@jitted(**INLINE)
def closing(N):
    """Return N of approaching points, 0 of others (R5); what is no number stays."""
    return 0.0 if N > 0.0 else N


@jitted(**INLINE)
def signal_speed(mu, alpha_c, beta):
    """Return the viscous signal speed of an approach speed mu <= 0 (R5, R11) [m/s].

    `alpha_c` is alpha times the pair's mean sound speed [m/s].
    """
    return alpha_c - beta * mu


@jitted(**INLINE)
def viscous_pressure(mu, alpha_c, beta):
    """Return the viscous pressure over the pair's mean density (R5) [m2/s2]."""
    return -signal_speed(mu, alpha_c, beta) * mu
