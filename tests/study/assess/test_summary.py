"""What a terminal shows of an assessment."""

from launch import CASES

from mpisph.study.assess.outcome import Assessed
from mpisph.study.assess.published import read_tests
from mpisph.study.assess.summary import Sheet, as_text, summary_text

TESTS = read_tests(CASES / "studies" / "whipple-tests.csv")


def test_columns_stand_below_their_heads():
    rows = [("a", "1", "x"), ("bcd", "22", "yz")]
    sheet = Sheet("Title", ("name", "n", "word"), rows, (2,))
    assert as_text(sheet).splitlines() == [
        "Title",
        "  name   n  word",
        "  a      1  x",
        "  bcd   22  yz",
    ]
    assert as_text(sheet, (0, 2)).splitlines()[1] == "  name  word"


def test_a_terminal_names_the_worst_misses_and_counts_the_others():
    tests = [
        Assessed(
            test._replace(failed=True), "completed", "holds", "", None, 0.9 - 0.01 * k
        )
        for k, test in enumerate(TESTS[:30])
    ]
    text = summary_text(tests, 20)
    misses = text.partition("\nMisses\n")[2].splitlines()
    assert misses[1].split()[0] == TESTS[29].row
    assert len(misses) == 1 + 20 + 1
    assert "and 10 more" in misses[-1]
    assert "Undecided" not in text
    assert "0.0 %" in text
