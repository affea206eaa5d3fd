"""Whole pages: sound HTML in one file, whatever became of the run."""

import json
import re
import shutil

import h5py
import numpy as np
import pytest
from launch import CASES, MPISPH, call, launch
from PIL import Image
from report_pages import Page, assert_links_lead_somewhere, assert_nothing_is_fetched
from small_runs import EXPOSED, small_run, unended

from mpisph.core.errors import MpisphError
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import read_run
from mpisph.report import run_page
from mpisph.report.analysis import AnalysisFigure
from mpisph.report.run_page import write_report

PLATES = CASES / "plate-impact.toml"


def page_of(folders, out):
    return Page(write_report(folders, out).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def page(finished, tmp_path_factory):
    return page_of([finished], tmp_path_factory.mktemp("page") / "new" / "report.html")


@pytest.fixture
def copy(finished, tmp_path):
    return shutil.copytree(finished, tmp_path / "copy")


def dot(file):
    """Write the smallest of pictures."""
    Image.new("RGB", (8, 8), "red").save(file, "WEBP")


@pytest.fixture
def dots(monkeypatch):
    """Let every picture be a dot, for a page whose words alone are read."""
    monkeypatch.setattr(run_page, "draw_cloud", lambda *given, **_: dot(given[-1]))
    monkeypatch.setattr(run_page, "draw_shield", lambda *given: dot(given[1]))
    monkeypatch.setattr(run_page, "draw_wall", lambda *given: dot(given[1]))
    monkeypatch.setattr(run_page, "draw_history", lambda *given: dot(given[2]))
    monkeypatch.setattr(run_page.Frame, "save", lambda _, out: dot(out))
    monkeypatch.setattr(run_page, "_played", lambda *_: None)
    analysis = AnalysisFigure("Dot", "a dot", lambda *given: dot(given[2]))
    monkeypatch.setattr(run_page, "ANALYSES", (analysis,))


def test_the_page_is_whole_in_itself(page):
    assert_nothing_is_fetched(page)
    assert_links_lead_somewhere(page)
    assert page.all("meta", "charset") == ["utf-8"]
    assert page.headings[7].startswith("The heaviest fragments, of ")
    assert "width=device-width" in page.all("meta", "content")[0]
    assert page.headings[1:] == [
        "Bodies",
        "Debris cloud compared with the experiment",
        "Cloud, plate and ejecta at the exposures",
        "Other times",
        "Debris",
        "Exposure at 1 µs, clock offset 0.35 µs: 1.35 µs after first contact",
        page.headings[7],
        "Hole in the plate",
        "History",
        "Set-up",
        "Resolution and scheme",
        "Materials",
        "Conservation and time",
        "Conservation",
        "Time",
        "Provenance",
    ]


def test_title_verdict_and_state(page, finished):
    result = json.loads((finished / "result.json").read_text())
    assert page.headings[0] == result["title"]
    assert (
        f"128 particles (NPR 4, NPH 2), {result['step']} steps to 2.00 µs" in page.text
    )
    worst = {
        clock: max(
            abs(c[f"{name}_error_percent"])
            for c in result["comparisons"]
            for name in ("radius", "length")
            if (c["clock"], c["figure"], c["outcome"])
            == (clock, "outermost", "compared")
        )
        for clock in ("nominal", "offset")
    }
    assert f"{worst['nominal']:.1f} % at the nominal times" in page.text
    assert f"{worst['offset']:.1f} % with the clock offset" in page.text


def test_every_picture_decodes_and_shows_something(page):
    pictures = page.pictures()
    # An exposure at two times, eight other snapshots, analyses, history.
    assert len(pictures) == 2 + 8 + 3 + 6 + 4
    sizes = list(zip(page.all("img", "width"), page.all("img", "height"), strict=True))
    for picture, size, words in zip(
        pictures, sizes, page.all("img", "alt"), strict=True
    ):
        assert picture.size == tuple(map(int, size))
        assert words
        pixels = np.asarray(picture)
        assert (pixels < 128).any(axis=2).mean() > 0.002
        assert (pixels > 250).all(axis=2).mean() > 0.3


def test_large_pictures_are_those_of_the_exposures(page):
    large = page.all("img", "alt")[:2]
    assert large == [
        "Exposure at 1 µs, nominal time: 1.00 µs after first contact",
        "Exposure at 1 µs, clock offset 0.35 µs: 1.35 µs after first contact",
    ]
    assert page.all("img", "alt")[2:10] == [
        f"{t:.2f} µs" for t in (0.0, 0.25, 0.5, 0.75, 1.25, 1.5, 1.75, 2.0)
    ]


def test_the_case_file_is_there_verbatim(page, finished):
    assert (finished / "case.toml").read_text() in "".join(page.words)


def test_a_title_of_signs_is_escaped_everywhere(copy, tmp_path, dots):
    title = """<b>5 < 6 & "$x_b$" 'y'</b>{{ 7 * 7 }}"""
    case = copy / "case.toml"
    text = case.read_text()
    (line,) = re.findall(r"^title = .*$", text, re.M)
    case.write_text(text.replace(line, f"title = {json.dumps(title)}"))
    page = page_of([copy, copy], tmp_path / "report.html")
    assert "b" not in page.tags
    assert page.headings.count(title) == 2
    alone = page_of([copy], tmp_path / "report.html")
    assert alone.headings[0] == title


def test_several_runs_have_contents_and_tables_on_top(finished, copy, tmp_path, dots):
    page = page_of([finished, copy, finished], tmp_path / "all.html")
    assert_nothing_is_fetched(page)
    assert_links_lead_somewhere(page)
    assert page.all("a", "href")[:3] == ["#run-1", "#run-2", "#run-3"]
    rows = page.table("run", "state")
    assert [row[0] for row in rows] == ["finished", "copy", "finished"]
    assert len(page.table("run", "exposure")) == 6
    assert page.headings[0] == "3 runs of mpisph"


def test_runs_of_one_name_are_told_apart(finished, tmp_path, dots):
    other = shutil.copytree(finished, tmp_path / "other" / "finished")
    page = page_of([finished, other], tmp_path / "all.html")
    names = [row[0] for row in page.table("run", "state")]
    assert names == [f"{finished.parent.name}/finished", "other/finished"]


@pytest.mark.parametrize(
    ("state", "words"),
    [
        ("stopped", "The run was stopped (a reason & more); mpisph resume continues"),
        ("failed", "The run failed (a reason & more); mpisph resume continues"),
        ("running", "The run was killed (a reason & more)"),
    ],
)
def test_runs_that_have_not_ended(finished, tmp_path, dots, state, words):
    folder = unended(
        tmp_path / "run", finished, state=state, reason="a reason & more", time=1.5e-6
    )
    page = page_of([folder], tmp_path / "report.html")
    assert words in page.text
    assert "1.50 µs of 2.00 µs" in page.text
    assert len(page.pictures()) == 2 + 8 + 1 + 6 + 4
    assert "Conservation and time" not in page.headings


def test_an_unstable_run_says_why(tmp_path):
    folder = tmp_path / "run"
    result = small_run(folder, *EXPOSED, "time.step=fixed", "time.dt=0.2us")
    assert result.status == "unstable"
    page = page_of([folder], tmp_path / "report.html")
    assert f"Unstable ({result.reason}) at step {result.step}" in page.text
    # u_r is written with an index.
    assert result.detail.replace("u_", "u") in page.text
    assert "No measured exposure was reached." in page.text
    assert len(page.pictures()) > 2
    assert "Particles" in page.headings


def test_particles_that_are_nowhere_are_left_out(copy, tmp_path):
    """As in the last snapshot of a run that broke down."""
    for path in (copy / "snapshots").iterdir():
        with h5py.File(path, "r+") as file:
            file["VTKHDF/PointData/z"][:5] = np.nan
            file["VTKHDF/PointData/rho"][5] = np.inf
    assert len(page_of([copy], tmp_path / "report.html").pictures()) == 23


def test_a_run_without_plate_sphere_and_measurements(tmp_path):
    folder = tmp_path / "run"
    text = PLATES.read_text().replace('"plate"', '"cylinder"')
    case = tmp_path / "rods.toml"
    case.write_text(text.replace("thickness", "length"))
    coarse = ("resolution.spacing=0.5 mm", "time.end=0.3us", "output.every=0.1us")
    small_run(folder, *coarse, "output.figures=false", case=case)
    page = page_of([folder], tmp_path / "report.html")
    assert "no measurements to compare with" in page.text
    assert not [heading for heading in page.headings if "experiment" in heading]
    # One halfway and the last large, its condition, two small; no figures of a cloud.
    assert len(page.pictures()) == 2 + 1 + 2 + 3 + 4
    times = [f"{t:.2f} µs after first contact" for t in (0.2, 0.3)]
    assert page.all("img", "alt")[:2] == times
    assert "measured" not in " ".join(page.words[: page.words.index("Set-up")])
    both = page_of([folder, folder], tmp_path / "report.html")
    assert "Comparison with the experiment" not in both.headings


def test_a_run_without_snapshots_and_history(copy, tmp_path):
    shutil.rmtree(copy / "snapshots")
    (copy / "history.csv").unlink()
    page = page_of([copy], tmp_path / "report.html")
    assert "There are no snapshots" in page.text
    assert "The history has no lines" in page.text
    assert page.pictures() == []


def test_of_many_snapshots_some_are_shown(finished, tmp_path, dots, monkeypatch):
    monkeypatch.setattr(run_page, "MOST_PANELS", 3)
    page = page_of([finished], tmp_path / "report.html")
    assert page.all("img", "alt")[2:5] == ["0.00 µs", "0.75 µs", "1.75 µs"]
    assert "3 of 8 are shown" in page.text


def test_analyses_are_made_of_one_snapshot_for_each_exposure(
    finished, tmp_path, dots, monkeypatch
):
    seen = []

    def draw(snapshot, case, out):
        seen.append((snapshot.time, case.title))
        dot(out)

    analysis = AnalysisFigure("Angles", "how to <read> it", draw)
    monkeypatch.setattr(run_page, "ANALYSES", (analysis,))
    page = page_of([finished], tmp_path / "report.html")
    assert [time for time, _ in seen] == [1.35e-6]
    assert "Angles" in page.all("img", "alt")
    assert "how to <read> it" in page.text


def test_warnings_of_the_run_are_passed_on(copy, tmp_path, dots):
    with (copy / "log.txt").open("a") as log:
        log.write("warning: the bits may <differ>\n")
    page = page_of([copy], tmp_path / "report.html")
    assert "The run warned: the bits may <differ>" in page.text


def test_a_folder_of_no_run_leaves_no_page(finished, tmp_path, dots):
    with pytest.raises(MpisphError, match="is it a run's folder"):
        write_report([finished, tmp_path], tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_the_command_writes_into_the_run_or_the_current_folder(
    finished, tmp_path, monkeypatch
):
    folder = unended(tmp_path / "run", finished)
    shutil.rmtree(folder / "snapshots")  # pictures take time
    (folder / "history.csv").unlink()
    done = launch(2, MPISPH, "report", folder)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{folder / 'report.html'}\n"
    assert len(Page((folder / "report.html").read_text()).headings) > 5
    here = tmp_path / "here"
    here.mkdir()
    monkeypatch.chdir(here)
    done = call("report", folder, folder)
    assert done.returncode == 0, done.stderr
    assert (here / "report.html").exists()
    done = call("report", tmp_path)
    assert done.returncode == 2
    assert f"{tmp_path}: no status.json" in done.stderr


def test_the_debris_is_looked_at_before_it_reaches_the_next_body(finished):
    run = read_run(finished)
    case = run.case.model_copy(update={"measured": None})
    history = run.history.copy()
    history["cloud_length"][history["time"] > 1.6e-6] = np.nan
    run = run._replace(case=case, history=history)
    shown = run_page._large(run)
    assert [item.time for item in shown] == [1.5e-6, 2e-6]
    analysed = run_page._analysed(shown, run_page._arrival(run))
    assert [item.time for item in analysed] == [1.5e-6]
    history["cloud_length"][:] = np.nan
    assert run_page._analysed(shown, run_page._arrival(run)) == []


def test_the_condition_of_matter_that_melts_and_breaks(breaking, tmp_path, dots):
    page = page_of([breaking], tmp_path / "report.html")
    assert "Condition of the matter" in page.headings
    result = read_run(breaking).result
    sphere, plate = result.bodies
    assert (sphere.broken, 0.0 < sphere.molten < 1.0) == (None, True)
    assert 0.0 < plate.broken < 1.0
    rows = page.table("body", "mass [g]")
    shares = [["sphere", f"{100 * sphere.molten:.1f} %", "–"]]
    shares += [["plate", *(f"{100 * x:.1f} %" for x in (plate.molten, plate.broken))]]
    assert [[row[0], *row[2:]] for row in rows] == shares
    assert "Damage and temperature, 2.00 µs after first contact" in page.all(
        "img", "alt"
    )


def test_the_shares_are_those_of_the_last_snapshot(breaking):
    run = read_run(breaking)
    arrays = read_snapshot(run.snapshots[-1][0]).arrays
    for body, record in enumerate(run.result.bodies):
        mine = arrays["body"] == body
        m, melt = arrays["m"][mine], arrays["melt"][mine]
        assert record.molten == pytest.approx((m * melt).sum() / m.sum(), rel=1e-12)
    broken = m * (arrays["damage"][mine] == 1.0)
    assert record.broken == pytest.approx(broken.sum() / m.sum(), rel=1e-12)
    assert not {"ductile_damage", "distension"} & set(arrays)


def test_without_models_nothing_is_said_of_it(page):
    assert "Condition of the matter" not in page.headings


def test_the_verdict_on_a_shield_stands_first(judged, tmp_path, dots):
    page = page_of([judged], tmp_path / "shield.html")
    verdict = read_run(judged).result.verdict
    assert_nothing_is_fetched(page)
    reason = verdict.reason[0].upper() + verdict.reason[1:]
    first = page.text.index(f"The wall is perforated{reason}.")
    assert first < page.text.index("completed")
    assert ("p", {"class": "outcome bad"}) in page.attributes
    assert page.headings[:5] == [
        "a shield",
        "The wall at the end",
        "Momentum and energy by body",
        "What happens",
        "How the wall responds",
    ]
    assert page.all("img", "alt")[:5] == [
        "Bumper, cloud and wall",
        "The wall close by",
        "Axial momentum by body",
        "Damage of the wall over what it bears",
        "Bulge and crater of the wall",
    ]
    assert page.text.count("every fragment off the axis is a ring") == 1


def test_what_is_measured_on_the_wall(judged, tmp_path, dots):
    page = page_of([judged], tmp_path / "shield.html")
    result = read_run(judged).result
    wall, verdict = result.verdict.wall, result.verdict
    assert page.value("damage over the critical one") == f"{verdict.damage:.2f}"
    assert page.value("hole in the sound wall, diameter") == f"{1e3 * wall.hole:.2f} mm"
    assert page.value("bulge of the rear face") == f"{1e3 * wall.bulge:.2f} mm"
    assert page.value("tilt of the rear face along a thickness") == f"{wall.shear:.3f}"
    off = page.value("come off the rear face, mass")
    assert float(off.removesuffix(" mg")) == pytest.approx(
        1e6 * wall.detached, rel=0.01
    )
    assert page.value("verdict a sixth of the time earlier") == verdict.earlier
    rows = page.table("body", "mass [g]", "momentum [mN s]")
    for row, body in zip(rows, result.bodies, strict=True):
        momentum = float(row[2].replace("\u2212", "-"))
        assert momentum == pytest.approx(1e3 * body.momentum_z, rel=1e-3)
    shares = [float(row[3].replace("\u2212", "-")) for row in rows]
    assert sum(shares) == pytest.approx(100.0, abs=0.2)


def test_a_shield_shows_no_sizes_of_a_cloud(judged, tmp_path, dots):
    page = page_of([judged], tmp_path / "shield.html")
    assert "names no measurements" not in page.text
    assert "its measures end" not in page.text
    assert not [alt for alt in page.all("img", "alt") if "of the cloud" in alt]


def test_signs_in_title_and_reason_of_a_verdict_stay_text(judged, tmp_path, dots):
    folder = shutil.copytree(judged, tmp_path / "copy")
    file = folder / "result.json"
    result = json.loads(file.read_text())
    result["verdict"].update(outcome="undecided", reason="<b>at 5 us</b> & {{ 7 }}")
    file.write_text(json.dumps(result))
    case = folder / "case.toml"
    case.write_text(case.read_text().replace("a shield", "<u>a</u> $x_b$", 1))
    page = page_of([folder], tmp_path / "shield.html")
    assert page.headings[0] == "<u>a</u> $x_b$"
    assert "Undecided<b>at 5 µs</b> & {{ 7 }}." in page.text
    assert ("p", {"class": "outcome warn"}) in page.attributes
    assert not {"b", "u"} & set(page.tags)


def test_a_shield_that_has_not_ended_is_not_judged(judged, tmp_path, dots):
    folder = shutil.copytree(judged, tmp_path / "copy")
    (folder / "result.json").unlink()
    page = page_of([folder], tmp_path / "shield.html")
    assert "The wall is not judged yet" in page.text
    assert "The wall at the end" not in page.headings
