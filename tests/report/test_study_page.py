"""Pages of studies: what the runs say, beside the paper, whatever is missing."""

import json
import shutil

import pytest
from launch import CASES, MPISPH, call, launch
from mpi4py import MPI
from PIL import Image
from report_pages import Page, assert_links_lead_somewhere, assert_nothing_is_fetched
from rich.console import Console
from small_runs import SHOT, unended

from mpisph.core.errors import CaseError, MpisphError
from mpisph.report import run_page, study_page
from mpisph.report.run_page import write_report
from mpisph.run.session import run
from mpisph.study.model import load_study
from mpisph.study.store import case_folder

TITLE = "R_b <b>5 < 6 & 'x'</b>{{ 7 * 7 }}"
HEADING = TITLE.replace("R_b", "Rb")
REASON = "a <i>reason</i> & more"

TEXT = f"""
title = "{TITLE}"
source = "Some <one> (2003)"
base = "{SHOT}"

[set]
"output.every" = ""
"output.figures" = false
"time.end" = "2 us"
"resolution.npr" = 4
"measured.clock_offset" = "0.35 us"
"measured.exposures.0.time" = "1 us"
"measured.exposures.0.radius" = "7 mm"
"measured.exposures.0.length" = "2.1 mm"
"measured.exposures.1" = ""

[[parameters]]
name = "nph"
label = "NPH"
key = "resolution.nph"
values = [2.0, 2.5, 3.0]

[[variants]]
name = "sound"
label = "<sound>"

[[variants]]
name = "unstable"
set = {{ "limits.energy_drift" = 1e-18 }}

[figure]
kind = "lines"
x = "nph"
lines = "variant"
clocks = ["nominal"]

[paper]
values = [{{ at = {{ variant = "sound" }}, time = 1.0, radius = 7.7 }}]
"""

CLAIMS = """
title = "Claims"
source = "A paper"

[[claims]]
number = 3
text = "L_b falls <on>"
finding = "It <hardly> does"

[[claims.tries]]
name = "falls"
study = "small"
check = "falls"
where = { at = { variant = "sound" }, at_most = { nph = 2.5 } }
along = "nph"
columns = ["L_b_1us_mm"]
limit = 1.0

[[claims.tries]]
name = "grows"
study = "small"
check = "grows"
where = { at = { variant = "sound" }, at_most = { nph = 2.5 } }
along = "nph"
columns = ["L_b_1us_mm"]
limit = 1.0

[[claims.tries]]
name = "everything"
study = "small"
check = "all_unstable"

[[claims.tries]]
name = "other"
study = "another"
check = "all_unstable"

[[claims]]
number = 4
text = "of another study"

[[claims.tries]]
name = "other"
study = "another"
check = "all_unstable"
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A study with a case in every state, and the root of its runs."""
    folder = tmp_path_factory.mktemp("study")
    path, root = folder / "small.toml", folder / "root"
    path.write_text(TEXT)
    (folder / "claims.toml").write_text(CLAIMS)
    study = load_study(path)
    folders = [case_folder(root, case) for case in study.cases]
    for k in (0, 1, 3):
        run(study.cases[k].case, MPI.COMM_SELF, folders[k], Console(quiet=True))
    unended(folders[2], folders[0], state="failed", reason=REASON)
    unended(folders[4], folders[0], state="stopped", reason="walltime")
    return path, root, folders


@pytest.fixture(scope="module")
def page(made, tmp_path_factory):
    path, root, _ = made
    return page_of([path], root, tmp_path_factory.mktemp("page") / "report.html")


@pytest.fixture
def dots(monkeypatch):
    """Let every figure of a study be a dot; return the studies that were drawn."""
    drawn = []

    def draw(study, rows, file):
        drawn.append(study)
        Image.new("RGB", (8, 8), "red").save(file, "WEBP")

    monkeypatch.setattr(study_page, "can_draw", lambda study, rows: True)
    monkeypatch.setattr(study_page, "draw_figure", draw)
    return drawn


def page_of(studies, root, out, folders=()):
    text = write_report(folders, out, studies, root).read_text(encoding="utf-8")
    return Page(text)


def test_the_page_is_whole_in_itself(page):
    assert_nothing_is_fetched(page)
    assert_links_lead_somewhere(page)
    assert page.headings == [
        HEADING,
        "What is varied",
        "Parameters",
        "Variants, each with all values of the parameters",
        "In all cases",
        "Measured",
        "Figure",
        "Comparison with the paper’s values",
        "Claims of the paper",
        "3. Lb falls <on>",
        "All cases",
        "Cases that did not complete",
        f"1 case failed ({REASON})",
        "1 case unstable (energy_drift)",
        "1 case stopped (walltime)",
        "Provenance",
    ]
    assert len(page.pictures()) == 1
    assert not {"i", "sound", "one", "on", "hardly"} & set(page.tags)
    assert "after Some <one> (2003)" in page.text


def test_standings_and_notices(page):
    assert "6 cases: 2 completed1 unstable1 failed1 stopped1 to do" in page.text
    for words in (
        "1 of 6 cases has not been run: mpisph study run continues",
        "1 of 6 cases has been stopped: mpisph study run continues",
        "1 of 6 cases has failed; the reasons are given below.",
    ):
        assert words in page.text


def test_what_is_varied(page):
    assert page.table("", "key") == [["NPH", "resolution.nph", "2.0, 2.5, 3.0"]]
    assert page.table("variant", "base case") == [
        ["<sound>", str(SHOT), "–"],
        ["unstable", str(SHOT), "limits.energy_drift = 1e-18"],
    ]
    assert page.value("time.end") == "2 us"
    assert page.value("output.every") == "removed"
    assert page.table("", "exposure")[0][:4] == ["all cases", "1 µs", "7.0", "2.1"]


def test_the_table_says_what_the_runs_say(page, made):
    rows = page.table("case", "variant", "NPH", "state")
    assert [row[:4] for row in rows] == [
        ["0", "<sound>", "2.0", "completed"],
        ["1", "<sound>", "2.5", "completed"],
        ["2", "<sound>", "3.0", "failed"],
        ["3", "unstable", "2.0", "unstable"],
        ["4", "unstable", "2.5", "stopped"],
        ["5", "unstable", "3.0", "to do"],
    ]
    result = json.loads((made[2][1] / "result.json").read_text())
    found = {
        c["clock"]: (
            c["radius"],
            c["radius_error_percent"],
            c["length"],
            c["length_error_percent"],
        )
        for c in result["comparisons"]
        if c["figure"] == "outermost"
    }
    totals = [(abs(f[1]) + abs(f[3])) / 2 for f in found.values()]
    sizes = [
        f"{1e3 * found[clock][k]:.1f} ({found[clock][k + 1]:+.1f})".replace("-", "−")
        for k in (0, 2)
        for clock in ("nominal", "offset")
    ]
    energy = f"{result['conservation']['energy_error_max']:.1e}".replace("-", "−")
    steps = f"{result['step']}"
    assert rows[1][4:] == [f"{t:.1f}" for t in totals] + [*sizes, energy, steps]
    assert rows[5][4:] == ["–"] * 8


def test_the_papers_figures_stand_beside_ours(page):
    row = page.table("case", "exposure", "Rb measured")[0]
    assert row[:4] == ["<sound>, NPH 2.0", "1 µs", "7.0", "7.7 (+10.0)"]
    assert row[4:6] == page.table("case", "variant")[0][6:8]
    assert row[7] == "–"


def test_claims_with_their_verdicts(page, made):
    lengths = []
    for folder in made[2][:2]:
        result = json.loads((folder / "result.json").read_text())
        lengths += [
            c["length"]
            for c in result["comparisons"]
            if (c["clock"], c["figure"]) == ("nominal", "outermost")
        ]
    words = ["not reproduced", "reproduced"]
    falls = lengths[1] < lengths[0]
    change = f"{100 * (lengths[1] / lengths[0] - 1):.1f} %"
    assert f"{words[falls]} falls: falls in {int(falls)} of 1 steps" in page.text
    assert f"{words[not falls]} grows: grows in {1 - falls} of 1 steps" in page.text
    assert f"by {change}" in page.text
    assert "not run everything: 3 of 6 cases have not been run" in page.text
    assert "elsewhere other: looks at the study another" in page.text
    assert "It <hardly> does" in page.text
    assert "of another study" not in page.text
    badges = [a["class"] for t, a in page.attributes if t == "span"]
    assert badges[-4:] == [
        f"badge {'good' if falls else 'bad'}",
        f"badge {'bad' if falls else 'good'}",
        "badge ",
        "badge ",
    ]


def test_cases_that_did_not_complete(page, made):
    result = json.loads((made[2][3] / "result.json").read_text())
    heads = ("case", "settings", "run")
    rows = [t[1] for t in page.tables if tuple(t[0][:3]) == heads]
    time = f"{1e6 * result['time']:.2f}"
    assert rows == [
        ["2", "<sound>, NPH 3.0", made[2][2].name, "–", "–"],
        ["3", "unstable, NPH 2.0", made[2][3].name, str(result["step"]), time],
        ["4", "unstable, NPH 2.5", made[2][4].name, "–", "–"],
    ]


def test_the_table_of_the_study_is_named(page, made):
    wanted = made[1] / "studies" / "small" / "table.csv"
    assert page.value("table with all columns").startswith(f"{wanted};")
    assert "(3 runs)" in page.value("program")


def test_figures_show_both_readings_and_leave_the_root_alone(made, tmp_path, dots):
    path, root, _ = made
    page_of([path], root, tmp_path / "report.html")
    assert [study.file.figure.clocks for study in dots] == [("nominal", "offset")]
    assert not (root / "studies").exists()


def test_long_tables_are_folded(made, tmp_path, dots, monkeypatch):
    path, root, _ = made
    assert "details" not in page_of([path], root, tmp_path / "report.html").tags
    monkeypatch.setattr(run_page, "MOST_OPEN", 5)
    page = page_of([path], root, tmp_path / "report.html")
    assert page.tags.count("details") == 1
    assert "Table of 6 cases" in page.text
    assert len(page.table("case", "variant", "NPH")) == 6


def test_without_runs_and_claims_the_page_is_sound(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TEXT)
    page = page_of([path], tmp_path / "none", tmp_path / "report.html")
    assert_links_lead_somewhere(page)
    assert "No case has been run yet" in page.text
    assert "6 cases: 6 to do" in page.text
    assert "There is no figure yet" in page.text
    assert page.table("case", "variant", "NPH", "state")[5][3] == "to do"
    assert len(page.table("case", "variant", "NPH", "state")[5]) == 4
    assert page.pictures() == []
    assert not {"Figure", "Claims of the paper"} & set(page.headings)
    assert "Cases that did not complete" not in page.headings


def test_runs_and_studies_share_a_page(made, tmp_path, dots):
    path, root, folders = made
    folder = shutil.copytree(folders[0], tmp_path / "run")
    shutil.rmtree(folder / "snapshots")  # pictures take time
    (folder / "history.csv").unlink()
    page = page_of([path, path], root, tmp_path / "all.html", [folder])
    assert_nothing_is_fetched(page)
    assert_links_lead_somewhere(page)
    assert page.headings[0] == "2 studies and 1 run of mpisph"
    assert page.all("a", "href")[:3] == ["#study-1", "#study-2", "#run-1"]
    assert page.headings.count(HEADING) == 2


def test_mistakes_are_named(made, tmp_path, dots):
    out = tmp_path / "report.html"
    with pytest.raises(CaseError, match=r"nowhere\.toml"):
        write_report([], out, [tmp_path / "nowhere.toml"], tmp_path)
    path, root, _ = made
    study = tmp_path / "small.toml"
    study.write_text(TEXT)
    (tmp_path / "claims.toml").write_text(
        CLAIMS.replace('check = "grows"', 'check = "shrinks"')
    )
    with pytest.raises(CaseError, match="claim 3, grows: expected one of"):
        write_report([], out, [study], tmp_path)
    spoilt = shutil.copytree(root, tmp_path / "root")
    (case_folder(spoilt, load_study(path).cases[0]) / "result.json").write_text("{}")
    with pytest.raises(MpisphError, match=r"result\.json: not a result"):
        write_report([], out, [path], spoilt)
    assert not out.exists()


def test_ranges_beside_the_papers(tmp_path, dots, monkeypatch):
    study = load_study(CASES / "studies" / "table5.toml")
    text = (CASES / "studies" / "table5.toml").read_text()
    text = text.replace("../", f"{CASES}/").replace("[4, 5, 6, 7, 8, 9, 10]", "[4, 6]")
    kept = [
        line
        for line in text.splitlines()
        if "at = { npr" not in line or "npr = 4" in line or "npr = 6" in line
    ]
    path = tmp_path / "few.toml"
    path.write_text("\n".join(kept))

    def collect(study, root):
        # At NPR 4 all is too bad; at NPR 6 what has alpha up to 5, and all is run but
        # the cases with NPH 1.
        rows = []
        for case in study.cases:
            npr, nph, alpha = case.settings.values()
            row = {"case": case.number, "variant": "", **case.settings}
            row |= {"run": case.key, "status": "completed", "reason": None}
            if nph > 1.0:
                row["total_error_percent"] = 5.0 if npr == 6 and alpha <= 5.0 else 50.0
            rows.append(row)
        return rows

    assert len(study.cases) == 798
    monkeypatch.setattr(study_page, "collect", collect)
    page = page_of([path], tmp_path, tmp_path / "report.html")
    # The paper: none at NPR 4 and NPH 1.2, 2.0, 2.5; 2 and 1 values at 1.5 and 1.8.
    # At NPR 6: from 4.5 (NPH 1.2; of 19 values 2 are below in both, 8 here, 9 there);
    # 3.0-9.5 (5, 5, 9); 2.0-7.0 (7, 3, 4); 1.5-5.0 (8, 2, 0); 1.5-2.0 (2, 8, 0).
    both, ours, paper = 24, 26, 22 + 3
    alike = 190 - ours - paper
    rows = page.table("reading of the clock")
    inside = both + paper
    assert rows[0] == [
        "nominal times",
        f"{alike} of 190",
        f"{100 * alike / 190:.0f}\xa0%",
        f"{100 * (190 - inside) / 190:.0f}\xa0%",
        str(both),
        str(ours),
        str(paper),
    ]
    assert rows[1][1:3] == ["0 of 0", "–"]
    grid = page.table("NPR\xa0\\ NPH", "1.0", "1.2")
    assert grid[0][:4] == ["4", "–none", "nonenone 19/19", "none0.5–1.0 17/19"]
    assert grid[0][4:] == ["none0.3–0.6 18/19", "nonenone 19/19", "nonenone 19/19"]
    assert grid[1][2:4] == ["0.5–5.0≥\xa04.5 2/19", "0.5–5.03.0–9.5 5/19"]
    cells = [a["class"] for t, a in page.attributes if t == "td" and "class" in a]
    shades = [c for c in cells if c != "word"][:12]
    assert shades[:3] == ["unknown", "shade-4", "shade-4"]
    assert shades[6:9] == ["unknown", "shade-0", "shade-1"]


def test_a_page_of_table_5_is_light(tmp_path, dots, monkeypatch):
    def collect(study, root):
        row = {"run": "0123456789ab", "status": "completed", "reason": None}
        row |= {"steps": 2345, "energy_error": 1.2e-5, "fitted_offset_us": 1.234}
        for total in ("", "_offset", "_fitted"):
            row[f"total_error{total}_percent"] = 12.34
        for time in ("6us", "19us", "6us_offset", "19us_offset"):
            for quantity in ("R_b", "L_b"):
                row[f"{quantity}_{time}_mm"] = 123.4
                row[f"{quantity}_{time}_error_percent"] = -12.34
        return [
            {"case": c.number, "variant": "", **c.settings} | row for c in study.cases
        ]

    monkeypatch.setattr(study_page, "collect", collect)
    out = tmp_path / "report.html"
    page = page_of([CASES / "studies" / "table5.toml"], tmp_path, out)
    assert len(page.table("case", "NPR")) == 798
    assert out.stat().st_size < 1_000_000


def test_a_study_over_resolutions(tmp_path, dots, monkeypatch):
    def collect(study, root):
        rows = []
        for case in study.cases:
            npr = case.settings["npr"]
            row = {"case": case.number, "variant": case.variant, **case.settings}
            row |= {"run": case.key, "status": "completed", "reason": None}
            if case.variant == "shot-1283":
                row["R_b_6us_mm"] = 20.0 + 40.0 / npr
                row["L_b_6us_offset_mm"] = 50.0 - 400.0 / npr**2
            rows.append(row)
        return rows

    monkeypatch.setattr(study_page, "collect", collect)
    study = CASES / "studies" / "convergence.toml"
    page = page_of([study], tmp_path, tmp_path / "report.html")
    assert [s.file.figure.clocks for s in dots] == [("nominal",), ("offset",)]
    nominal, offset = (t[1:] for t in page.tables if t[0][0] == "quantity")
    values = ["24.00", "22.00", "21.00", "20.50"]
    assert len(nominal) == 1
    assert nominal[0][:2] == ["Rb at 6 µs, outermost [mm]", "4-1283"]
    assert nominal[0][2:8] == [*values, "monotone", "1.00"]
    assert nominal[0][8:] == ["20.00", "3.0\xa0%", "22.30"]
    assert offset[0][0] == "Lb at 6.89 µs, outermost [mm]"
    assert offset[0][7:] == ["2.00", "50.00", "0.2\xa0%", "47.70"]
    monkeypatch.setattr(study_page, "collect", lambda study, root: no_sizes(study))
    page = page_of([study], tmp_path, tmp_path / "report.html")
    assert "Convergence" not in page.headings


def no_sizes(study):
    return [
        {"case": c.number, "variant": c.variant, **c.settings}
        | {"run": c.key, "status": "completed", "reason": None}
        for c in study.cases
    ]


def test_the_command_takes_studies_and_runs(made, tmp_path, monkeypatch):
    path, _, _ = made
    root = tmp_path / "empty"
    monkeypatch.chdir(tmp_path)
    done = call("report", path, "--runs", root)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{root / 'studies' / 'small' / 'report.html'}\n"
    done = launch(2, MPISPH, "report", path, path, "--runs", root)
    assert done.returncode == 0, done.stderr
    assert "2 studies of mpisph" in (tmp_path / "report.html").read_text()
