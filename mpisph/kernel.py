"""The ring-averaged Gaussian kernel (R1): equations only.

Every function is branch-free, so that the pair loop vectorises. Notation: ``xi =
2 r_a r_b / h^2``; ``I0`` and ``I1`` are modified Bessel functions of `xi`. Of a pair
the averages over the angle are ``A0 = <W>``, ``A1 = <W cos>``, ``s2 = <W sin^2>`` and
``q = 1 - A1/A0``. The polynomials are Chebyshev fits computed at 60 digits; their
errors are stated beside them, and the tests compare with scipy over the whole range.

References
----------
Lee, Seo, Min (2003), Trans. KSME A, eqs (7)-(10).
Petschek, Libersky (1993), J. Comp. Phys. 109, 76-83.
"""

from numba import njit

from mpisph.jit import INLINE

XI_FAR = 16.0
"""From this xi on, the expansions in 1/xi hold to rounding."""

PI_POW = 0.17958712212516656
"""pi^(-3/2), the Gaussian's constant in three dimensions."""


@njit(**INLINE)
def exp_minus(x):
    """Return exp(-x) for 0 <= x <= 32, relative error below 2e-14 (R1).

    A polynomial in x/32 (error 6e-20 on [0, 1]) and five squarings: no table, no
    bit tricks, no branch.
    """
    t = 0.03125 * x
    e = -9.780966410263765e-11
    e = 1.9081033183790556e-09 + t * e
    e = -2.4736063415087362e-08 + t * e
    e = 2.7520283081404226e-07 + t * e
    e = -2.755431178736161e-06 + t * e
    e = 2.480141506743178e-05 + t * e
    e = -0.00019841262871241784 + t * e
    e = 0.0013888888691924455 + t * e
    e = -0.008333333329550012 + t * e
    e = 0.041666666666195375 + t * e
    e = -0.16666666666663146 + t * e
    e = 0.4999999999999986 + t * e
    e = -1.0 + t * e
    e = 1.0 + t * e
    e = e * e
    e = e * e
    e = e * e
    e = e * e
    return e * e


@njit(**INLINE)
def i0_far(y):
    """Return sqrt(xi) exp(-xi) I0, y = XI_FAR/xi in (0, 1]; error 4e-17 (R1)."""
    p = 2.7853640217915815e-10
    p = -1.0606415795135158e-09 + y * p
    p = 2.2378004472583785e-09 + y * p
    p = -1.755871960808993e-09 + y * p
    p = 4.187063149677167e-09 + y * p
    p = 1.2880591771919323e-08 + y * p
    p = 8.661984148708375e-08 + y * p
    p = 6.826729188486284e-07 + y * p
    p = 7.1336480372331995e-06 + y * p
    p = 0.00010957276965857994 + y * p
    p = 0.003116736565641002 + y * p
    p = 0.39894228040143265 + y * p
    return p


@njit(**INLINE)
def ratio_far(y):
    """Return xi (1 - I1/I0), y = XI_FAR/xi in (0, 1]; error 2e-16 (R1)."""
    p = 8.370384980128558e-09
    p = -3.8829896945951094e-08 + y * p
    p = 8.552170574248037e-08 + y * p
    p = -1.0376358142861599e-07 + y * p
    p = 9.741759004190672e-08 + y * p
    p = -3.994189650442251e-09 + y * p
    p = 2.0874280274299356e-07 + y * p
    p = 9.952768905699027e-07 + y * p
    p = 6.1994940530373855e-06 + y * p
    p = 4.7683661209876975e-05 + y * p
    p = 0.0004882812525172313 + y * p
    p = 0.007812499999954709 + y * p
    p = 0.5000000000000001 + y * p
    return p


@njit(**INLINE)
def i0_near(w):
    """Return I0(xi), w = xi^2/4, xi <= XI_FAR; error 6e-17 (R1)."""
    p = 3.1183655003128516e-42
    p = -5.9057599895310385e-40 + w * p
    p = 3.977248375490452e-37 + w * p
    p = 3.158899751882302e-35 + w * p
    p = 2.849919005495353e-32 + w * p
    p = 7.550073081794797e-30 + w * p
    p = 2.3081146484217764e-27 + w * p
    p = 5.835300524913379e-25 + w * p
    p = 1.3163138598584532e-22 + w * p
    p = 2.578747700233329e-20 + w * p
    p = 4.358439175773968e-18 + w * p
    p = 6.276070588695045e-16 + w * p
    p = 7.594060292214304e-14 + w * p
    p = 7.594058173937783e-12 + w * p
    p = 6.151187353652423e-10 + w * p
    p = 3.936759886984178e-08 + w * p
    p = 1.929012345806744e-06 + w * p
    p = 6.944444444390802e-05 + w * p
    p = 0.0017361111111126194 + w * p
    p = 0.027777777777775174 + w * p
    p = 0.2500000000000024 + w * p
    p = 0.9999999999999991 + w * p
    p = 1.0 + w * p
    return p


@njit(**INLINE)
def i1_near(w):
    """Return I1(xi)/xi, w = xi^2/4, xi <= XI_FAR; error 2e-18 (R1)."""
    p = 6.416523294790459e-44
    p = -1.081612599547801e-41 + w * p
    p = 8.595514463379673e-39 + w * p
    p = 9.71425063990746e-37 + w * p
    p = 7.237607939675404e-34 + w * p
    p = 2.1251184371426516e-31 + w * p
    p = 6.765945687114346e-29 + w * p
    p = 1.8249647844965077e-26 + w * p
    p = 4.3869944567154975e-24 + w * p
    p = 9.210100325549024e-22 + w * p
    p = 1.6763135809491006e-19 + w * p
    p = 2.615031757879264e-17 + w * p
    p = 3.4518451101561297e-15 + w * p
    p = 3.797029163604618e-13 + w * p
    p = 3.417326297990147e-11 + w * p
    p = 2.4604749302850176e-09 + w * p
    p = 1.3778659612246416e-07 + w * p
    p = 5.787037037026393e-06 + w * p
    p = 0.00017361111111114104 + w * p
    p = 0.0034722222222221704 + w * p
    p = 0.04166666666666671 + w * p
    p = 0.24999999999999997 + w * p
    p = 0.5 + w * p
    return p


@njit(**INLINE)
def ring_averages_far(d2, inv_h, inv_xi, root_inv_xi):
    """Return A0, A1, s2, q of a pair with xi >= XI_FAR (R1).

    Parameters
    ----------
    d2 : float
        ``((r_a-r_b)^2 + (z_a-z_b)^2) / h^2``, at most 32.
    inv_h : float
        1/h [1/m].
    inv_xi, root_inv_xi : float
        1/xi and its square root.

    Returns
    -------
    A0, A1, s2 : float
        Kernel averages [1/m3].
    q : float
        ``1 - A1/A0``, free of cancellation.
    """
    y = XI_FAR * inv_xi
    A0 = PI_POW * inv_h * inv_h * inv_h * exp_minus(d2) * root_inv_xi * i0_far(y)
    q = inv_xi * ratio_far(y)
    A1 = A0 - A0 * q
    return A0, A1, A1 * inv_xi, q


@njit(**INLINE)
def ring_averages(d2, inv_h, xi, inv_xi, root_inv_xi):
    """Return A0, A1, s2, q of a pair at any xi, the axis included (R1).

    Parameters and returns as of `ring_averages_far`; `inv_xi` and `root_inv_xi` may be
    anything finite where ``xi < XI_FAR``.
    """
    near = xi < XI_FAR
    xi_near = xi if near else XI_FAR
    w = 0.25 * xi_near * xi_near
    y = 1.0 if near else XI_FAR * inv_xi
    e = exp_minus(d2 + (xi_near if near else 0.0))
    g = PI_POW * inv_h * inv_h * inv_h * e
    I0 = i0_near(w)
    I1_xi = i1_near(w)
    A0_far = g * root_inv_xi * i0_far(y)
    q_far = inv_xi * ratio_far(y)
    A1_far = A0_far - A0_far * q_far
    q = (I0 - xi_near * I1_xi) / I0 if near else q_far
    A0 = g * I0 if near else A0_far
    A1 = g * xi_near * I1_xi if near else A1_far
    s2 = g * I1_xi if near else A1_far * inv_xi
    return A0, A1, s2, q
