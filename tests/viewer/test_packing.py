"""Fields as numbers of 16 bits: how far they are off, and what comes back."""

import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mpisph.viewer.packing import LEVELS, NO_VALUE, pack, quantise, restore, unpack

NUMBERS = st.floats(-1e300, 1e300)


@given(arrays(np.float64, st.integers(1, 30), elements=NUMBERS))
def test_a_value_is_off_by_half_a_step_at_most(values):
    quantised = quantise(values)
    step = quantised.high / LEVELS - quantised.low / LEVELS
    rounding = 4e-16 * np.abs(values).max()
    off = np.abs(restore(quantised) - values)
    assert np.all(off <= 0.5 * step * (1.0 + 1e-9) + rounding)
    assert (quantised.low, quantised.high) == (values.min(), values.max())


def test_what_has_no_value_stays_so():
    quantised = quantise(np.array([1.0, np.nan, 3.0, np.inf, 2.0]))
    assert quantised.codes.tolist() == [0, NO_VALUE, LEVELS, NO_VALUE, LEVELS // 2]
    assert np.isnan(restore(quantised)).tolist() == [False, True, False, True, False]


def test_nothing_known_and_nothing_that_differs():
    assert np.isnan(restore(quantise(np.full(3, np.nan)))).all()
    assert restore(quantise(np.full(3, -7.25))).tolist() == [-7.25] * 3


@given(arrays(np.uint16, st.tuples(st.integers(1, 4), st.integers(1, 40))))
def test_codes_come_back_as_they_were(table):
    back = unpack(pack(list(table)), len(table))
    assert np.array_equal(np.stack(back), table)


def test_the_bytes_are_those_that_a_browser_expects():
    """Steps from particle to particle; low bytes first, then the high ones."""
    packed = pack([np.array([1, 0x0203, 2], np.uint16)])
    assert zlib.decompress(packed) == bytes([0x01, 0x02, 0xFF, 0x00, 0x02, 0xFD])


@pytest.mark.parametrize("smooth", [True, False])
def test_neighbours_that_are_alike_take_less_room(smooth):
    values = np.cumsum(np.random.default_rng(0).integers(0, 9, 5000))
    codes = quantise(values.astype(float)).codes
    if not smooth:
        codes = np.random.default_rng(1).permutation(codes)
    assert (len(pack([codes])) < 0.6 * codes.nbytes) == smooth
