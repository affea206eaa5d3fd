"""The page of an assessment, made of verdicts that are given here."""

import pytest
from launch import CASES
from PIL import Image
from report_pages import Page, assert_links_lead_somewhere, assert_nothing_is_fetched

from mpisph.report import assess_page
from mpisph.report.assess_page import write_page
from mpisph.study.assess.cases import plan
from mpisph.study.assess.outcome import Assessed
from mpisph.study.assess.published import read_tests

TESTS = read_tests(CASES / "studies" / "whipple-tests.csv")[:6]
HOSTILE = "<script>alert(1)</script>{{ 7 * 7 }}"

HEADS = ("row", "test", "d [mm]", "v [km/s]")


@pytest.fixture
def written(tmp_path):
    """The page of six tests: right, two misses, undecided, to do, a hostile one."""
    tests = [test._replace(failed=True) for test in TESTS]
    tests[1] = tests[1]._replace(source=HOSTILE, shot="")
    made = plan(tests, tmp_path, HOSTILE)

    def judged(k, outcome, damage, standing="completed"):
        folder = tmp_path / "cases" / f"{k}"
        reason = f"reason {k} {HOSTILE}"
        return Assessed(tests[k], standing, outcome, reason, folder, damage)

    assessed = [
        judged(0, "perforated", 3.0),
        judged(1, "holds", 0.8),
        judged(2, "holds", 0.2),
        judged(3, "undecided", 1.01),
        judged(4, "undecided", None, "to do"),
        judged(5, "undecided", None, "failed"),
    ]
    for k, size in ((1, (30, 10)), (2, (40, 20))):
        picture = tmp_path / "cases" / f"{k}" / "figures" / "wall.png"
        picture.parent.mkdir(parents=True)
        Image.new("RGB", size).save(picture)
    path = write_page(made, assessed, tmp_path)
    return assessed, Page(path.read_text(encoding="utf-8"))


def test_it_says_how_many_are_right(written):
    assessed, page = written
    right = sum(t.test.ratio > 1.0 for t in assessed if t.ended)
    assert "1 of 5 tests come out right (20.0 %), 2 wrong, 2 are undecided" in page.text
    assert f"equation is right on {right} ({20.0 * right:.1f} %)" in page.text
    assert "1 run not at an end" in page.text
    assert "1 test failed: see Undecided" in page.text
    shares = page.table("velocity", "tests", "right")
    assert shares[0][:5] == ["all", "5", "20.0 %", "33.3 %", "2"]
    matrix = page.table("test", "holds", "fails")
    assert [row[:4] for row in matrix] == [
        ["held (NP)", "0", "0", "0"],
        ["failed (P)", "2", "1", "2"],
    ]


def test_misses_are_shown_the_worst_first_with_their_walls(written):
    assessed, page = written
    worst, next_ = assessed[2], assessed[1]
    rows = page.table(*HEADS)
    assert [row[0] for row in rows] == [worst.test.row, next_.test.row]
    assert rows[0][-2] == "0.20"
    sizes = list(zip(page.all("img", "width"), page.all("img", "height"), strict=True))
    assert sizes[-2:] == [("40", "20"), ("30", "10")]
    assert f"Row {worst.test.row}, {worst.test.name}: failed in the test" in page.text


def test_the_worst_alone_have_pictures(written, tmp_path, monkeypatch):
    assessed, page = written
    monkeypatch.setattr(assess_page, "MOST_PICTURES", 1)
    made = plan([t.test for t in assessed], tmp_path, "again")
    path = write_page(made, assessed, tmp_path)
    fewer = Page(path.read_text(encoding="utf-8"))
    assert len(fewer.all("img", "src")) == len(page.all("img", "src")) - 1


def test_hostile_words_stay_words(written):
    page = written[1]
    assert "script" not in page.tags
    assert HOSTILE in page.headings[0]
    assert "49" not in page.headings[0]
    assert_nothing_is_fetched(page)
    assert_links_lead_somewhere(page)
