"""Fields as 16-bit numbers, packed so that a browser can unpack them."""

import zlib
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Codes = npt.NDArray[np.uint16]

LEVELS = 65534
"""Steps from the lowest value to the highest."""

NO_VALUE = 65535
"""Code of what has no value."""


class Quantised(NamedTuple):
    """A field as numbers of 16 bits.

    Attributes
    ----------
    codes : ndarray of uint16, shape (n,)
        0 for the lowest value, `LEVELS` for the highest, `NO_VALUE` for none.
    low, high : float
        Lowest and highest value. A value read back is off by half a step at most:
        by ``(high - low) / (2 LEVELS)``.
    """

    codes: Codes
    low: float
    high: float


def quantise(values: npt.NDArray[np.float64]) -> Quantised:
    """Return values as numbers of 16 bits.

    Parameters
    ----------
    values : ndarray, shape (n,)
        What is not finite has no value.
    """
    known = np.isfinite(values)
    if not known.any():
        return Quantised(np.full(values.shape, NO_VALUE, np.uint16), 0.0, 0.0)
    low, high = float(values[known].min()), float(values[known].max())
    # Halves cannot overflow, as the difference of two large numbers could.
    span = high / 2 - low / 2
    share = (np.where(known, values, low) / 2 - low / 2) / span if span else 0.0
    codes = np.where(known, np.rint(LEVELS * share), NO_VALUE)
    return Quantised(codes.astype(np.uint16), low, high)


def restore(quantised: Quantised) -> npt.NDArray[np.float64]:
    """Return the values of codes, shape (n,); NaN for none."""
    codes, low, high = quantised
    values = low + (high / LEVELS - low / LEVELS) * codes
    return np.where(codes == NO_VALUE, np.nan, values)


def pack(columns: Sequence[Codes]) -> bytes:
    """Return columns of codes as compressed bytes.

    Of each column the steps from one particle to the next are kept, for neighbours on a
    lattice are alike, and of these first all low bytes and then all high ones: a third
    of the size that the codes as they are would have.

    Parameters
    ----------
    columns : sequence of ndarray of uint16, shape (n,)
        All of one length.

    Returns
    -------
    bytes
        In the format of zlib (RFC 1950).
    """
    table = np.stack(columns).astype("<u2")
    table[:, 1:] -= table[:, :-1].copy()
    planes = table.view(np.uint8).reshape(*table.shape, 2).transpose(0, 2, 1)
    return zlib.compress(planes.tobytes(), 6)


def unpack(packed: bytes, columns: int) -> list[Codes]:
    """Return the columns of packed codes."""
    planes = np.frombuffer(zlib.decompress(packed), np.uint8).reshape(columns, 2, -1)
    table = planes.transpose(0, 2, 1).copy().view("<u2")[:, :, 0]
    return list(np.cumsum(table, axis=1, dtype=np.uint16))
