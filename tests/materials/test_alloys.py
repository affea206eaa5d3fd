"""The table of alloys of tests."""

import pytest

from mpisph.materials import card_names
from mpisph.materials.alloys import alloys, card_yield, find_alloy
from mpisph.materials.library import card_data

OF_TESTS = (
    "AA1100-O", "AA2017-T4", "AA2024-T3", "AA2024-T351", "AA2219-T851", "AA2219-T87",
    "AA3003-H14", "AA5154-O", "AA5456-H116", "AA6061-T6", "AA6061-T651", "AA7075-T6",
    "AA7075-T73", "AA99.9%", "Alclad 7075-T6",
)  # fmt: skip
"""Every alloy of the 327 published tests."""


@pytest.mark.parametrize("name", OF_TESTS)
def test_every_alloy_of_the_tests_has_a_card(name):
    alloy = find_alloy(name)
    assert alloy is not None
    assert alloy.name == name
    assert alloy.card in card_names()


def test_a_card_of_another_alloy_says_why():
    for alloy in alloys():
        # AA6061-T6 is al-6061-t6; all else is a stand-in.
        own = alloy.card == alloy.name.lower().replace("aa", "al-", 1)
        assert own != bool(alloy.stand_in), alloy.name


@pytest.mark.parametrize(
    "name", ["AA6061-T6", "Al 6061-T6", "6061-t6", "aluminium 6061 T6", "al-6061-t6"]
)
def test_names_are_written_in_many_ways(name):
    assert find_alloy(name).card == "al-6061-t6"


def test_other_materials_go_by_their_card():
    assert find_alloy("steel-304") == ("steel-304", "steel-304", "", None)
    assert find_alloy("unobtainium") is None
    assert find_alloy("") is None


def test_the_yield_is_that_of_the_alloy_and_near_the_cards():
    assert find_alloy("AA7075-T6").yield_strength == pytest.approx(503.3e6, rel=1e-4)
    assert card_yield("al-7075-t6") == find_alloy("AA7075-T6").yield_strength
    assert card_yield("steel-304") is None
    for alloy in alloys():
        table = card_data(alloy.card).get("elastic-plastic")
        if not alloy.stand_in and alloy.name != "AA2024-T4":
            value = table["yield_strength"]["value"].split()
            pascal = float(value[0]) * {"MPa": 1e6, "GPa": 1e9}[value[1]]
            assert alloy.yield_strength == pytest.approx(pascal, rel=0.2), alloy.name
