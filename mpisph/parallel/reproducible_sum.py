"""Sums over all particles whose bits depend on no number of ranks.

A floating-point sum depends on the order of its terms, and the order depends
on which rank owns which particle. Here the terms become integers first, and
integer sums have no order.
"""

import math

import numpy as np
from numba import njit
from numba.extending import register_jitable

from mpisph.core.jit import EXACT
from mpisph.core.particles import FloatArray, IntArray

CHUNKS = 4
"""Columns of `fixed_point_chunks`: three chunks, and a count of bad values."""

_BITS = 34
# Bits of one chunk. A chunk is below 2^34, so that int64 holds the sum of up to
# 2^29 particles.


_SMALLEST_EXPONENT = -900
# The scale 2^(34 - exponent) must stay a finite float64.


def fixed_point_chunks(rows: FloatArray, bounds: FloatArray) -> IntArray:
    """Return this rank's part of sums over all ranks, to be added up as integers.

    `from_chunks` of the added-up parts is the sum, with the same bits on any number of
    ranks. Values down to ``2**-49`` of their bound are summed exactly, so the result
    is then the correctly rounded sum. What lies below ``2**-102`` of the bound is cut
    off: the error of `n` values is less than ``n * 2**-102 * bound``, which is 3e-23 of
    the bound for ``2**27`` values.

    Parameters
    ----------
    rows : ndarray of float64, shape (k, n)
        Values of the owned particles; `n` may differ between ranks. At most
        ``2**29`` values a row over all ranks.
    bounds : ndarray of float64, shape (k,)
        A bound on the magnitude of every value of a row, equal on all ranks.
        It may be loose.

    Returns
    -------
    ndarray of int64, shape (k, CHUNKS)
        Sums of the high, middle and low chunks, and the number of values that
        are NaN or larger than their bound.
    """
    assert len(rows) == len(bounds), "one bound a row"
    chunks: IntArray = sum_chunks(rows, np.asarray(bounds, np.float64))
    return chunks


def from_chunks(total: IntArray, bounds: FloatArray) -> FloatArray:
    """Return the sums that added-up chunks stand for, correctly rounded.

    Parameters
    ----------
    total : ndarray of int64, shape (k, CHUNKS)
        Sum over all ranks of what `fixed_point_chunks` returned.
    bounds : ndarray of float64, shape (k,)
        The bounds that were given to it.

    Returns
    -------
    ndarray of float64, shape (k,)
        NaN where a value is NaN or larger than its bound, or where the bound is not
        finite.
    """
    rows = zip(total.tolist(), bounds.tolist(), strict=True)
    return np.array([_from_chunks(chunks, bound) for chunks, bound in rows])


def _from_chunks(chunks: list[int], bound: float) -> float:
    high, middle, low, bad = chunks
    if bad or not math.isfinite(bound):
        return math.nan
    # Python integers are exact, and float() of one rounds correctly.
    fixed_point = (high << 2 * _BITS) + (middle << _BITS) + low
    return math.ldexp(float(fixed_point), _exponent(bound) - 3 * _BITS)


@register_jitable  # type: ignore[untyped-decorator]
def _exponent(bound: float) -> int:
    """Return the power of two above `bound`, within what the scale can hold."""
    if not math.isfinite(bound):
        return 0
    return max(math.frexp(bound)[1], _SMALLEST_EXPONENT)


@njit(**EXACT)  # type: ignore[untyped-decorator]
def sum_chunks(rows: FloatArray, bounds: FloatArray) -> IntArray:
    """Split each value into three 34-bit integers and sum them.

    The scale is a power of two and a fraction is exact, so nothing is rounded;
    only what is below the last chunk is cut off. See `fixed_point_chunks`.
    """
    chunk = 17179869184.0  # 2^34
    total = np.zeros((rows.shape[0], CHUNKS), np.int64)
    for row in range(rows.shape[0]):
        values, bound = rows[row], bounds[row]
        scale = math.ldexp(1.0, _BITS - _exponent(bound))
        high = middle = low = good = np.int64(0)
        for i in range(values.size):  # without a branch, so that it vectorises
            inside = abs(values[i]) <= bound  # false for NaN as well
            scaled = (values[i] if inside else 0.0) * scale
            first = np.int64(scaled)
            scaled = (scaled - first) * chunk
            second = np.int64(scaled)
            high += first
            middle += second
            low += np.int64((scaled - second) * chunk)
            good += np.int64(inside)
        total[row] = high, middle, low, values.size - good
    return total
