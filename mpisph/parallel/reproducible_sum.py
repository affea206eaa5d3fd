"""Sums over all particles whose bits depend on no number of ranks.

A floating-point sum depends on the order of its terms, and the order depends
on which rank owns which particle. Here the terms become integers first, and
integer sums have no order.
"""

import math
from typing import Any

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitable, jitted
from mpisph.core.particles import FloatArray, IntArray

CHUNKS = 4
"""Columns of `fixed_point_chunks`: three chunks, and a count of bad values."""

_BITS = 34
# Bits of one chunk. A chunk is below 2^34, so that int64 holds the sum of up to
# 2^29 particles.

_CHUNK = 2.0**_BITS
_LOW = 2**_BITS - 1
_LEADING = 62


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
    sums: FloatArray = _from_chunks(total, bounds)
    return sums


@jitted(**EXACT)
def _from_chunks(total: IntArray, bounds: FloatArray) -> FloatArray:
    sums = np.full(bounds.size, math.nan)
    for row in range(bounds.size):
        high, middle, low, bad = total[row]
        if bad == 0 and math.isfinite(bounds[row]):
            exponent = _exponent(bounds[row]) - 3 * _BITS
            sums[row] = _rounded(high, middle, low, exponent)
    return sums


@jitted(**EXACT)
def _rounded(high: Any, middle: Any, low: Any, exponent: int) -> float:
    """Return ``(high 2^68 + middle 2^34 + low) 2^exponent``, correctly rounded.

    The leading 62 bits make an integer whose last bit is also set if any bit behind
    them is. A float64 holds 53 bits, so rounding that integer rounds the sum.
    """
    middle, low = middle + (low >> _BITS), low & _LOW
    high, middle = high + (middle >> _BITS), middle & _LOW
    sign = 1.0
    if high < 0:
        sign, low = -1.0, -low
        middle, low = -middle + (low >> _BITS), low & _LOW
        high, middle = -high + (middle >> _BITS), middle & _LOW
    for _ in range(2):
        if high == 0:
            high, middle, low, exponent = middle, low, np.int64(0), exponent - _BITS
    taken = 0  # bits behind `high`
    while taken < _LEADING - 1 and high >> (_LEADING - 1 - taken) == 0:
        taken += 1
    if taken <= _BITS:
        left = _BITS - taken
        leading = (high << taken) | (middle >> left)
        rest = (middle & ((1 << left) - 1)) | low
    else:
        left = 2 * _BITS - taken
        leading = (high << taken) | (middle << (_BITS - left)) | (low >> left)
        rest = low & ((1 << left) - 1)
    leading |= np.int64(rest != 0)
    return sign * math.ldexp(float(leading), exponent + 2 * _BITS - taken)


@jitable
def _exponent(bound: float) -> int:
    """Return the power of two above `bound`, within what the scale can hold."""
    if not math.isfinite(bound):
        return 0
    return max(math.frexp(bound)[1], _SMALLEST_EXPONENT)


@jitable
def scale_of(bound: float) -> float:
    """Return the power of two by which `split` makes a value below a bound whole."""
    return math.ldexp(1.0, _BITS - _exponent(bound))


@jitted(**EXACT)
def split(value: float, bound: float, scale: float) -> Any:
    """Return the three chunks of a value, and 1 where it is NaN or beyond its bound.

    The scale is a power of two and a fraction is exact, so nothing is rounded; only
    what is below the last chunk is cut off.
    """
    inside = abs(value) <= bound  # false for NaN as well
    scaled = (value if inside else 0.0) * scale
    first = np.int64(scaled)
    scaled = (scaled - first) * _CHUNK
    second = np.int64(scaled)
    return first, second, np.int64((scaled - second) * _CHUNK), np.int64(not inside)


@jitted(**EXACT)
def sum_chunks(rows: FloatArray, bounds: FloatArray) -> IntArray:
    """Return the same as `fixed_point_chunks`."""
    total = np.zeros((rows.shape[0], CHUNKS), np.int64)
    for row in range(rows.shape[0]):
        values, bound, scale = rows[row], bounds[row], scale_of(bounds[row])
        high = middle = low = bad = np.int64(0)
        for i in range(values.size):  # without a branch, so that it vectorises
            first, second, third, beyond = split(values[i], bound, scale)
            high += first
            middle += second
            low += third
            bad += beyond
        chunks = high, middle, low, bad
        for column in range(CHUNKS):
            total[row, column] = chunks[column]
    return total
