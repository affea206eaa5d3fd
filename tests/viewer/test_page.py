"""The page that plays runs: one sound file, whatever names are in it."""

import base64
import json
import shutil

import pytest
from report_pages import Page, assert_nothing_is_fetched

from mpisph.core.errors import InputError, MpisphError
from mpisph.figures.fields import choose_fields
from mpisph.io.stored_run import read_run
from mpisph.viewer import page as module
from mpisph.viewer.page import library, make_view, page, shown_run, write_view

NASTY = """</script><script>alert("1")</script> & 'x' <!-- $R_b$"""


def scripts(html, kind):
    """What scripts of a class hold."""
    parts = html.split(f'class="viewer-{kind}"')[1:]
    return [part.partition(">")[2].partition("</script>")[0] for part in parts]


@pytest.fixture(scope="module")
def html(finished, tmp_path_factory):
    out = tmp_path_factory.mktemp("page") / "new" / "view.html"
    assert write_view([finished], out) == []
    return out.read_text(encoding="utf-8")


def test_the_page_is_whole_in_itself(html):
    whole = Page(html)
    assert_nothing_is_fetched(whole)
    assert whole.headings == whole.headings[:1], "one heading, before it plays"
    [policy] = [a["content"] for t, a in whole.attributes if "http-equiv" in a]
    assert policy.startswith("default-src 'none';")
    assert "connect-src" not in policy
    assert whole.tags.count("img") == 2, "an exposure at both clocks"


def test_it_holds_what_is_shown(html, finished):
    shown = shown_run(read_run(finished))
    [about] = scripts(html, "run")
    assert json.loads(about) == shown.description
    assert [base64.b64decode(x) for x in scripts(html, "frame")] == shown.frames
    assert [base64.b64decode(x) for x in scripts(html, "fixed")] == [shown.fixed]


def test_names_stay_text(finished, tmp_path):
    run = read_run(finished)
    case = run.case.model_copy(update={"title": NASTY})
    run = run._replace(case=case, name=NASTY)
    shown = shown_run(run)
    shown.description["bodies"][0]["name"] = NASTY
    text = page([run], make_view([run], [shown]))
    whole = Page(text)
    assert whole.headings == [NASTY]
    assert "<script>alert" not in text
    assert NASTY not in text
    [about] = scripts(text, "run")
    assert json.loads(about)["bodies"][0]["name"] == NASTY


def test_several_runs_share_a_page(finished, judged, tmp_path):
    twin = shutil.copytree(judged, tmp_path / "other" / finished.name)
    out = tmp_path / "view.html"
    write_view([finished, twin], out)
    text = out.read_text(encoding="utf-8")
    names = [json.loads(about)["name"] for about in scripts(text, "run")]
    parents = finished.resolve().parent.name, "other"
    assert names == [f"{parent}/{finished.name}" for parent in parents]
    assert Page(text).headings == ["2 runs of mpisph"]
    assert text.count('data-run="1"') == len(read_run(judged).snapshots)


def test_fields_and_their_colours_may_be_chosen(judged):
    run = read_run(judged)
    chosen = choose_fields(["damage", "speed"], [("0", "0.5")])
    view = make_view([run], [shown_run(run, chosen)], chosen)
    assert (view.above, view.below) == ("damage", "speed")
    html = page([run], view)
    assert 'data-field="damage" data-below="speed"' in html
    [about] = scripts(html, "run")
    [damage] = [f for f in json.loads(about)["fields"] if f["name"] == "damage"]
    assert (damage["low"], damage["high"]) == (0.0, 0.5)


def test_what_is_left_out_is_said(finished, tmp_path):
    notes = write_view([finished], tmp_path / "view.html", most=10)
    assert notes == [
        f"{finished.name}: 10 of {read_run(finished).particles} particles are shown"
    ]


def test_runs_that_cannot_be_played_are_refused(finished, tmp_path):
    with pytest.raises(MpisphError, match=r"is it a run's folder\?"):
        write_view([tmp_path], tmp_path / "view.html")
    empty = shutil.copytree(finished, tmp_path / "empty")
    shutil.rmtree(empty / "snapshots")
    with pytest.raises(InputError, match="empty: no snapshots yet"):
        write_view([empty], tmp_path / "view.html")
    with pytest.raises(InputError, match="finished: no distension"):
        write_view([finished], tmp_path / "x.html", choose_fields(["distension"], []))
    assert not list(tmp_path.glob("*.html"))


def test_without_the_library_it_says_so(monkeypatch):
    monkeypatch.setattr(module.importlib.util, "find_spec", lambda _: None)
    library.cache_clear()
    with pytest.raises(MpisphError, match="pydeck is not installed"):
        library()
