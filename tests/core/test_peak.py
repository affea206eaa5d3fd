"""The sums that the peak of a core is measured with."""

import numpy as np
import pytest

from mpisph.core.peak import rounds_of_32, rounds_of_64


@pytest.mark.parametrize("rounds_of", [rounds_of_32, rounds_of_64])
def test_the_peak_is_that_of_sums_that_are_really_made(rounds_of):
    lanes = int(rounds_of.__name__.rpartition("_")[2])
    sums = np.arange(lanes + 1.0)
    rounds_of(sums, 2)
    want = (np.arange(lanes) * 0.99 + 0.5) * 0.99 + 0.5
    np.testing.assert_allclose(sums[:lanes], want, rtol=1e-15)
    assert sums[lanes] == lanes
