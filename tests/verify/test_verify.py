"""The framework: what is checked, run, written and said, on problems of no physics."""

import csv
import io
import json
import math
import re

import pytest
from documents import table_rows, text_of
from launch import MPISPH, call, launch
from mpi4py import MPI
from report_pages import Page, assert_links_lead_somewhere, assert_nothing_is_fetched
from rich.console import Console

from mpisph.case import case_from_dict
from mpisph.core.errors import InputError
from mpisph.verify.page import write_page
from mpisph.verify.plots import Panel, draw_panels
from mpisph.verify.problem import Check, Problem, Setup, observed_order
from mpisph.verify.problems import PROBLEMS, find_problems
from mpisph.verify.record import COLUMNS, write_record
from mpisph.verify.runner import verify
from mpisph.verify.tables import problem_table, verdict_table

DOCUMENT = text_of("mpisph/verify/README.md")

PLATE = {
    "name": "plate",
    "shape": "plate",
    "thickness": 4e-3,
    "radius": 8e-3,
    "material": "al-6061-t6",
}
ROD = {**PLATE, "name": "rod", "shape": "cylinder", "length": 4e-3, "radius": 3e-3}
del ROD["thickness"]
ROD |= {"position": -4e-3, "velocity": 2000.0}


def plates(quick, **more):
    """Return one coarse run, and another unless they are to be quick."""
    data = {
        "title": "plates",
        "bodies": [ROD, PLATE],
        "resolution": {"spacing": 1e-3},
        "time": {"end": 2e-7},
        "output": {"figures": False},
        **more,
    }
    coarse = Setup("dx 1 mm", case_from_dict(data))
    return [coarse] if quick else [coarse, coarse._replace(label="again")]


def mass(solved):
    found = solved[-1].last["m"].sum()
    exact = solved[0].first["m"].sum()
    return [
        Check.within("mass", found, exact, 1e-9, "kg", order=1.0),
        Check.at_most("its error", abs(found - exact), 1e-9),
    ]


def dots(solved, out):
    z = solved[0].last["z"]
    draw_panels("Dots", [Panel("z, m", "z, m", {"here": (z, z)}, (z, z))], out)


SOUND = Problem("mass", "Mass of a body", "Lavoisier (1789)", plates, mass, dots, "z")
WRONG = SOUND._replace(
    name="wrong",
    check=lambda _: [Check.at_least("peak <b>", math.nan, 3.6, 4.0, "kg/m3")],
)
BROKEN = SOUND._replace(
    name="broken",
    setups=lambda quick: plates(quick, limits={"density_ratio_max": 1.0001}),
)


def run_all(folder, *problems, quick=True):
    quiet = Console(quiet=True)
    return verify(problems, MPI.COMM_SELF, folder, quiet, quick)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("verify")


@pytest.fixture(scope="module")
def verdicts(folder):
    return run_all(folder, SOUND, WRONG, BROKEN)


def test_bounds_decide():
    assert Check.within("x", 1.1, 1.0, 0.11).passed
    assert not Check.within("x", 0.88, 1.0, 0.11).passed
    assert Check.at_most("x", -1.0, 0.5).passed
    assert not Check.at_most("x", 0.51, 0.5).passed
    assert Check.at_least("x", 3.6, 3.6, 4.0).passed
    assert not Check.at_least("x", math.nan, 3.6, 4.0).passed
    words = [Check.within("", 0, 1, 0.05), Check.at_most("", 0, 2), WRONG.check(0)[0]]
    assert [check.bound for check in words] == ["±0.05", "≤ 2", "≥ 3.6"]


def test_order_is_the_slope_of_the_errors():
    assert observed_order([0.1, 0.05, 0.025], [4e-2, -1e-2, 2.5e-3]) == pytest.approx(2)
    assert observed_order([0.1], [1.0]) is None
    assert observed_order([0.1, 0.05], [1.0, 0.0]) is None
    assert observed_order([0.1, 0.05], [1.0, math.nan]) is None


def test_what_is_sound_passes_and_what_is_not_fails(verdicts, folder):
    assert [verdict.passed for verdict in verdicts] == [True, False, False]
    sound, wrong, broken = verdicts
    assert not sound.reason
    assert not wrong.reason
    assert broken.reason.startswith("dx 1 mm: unstable (density) at step ")
    assert not broken.checks
    assert broken.figure is None
    assert (folder / "mass.png").exists()
    assert (folder / "mass" / "dx-1-mm" / "result.json").exists()
    assert [run.label for run in sound.runs] == ["dx 1 mm"]


def test_all_runs_are_made_again(folder):
    path = folder / "mass" / "dx-1-mm" / "result.json"
    before = path.stat().st_mtime_ns
    (verdict,) = run_all(folder, SOUND, quick=False)
    assert path.stat().st_mtime_ns > before
    assert [run.label for run in verdict.runs] == ["dx 1 mm", "again"]


def test_table_and_record_say_all(verdicts, folder):
    write_record(folder, verdicts)
    with open(folder / "verify.csv", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == COLUMNS
    assert [row["problem"] for row in rows] == ["mass", "mass", "wrong", "broken"]
    assert [row["verdict"] for row in rows] == ["pass", "pass", "FAIL", "FAIL"]
    assert float(rows[0]["measured"]) == float(rows[0]["exact"])
    assert "unstable" in rows[3]["reason"]
    text = (folder / "verify.json").read_text(encoding="utf-8")
    record = json.loads(text, parse_constant=pytest.fail)
    mass_entry, wrong, broken = record["problems"]
    assert mass_entry["passed"]
    assert mass_entry["runs"][0]["particles"] > 0
    assert wrong["checks"][0]["measured"] is wrong["checks"][0]["high"] is None
    assert not broken["checks"]
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(verdict_table(verdicts))
    shown = console.export_text()
    for words in ("peak <b>, kg/m3", "nan", "≥ 3.6", "unstable (density)", "1.0"):
        assert words in shown
    assert shown.count("FAIL") == 2


def test_the_page_is_whole(verdicts, folder):
    write_page(folder, verdicts)
    page = Page((folder / "verify.html").read_text(encoding="utf-8"))
    assert_nothing_is_fetched(page)
    assert_links_lead_somewhere(page)
    assert "3 problems: 1 passed, 2 failed" in page.text
    assert page.headings.count("Mass of a body") == 3
    assert page.all("img", "alt") == ["z", "z"]
    assert "peak <b>" in page.text
    assert "Exact solution: Lavoisier (1789)" in page.text
    assert page.text.count("unstable (density)") == 1
    assert page.tags.count("img") == 2
    table = page.tables[0]
    assert table[1:] == [
        ["mass", "pass", "2", ""],
        ["wrong", "FAIL", "1", "peak <b>"],
        ["broken", "FAIL", "", "unstable"],
    ]


def test_problems_have_names_of_their_own_and_sources():
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(problem_table(find_problems([])))
    shown = console.export_text()
    for name, problem in PROBLEMS.items():
        assert name == problem.name
        assert name in shown
        assert problem.source
        assert [setup.label for setup in problem.setups(True)]


def test_the_document_has_them_all():
    rows = table_rows(
        text_of("mpisph/verify/README.md"), "| problem | exact solution |"
    )
    listed = re.findall(r"`([\w-]+)`", " ".join(row[0] for row in rows))
    assert listed == [*PROBLEMS]


def test_a_wrong_name_is_answered_with_the_right_one():
    with pytest.raises(InputError, match="did you mean uniform-expansion"):
        find_problems(["uniform-expansoin"])
    with pytest.raises(InputError, match="there are constant-pressure, "):
        find_problems(["qqqq"])
    name = "uniform-expansion"
    assert [p.name for p in find_problems([name, name])] == [name]


def test_the_command_says_how_it_ended(tmp_path, monkeypatch):
    monkeypatch.setitem(PROBLEMS, "mass", SOUND)
    monkeypatch.setitem(PROBLEMS, "wrong", WRONG)
    out = tmp_path / "new" / "folder"
    done = call("verify", "mass", "--quick", "-o", out)
    assert done.returncode == 0, done.stderr
    assert "1 problem: 1 passed, 0 failed" in done.stdout
    assert (out / "verify.html").exists()
    assert call("verify", "mass", "wrong", "--quick", "-o", out).returncode == 1
    done = call("verify", "mas")
    assert done.returncode == 2
    assert "did you mean mass?" in done.stderr
    done = call("verify", "--list")
    assert done.returncode == 0
    assert "Lavoisier (1789)" in done.stdout


def test_many_ranks_say_the_same(tmp_path):
    name = "uniform-expansion"
    one = call("verify", name, "--quick", "-o", tmp_path / "one")
    two = launch(2, MPISPH, "verify", name, "--quick", "-o", tmp_path / "two")
    assert one.returncode == two.returncode
    texts = [(tmp_path / n / "verify.csv").read_text() for n in ("one", "two")]
    assert texts[0] == texts[1]
    assert two.stdout.count("measured") == 1
