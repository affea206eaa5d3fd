"""The command ``mpisph assess``, as a person calls it."""

import csv

import pytest
from launch import CASES, call
from report_pages import Page

TESTS = CASES / "studies" / "whipple-tests.csv"

# A thin wall, a block, and a foil that is too thin for the spacing.
HEAD = (
    "row,source,shotID,proj_mat,proj_diam [mm],velocity,bumper_mat,bumper_thick [mm],"
    "standoff [mm],wall_mat,wall_thick [mm],result"
)
ROWS = (
    "1,<b>Report</b>,A,AA2017-T4,2,7,AA6061-T6,0.5,8,AA6061-T6,0.5,P",
    "2,Report,B,AA2017-T4,2,7,AA6061-T6,0.5,8,AA6061-T6,6,NP",
    "3,Report,C,AA2017-T4,2,7,AA6061-T6,0.01,8,AA6061-T6,0.5,P",
)
COARSE = (
    "resolution.npr=4",
    "time.end=6 us",
    "output.every=2 us",
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("assess")
    (folder / "three.csv").write_text("\n".join([HEAD, *ROWS]) + "\n")
    return folder


def assess(folder, *more):
    settings = [word for key in COARSE for word in ("--set", key)]
    return call("assess", folder / "three.csv", "-o", folder / "a", *settings, *more)


def table(folder):
    with (folder / "a" / "assess.csv").open(newline="") as file:
        return list(csv.DictReader(file))


@pytest.mark.slow
def test_from_a_file_of_tests_to_a_page(folder):
    before = assess(folder, "--collect-only")
    assert before.returncode == 0, before.stderr
    assert "1 of 3 tests computed" in before.stdout  # the one that cannot be
    assert [row["status"] for row in table(folder)] == ["to do", "to do", "refused"]
    done = assess(folder)
    assert done.returncode == 0, done.stderr
    assert "3 of 3 tests computed" in done.stdout
    first, second, third = table(folder)
    assert [r["status"] for r in (first, second, third)] == [
        "completed",
        "completed",
        "refused",
    ]
    assert first["result"] == "P"
    assert first["computed"] in {"P", "NP", "undecided"}
    assert float(first["d_over_dc"]) > 1.0 > float(second["d_over_dc"])
    assert (first["equation"], second["equation"]) == ("P", "NP")
    assert third["verdict"] == "undecided"
    assert "thinner than" in third["reason"]
    assert "too few to bend" in first["warnings"]
    for row in (first, second):
        assert (folder / "a" / "cases" / row["run"] / "result.json").exists()
        assert float(row["damage"]) >= 0.0
        assert float(row["wall_time_us"]) == pytest.approx(6.0)
    page = Page((folder / "a" / "assess.html").read_text(encoding="utf-8"))
    assert "<b>Report</b>" in page.text
    assert "b" not in page.tags
    assert (folder / "a" / "damage.png").stat().st_size > 1000
    again = assess(folder)
    assert "of 2 runs" not in again.stderr  # nothing is run twice
    assert again.stdout == done.stdout


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((), "expected TESTS"),
        ((TESTS, "--rows", "1"), "expected numbers of the column row"),
        ((TESTS, "--set", "shield.wall.thickness=1 mm"), "each test gives its own"),
        (("none.csv",), "no such file"),
        ((CASES / "piekutowski-4-1353.toml",), "expected a column"),
    ],
)
def test_a_wrong_call_is_explained(tmp_path, arguments, text):
    done = call("assess", *arguments, "-o", tmp_path / "a")
    assert done.returncode in {1, 2}
    assert text in done.stderr
    assert "Traceback" not in done.stderr


def test_the_alloys_are_listed_with_their_cards():
    done = call("assess", "--alloys")
    assert done.returncode == 0
    (line,) = (s for s in done.stdout.splitlines() if "AA5456-H116" in s)
    assert line.split()[:3] == ["AA5456-H116", "al-5083-h116", "255"]
    assert "the same temper" in line
