"""Numbers in sentences."""

import pytest

from mpisph.core.words import counted


@pytest.mark.parametrize(
    ("n", "text"),
    [(0, "0 ranks"), (1, "1 rank"), (2, "2 ranks"), (12345, "12345 ranks")],
)
def test_a_noun_follows_its_number(n, text):
    assert counted(n, "rank") == text
