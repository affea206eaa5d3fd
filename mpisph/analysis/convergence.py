"""Richardson extrapolation and the grid convergence index (GCI) of a figure.

A figure is computed at several resolutions NPR, with a spacing h that goes as 1/NPR.
Near the limit its error falls as h^p. From the finest three levels follow the observed
order p, the value extrapolated to h = 0, and an uncertainty of the finest value: the
estimated error times a safety factor. The procedure is that of I. B. Celik, U. Ghia,
P. J. Roache, C. J. Freitas, H. Coleman and P. E. Raad, J. Fluids Eng. 130 (2008)
078001, with the safety factors of P. J. Roache, J. Fluids Eng. 116 (1994) 405. It asks
for ratios of spacings above 1.3 or so.

R_b and L_b are set by the outermost and the foremost particle alone. Which particle
that is changes with the resolution, and each stands for a ring whose mass falls as
h^2 r: a finer run resolves thinner debris further out, so that the figure may go on
growing without a limit, or jump. No error expansion in h need hold for it, and its
observed order may be irregular. The robust figures, within which 99 % of the cloud's
mass lies, are averages over many particles; judge convergence by them where the two
disagree.
"""

import math
from collections.abc import Sequence
from typing import Literal, NamedTuple

import numpy as np
from scipy.optimize import brentq

from mpisph.core.particles import FloatArray

Kind = Literal[
    "monotone", "oscillatory", "divergent", "constant", "two levels", "too few"
]
"""How a sequence behaves."""

ORDERS = (0.5, 3.0)
"""Observed orders that are believed; outside they are limited to these."""

VERIFIED = 1.25
"""Safety factor where three levels give an order that is believed."""

UNVERIFIED = 3.0
"""Safety factor where the order is assumed or limited."""

ASSUMED_ORDER = 1.0
"""Order where there are but two levels: shocks leave the scheme no more."""

SAME_ORDER = 0.5
"""Orders of successive triplets that differ by no more are taken as one."""

_STEEPEST = 50.0
# Orders beyond this, of either sign, count as infinite.

_ROUNDING = 1e-12
# Changes below this, relative to the values, are none.


class Convergence(NamedTuple):
    """What a sequence of levels says about the figure at infinite resolution.

    Levels are in order, the coarsest first.

    Attributes
    ----------
    npr : ndarray, shape (levels,)
        Those that had a value.
    values : ndarray, shape (levels,)
        In the figure's own unit.
    kind : str
        Of the finest three levels. Those that are ``monotone`` or ``oscillatory``
        converge, with changes of one sign or of both; ``divergent`` ones have an order
        that is not above zero; ``constant`` ones agree to rounding. With ``two
        levels`` an order is assumed; with ``too few`` nothing is known.
    order : float
        Observed order p of the finest three, not above zero where they diverge; NaN
        where there are fewer, or no changes.
    order_used : float
        Order that the extrapolation took: p, limited or assumed; NaN without one.
    extrapolated : float
        Value at h = 0; NaN where an extrapolation would be baseless.
    safety : float
        Safety factor; NaN where nothing is known.
    uncertainty : float
        Of the finest value, in its unit; NaN where nothing is known.
    gci : float
        The same, relative to the finest value [%].
    orders : ndarray, shape (max(levels - 2, 0),)
        Observed order of each successive triplet.
    kinds : tuple of str
        Kind of each successive triplet.
    asymptotic : bool or None
        Whether the finest two triplets are monotone, with orders that are believed
        and agree. None with fewer than four levels: the usual ratio
        GCI_32/(r_21^p GCI_21) is one by construction where p comes from the same
        three levels, and says nothing.
    """

    npr: FloatArray
    values: FloatArray
    kind: Kind
    order: float
    order_used: float
    extrapolated: float
    safety: float
    uncertainty: float
    gci: float
    orders: FloatArray
    kinds: tuple[Kind, ...]
    asymptotic: bool | None


class _Estimate(NamedTuple):
    """Order used, extrapolated value, safety factor and uncertainty."""

    order_used: float = math.nan
    extrapolated: float = math.nan
    safety: float = math.nan
    uncertainty: float = math.nan


def converge(npr: Sequence[float], values: Sequence[float | None]) -> Convergence:
    """Judge the convergence of a figure over a sequence of resolutions.

    ============================  ===============  ====================================
    finest levels                 extrapolated     uncertainty of the finest value
    ============================  ===============  ====================================
    monotone, p in `ORDERS`       with p           1.25 times the estimated error
    monotone, p below             with p limited   3 times the estimated error
    monotone, p above             with p limited   the same, or the range of the three
                                                   values if that is more: two values
                                                   that agree by chance prove little
    oscillatory                   not              range of the three values
    divergent                     not              3 times that range; no bound
    constant                      the value        0
    two                           with p = 1       3 times the estimated error
    ============================  ===============  ====================================

    The estimated error is ``|f_2 - f_1|/(r_21^p - 1)``, where f_1 is the finest value
    and r_21 the ratio of the finest two spacings.

    Parameters
    ----------
    npr : sequence of float, length levels
        Resolutions, in any order.
    values : sequence of float or None, length levels
        The figure at each; levels that are None or not finite are left out.

    Returns
    -------
    Convergence

    Raises
    ------
    ValueError
        If the lengths differ, or if an NPR is not positive or is given twice.
    """
    x, f = _sorted_levels(npr, values)
    triplets = [(x[k : k + 3], f[k : k + 3]) for k in range(x.size - 2)]
    orders = np.array([observed_order(*triplet) for triplet in triplets])
    kinds = tuple(_kind(y, p) for (_, y), p in zip(triplets, orders, strict=True))
    order = float(orders[-1]) if triplets else math.nan
    kind: Kind = kinds[-1] if kinds else "two levels" if f.size == 2 else "too few"
    estimate = _estimate(kind, order, x, f)
    relative = math.nan
    if f.size and f[-1] != 0.0:
        relative = 100.0 * estimate.uncertainty / abs(float(f[-1]))
    return Convergence(
        npr=x,
        values=f,
        kind=kind,
        order=order,
        **estimate._asdict(),
        gci=relative,
        orders=orders,
        kinds=kinds,
        asymptotic=_asymptotic(orders, kinds),
    )


def observed_order(npr: FloatArray, values: FloatArray) -> float:
    """Return the order p of three levels, with ratios that may differ.

    With signed changes ``e_21 = f_2 - f_1`` and ``e_32 = f_3 - f_2``, f_1 being the
    finest, and s the sign of their ratio, p solves ::

        p ln r_21 = ln |e_32/e_21| + ln((r_21^p - s)/(r_32^p - s))

    (Celik et al., equation 3). They iterate on it, and take the magnitude of the right
    side; here its one root is bracketed, and keeps its sign, so that a divergent
    sequence is not taken for a convergent one.

    Parameters
    ----------
    npr, values : ndarray, shape (3,)
        The coarsest first.

    Returns
    -------
    float
        Infinite where one change vanishes, NaN where both do.
    """
    e_32, e_21 = values[0] - values[1], values[1] - values[2]
    nothing = _ROUNDING * np.abs(values).max()
    if max(abs(e_32), abs(e_21)) <= nothing:
        return math.nan
    if min(abs(e_32), abs(e_21)) <= nothing:
        return math.copysign(math.inf, abs(e_32) - abs(e_21))
    l_32, l_21 = math.log(npr[1] / npr[0]), math.log(npr[2] / npr[1])
    target = math.log(abs(e_32 / e_21))
    oscillating = e_32 / e_21 < 0.0

    def excess(p: float) -> float:
        return _log_ratio(p, l_32, l_21, oscillating) - target

    if excess(_STEEPEST) <= 0.0:
        return math.inf
    if excess(-_STEEPEST) >= 0.0:
        return -math.inf
    return float(brentq(excess, -_STEEPEST, _STEEPEST, xtol=1e-12))


def explain(convergence: Convergence) -> str:
    """Return in a phrase how the sequence behaves and how its uncertainty was made."""
    c = convergence
    if c.kind == "two levels":
        return f"two levels, order {c.order_used:g} assumed, safety factor {c.safety:g}"
    if c.kind in ("constant", "too few"):
        return {"constant": "the same at all levels", "too few": "one level"}[c.kind]
    text = f"{c.kind}, observed order {c.order:.2f}"
    if c.kind == "oscillatory":
        return f"{text}; range of the finest three"
    if c.kind == "divergent":
        return f"{text}; three times the range of the finest three, no bound"
    if c.order_used != c.order:
        text += f", limited to {c.order_used:g}"
    return f"{text}, safety factor {c.safety:g}"


def _sorted_levels(
    npr: Sequence[float], values: Sequence[float | None]
) -> tuple[FloatArray, FloatArray]:
    """Return NPR and value of the levels that have one, the coarsest first."""
    x = np.array(npr, dtype=np.float64)
    f = np.array([np.nan if v is None else v for v in values], dtype=np.float64)
    if x.shape != f.shape:
        raise ValueError(f"{x.size} resolutions but {f.size} values")
    if not (np.isfinite(x) & (x > 0.0)).all():
        raise ValueError("a resolution is not positive")
    if np.unique(x).size < x.size:
        raise ValueError("a resolution is given twice")
    order = np.argsort(x)
    order = order[np.isfinite(f[order])]
    return x[order], f[order]


def _log_ratio(p: float, l_32: float, l_21: float, oscillating: bool) -> float:
    """Return ln |e_32/e_21| of an error C h^p, whose sign may alternate.

    It grows with p throughout: from a mean of ln h over the coarser two levels that
    over the finer two is taken.
    """
    if oscillating:
        return p * l_21 + math.log((math.exp(p * l_32) + 1) / (math.exp(p * l_21) + 1))
    if p == 0.0:
        return math.log(l_32 / l_21)
    return p * l_21 + math.log(math.expm1(p * l_32) / math.expm1(p * l_21))


def _kind(values: FloatArray, order: float) -> Kind:
    if math.isnan(order):
        return "constant"
    if order <= 0.0:
        return "divergent"
    e_32, e_21 = values[0] - values[1], values[1] - values[2]
    return "oscillatory" if e_32 * e_21 < 0.0 else "monotone"


def _estimate(kind: Kind, order: float, npr: FloatArray, f: FloatArray) -> _Estimate:
    """Return what is to be made of the finest levels."""
    if kind == "too few":
        return _Estimate()
    if kind == "constant":
        return _Estimate(extrapolated=float(f[-1]), safety=1.0, uncertainty=0.0)
    if kind == "two levels":
        return _extrapolate(ASSUMED_ORDER, UNVERIFIED, npr, f)
    spread = float(np.ptp(f[-3:]))
    if kind == "oscillatory":
        return _Estimate(safety=1.0, uncertainty=spread)
    if kind == "divergent":
        return _Estimate(safety=UNVERIFIED, uncertainty=UNVERIFIED * spread)
    lowest, highest = ORDERS
    if order < lowest:
        return _extrapolate(lowest, UNVERIFIED, npr, f)
    if order > highest:
        limited = _extrapolate(highest, UNVERIFIED, npr, f)
        return limited._replace(uncertainty=max(limited.uncertainty, spread))
    return _extrapolate(order, VERIFIED, npr, f)


def _extrapolate(
    order: float, safety: float, npr: FloatArray, f: FloatArray
) -> _Estimate:
    """Extrapolate the finest two levels to h = 0 with a given order."""
    error = float((f[-2] - f[-1]) / ((npr[-1] / npr[-2]) ** order - 1.0))
    return _Estimate(order, float(f[-1]) - error, safety, safety * abs(error))


def _asymptotic(orders: FloatArray, kinds: Sequence[Kind]) -> bool | None:
    if len(kinds) < 2:
        return None
    finest = orders[-2:]
    believed = (finest >= ORDERS[0]) & (finest <= ORDERS[1])
    regular = kinds[-1] == kinds[-2] == "monotone" and bool(believed.all())
    return regular and abs(float(finest[1] - finest[0])) <= SAME_ORDER
