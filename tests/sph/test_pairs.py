"""The buffer of packed neighbours; the sums are tested in test_rates.py."""

import numpy as np
import pytest

from mpisph.sph.pair_records import RECORD_FIELDS, PairRecord
from mpisph.sph.pairs import LANES, VOLUME, make_buffer, pack_neighbours


@pytest.mark.parametrize("candidates", [0, 1, 8, 9, 512, 513, 1000])
def test_the_buffer_has_room_for_all_candidates_and_what_fills_them_up(candidates):
    groups, length, fields = make_buffer(candidates).shape
    assert groups * fields == RECORD_FIELDS
    assert length >= candidates + LANES


@pytest.mark.parametrize("n", [0, 1, 7, 8, 9, 16, 21])
def test_neighbours_are_packed_and_filled_up_with_rings_of_no_volume(n):
    records = np.random.default_rng(n).normal(size=(40, RECORD_FIELDS))
    index = np.full(n + LANES, -1)
    index[:n] = np.random.default_rng(1).permutation(40)[:n]
    rows = make_buffer(n)
    rows[:] = np.nan
    padded = pack_neighbours(records, index, n, rows)
    assert padded == -(-n // LANES) * LANES
    got = np.concatenate(rows[:, :padded], axis=1)
    assert got.shape == (padded, RECORD_FIELDS)
    np.testing.assert_array_equal(got[:n], records[index[:n]])
    volume = PairRecord._fields.index("V_F")
    assert volume == VOLUME
    others = np.arange(RECORD_FIELDS) != volume
    for row in got[n:]:
        assert row[volume] == 0.0
        np.testing.assert_array_equal(row[others], got[0][others])
