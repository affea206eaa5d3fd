"""The ring-averaged Gaussian kernel (R1): equations only.

Every function is branch-free, so that the pair loop vectorises. Notation: ``xi =
2 r_a r_b / h^2``; ``I0`` and ``I1`` are modified Bessel functions of `xi`. Of a pair
the averages over the angle are ``A0 = <W>``, ``A1 = <W cos>``, ``s2 = <W sin^2>`` and
``q = 1 - A1/A0``, with ``ratio = xi q``. The polynomials are Chebyshev fits computed at
60 digits (scripts/kernel_coefficients.py) and as short as a relative error of 1e-12 in
each allows: that is far below what the scheme can see, and every further coefficient
costs the pair loop a hundredth.
Their errors are stated beside them, and the tests compare with scipy and with 50
digits over the whole range. They are summed in pairs (Estrin): the loop waits for the
longest chain of dependent operations.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (7)-(10).
Petschek, Libersky (1993), J. Comp. Phys. 109, 76-83.
"""

import numpy as np

from mpisph.core.jit import EXACT, INLINE, ROUNDED
from mpisph.core.jitted import jitted

XI_FAR = 16.0
"""From this xi on, expansions in 1/xi hold."""

PI_POW = 0.17958712212516656
"""pi^(-3/2), the Gaussian's constant in three dimensions."""


@jitted(**ROUNDED)
def exp_minus(x):
    """Return exp(-x) for 0 <= x <= 700, relative error below 2e-12 (R1).

    ``exp(-x) = 2^n exp(t)``, where n is the whole number nearest to ``-x/ln 2``: adding
    1.5 2^52 rounds it and leaves it in the low bits, from which a shift brings it to
    the exponent. The polynomial for exp(t), ``|t| <= ln(2)/2``, errs by 1.1e-12.
    """
    shifted = x * -1.4426950408889634 + 6755399441055744.0
    t = (shifted - 6755399441055744.0) * -0.6931471805599453 - x
    t2 = t * t
    t4 = t2 * t2
    a = 1.0 + 0.9999999999797852 * t
    b = 0.49999999999797934 + 0.16666666891045775 * t
    c = 0.041666666890957 + 0.008333266097949614 * t
    d = 0.0013888821677630362 + 0.00019915866926782682 * t
    p = (a + t2 * b) + t4 * ((c + t2 * d) + t4 * 2.4876164022625967e-05)
    exponent = np.float64(shifted).view(np.int64) << 52
    return np.int64(np.float64(p).view(np.int64) + exponent).view(np.float64)


@jitted(**INLINE)
def i0_far(x):
    """Return pi^(-3/2) sqrt(xi) exp(-xi) I0, x = 1/xi <= 1/XI_FAR; error 3e-13 (R1)."""
    x2 = x * x
    a = 0.0716448960313336 + 0.008955612026253971 * x
    b = 0.005037524338145947 + 0.005248355804722425 * x
    c = 0.007979087425602995 + 0.01806721066521915 * x
    d = 0.010527961833145432 + 0.3648866527988791 * x
    return (a + x2 * b) + (x2 * x2) * (c + x2 * d)


@jitted(**INLINE)
def ratio_far(x):
    """Return xi (1 - I1/I0), x = 1/xi <= 1/XI_FAR; error 6e-13 (R1)."""
    x2 = x * x
    x4 = x2 * x2
    a = 0.50000000000016 + 0.12499999958622937 * x
    b = 0.1250001742886255 + 0.19528456196569607 * x
    c = 0.4084608797352177 + 0.9515648241048158 * x
    d = 5.602986863092073 - 20.894630837966037 * x
    return (a + x2 * b) + x4 * ((c + x2 * d) + x4 * 249.63300637575526)


@jitted(**INLINE)
def i0_near(w):
    """Return I0(xi), w = xi^2/4, xi <= XI_FAR; error 6e-14 (R1)."""
    w2 = w * w
    w4 = w2 * w2
    p = 7.552521454025018e-37
    p = (
        (2.9700677608580293e-27 + 1.1212748459713554e-30 * w)
        + w2 * (7.249558918698182e-32 + -1.5823794907379445e-34 * w)
    ) + w4 * p
    p = (
        (4.3632255762422185e-18 + 2.5653018656332683e-20 * w)
        + w2 * (1.3459102194449831e-22 + 5.329070646152628e-25 * w)
    ) + w4 * p
    p = (
        (6.151193881101951e-10 + 7.59400825248746e-12 * w)
        + w2 * (7.594353415068423e-14 + 6.274732320636678e-16 * w)
    ) + w4 * p
    p = (
        (0.001736111111916582 + 6.944444420729417e-05 * w)
        + w2 * (1.929012392245366e-06 + 3.9367592440088555e-08 * w)
    ) + w4 * p
    p = (
        (1.0000000000000584 + 0.9999999999991963 * w)
        + w2 * (0.2500000000018405 + 0.02777777777610416 * w)
    ) + w4 * p
    return p


@jitted(**INLINE)
def i1_near(w):
    """Return I1(xi)/xi, w = xi^2/4, xi <= XI_FAR; error 8e-14 (R1)."""
    w2 = w * w
    w4 = w2 * w2
    p = (9.953543046172896e-30 + 6.513380315183032e-31 * w) + w2 * (
        -1.5038008029067578e-33 + 7.560510499896724e-36 * w
    )
    p = (
        (1.667903957925982e-19 + 9.413786489515045e-22 * w)
        + w2 * (4.006003578905002e-24 + 2.3682446967530652e-26 * w)
    ) + w4 * p
    p = (
        (3.417307368381126e-11 + 3.7971581893396946e-13 * w)
        + w2 * (3.451173794755382e-15 + 2.6177282783479333e-17 * w)
    ) + w4 * p
    p = (
        (0.00017361111075544575 + 5.7870371316149e-06 * w)
        + w2 * (1.3778657938769402e-07 + 2.4604770127528714e-09 * w)
    ) + w4 * p
    p = (
        (0.4999999999999618 + 0.2500000000004774 * w)
        + w2 * (0.0416666666656753 + 0.00347222222303895 * w)
    ) + w4 * p
    return p


@jitted(**INLINE)
def ring_averages_far(d2, weight, root, inv_xi):
    """Return A0, A1, s2, times a weight, q and ratio of a pair with xi >= XI_FAR (R1).

    Parameters
    ----------
    d2 : float
        ``((r_a-r_b)^2 + (z_a-z_b)^2) / h^2``.
    weight : float
        Factor of the averages, over h^2.
    root : float
        ``(2 r_a r_b)^(-1/2)`` [1/m].
    inv_xi : float
        1/xi.

    Returns
    -------
    A0, A1, s2 : float
        Kernel averages [1/m3] times the weight's factor, relative error below 4e-12.
    q, ratio : float
        ``1 - A1/A0``, free of cancellation, and xi times it.
    """
    ratio = ratio_far(inv_xi)
    q = inv_xi * ratio
    A0 = (weight * root) * (exp_minus(d2) * i0_far(inv_xi))
    A1 = A0 - A0 * q
    return A0, A1, A1 * inv_xi, q, ratio


@jitted(**INLINE)
def ring_averages(d2, weight, root, inv_xi, xi, inv_h):
    """Return A0, A1, s2, times a weight, q and ratio at any xi, the axis included (R1).

    Parameters and returns as of `ring_averages_far`, with ``inv_h = 1/h`` [1/m]; `root`
    and `inv_xi` may be anything finite where ``xi < XI_FAR``.
    """
    near = xi < XI_FAR
    xi_near = xi if near else XI_FAR
    w = 0.25 * xi_near * xi_near
    x = 1.0 / XI_FAR if near else inv_xi
    g = weight * exp_minus(d2 + (xi_near if near else 0.0))
    g_near = g * (PI_POW * inv_h)
    I0 = i0_near(w)
    I1_xi = i1_near(w)
    ratio_x = ratio_far(x)
    A0_far = g * root * i0_far(x)
    q_far = x * ratio_x
    A1_far = A0_far - A0_far * q_far
    q = (I0 - xi_near * I1_xi) / I0 if near else q_far
    A0 = g_near * I0 if near else A0_far
    A1 = g_near * xi_near * I1_xi if near else A1_far
    s2 = g_near * I1_xi if near else A1_far * x
    ratio = xi_near * q if near else ratio_x
    return A0, A1, s2, q, ratio


@jitted(**EXACT)
def lies_near_axis(r, h, kappa):
    """Say whether a ring may have a neighbour, of the same h, with xi < XI_FAR."""
    return 2.0 * r * (r - kappa * h) < XI_FAR * h * h
