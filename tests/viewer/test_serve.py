"""A page that follows runs: what it answers, and to whom."""

import json
import threading
import urllib.error
import urllib.request
import zlib

import pytest
from report_pages import Page
from run_folders import run_underway

from mpisph.io.stored_run import read_run
from mpisph.viewer import data
from mpisph.viewer.serve import make_server


@pytest.fixture
def underway(finished, tmp_path):
    return run_underway(finished, tmp_path / "run")


@pytest.fixture
def served():
    """Serve folders; returns a function that fetches."""
    servers = []

    def serve(*folders):
        server = make_server(folders)
        servers.append(server)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        port = server.server_address[1]

        def fetch(path, host=None):
            request = urllib.request.Request(f"http://127.0.0.1:{port}{path}")
            request.add_header("Host", host or f"127.0.0.1:{port}")
            with urllib.request.urlopen(request, timeout=30) as answer:
                return answer.read()

        return fetch

    yield serve
    for server in servers:
        server.shutdown()
        server.server_close()


def test_only_this_machine_is_served(finished):
    with make_server([finished]) as server:
        assert server.server_address[0] == "127.0.0.1"


def test_the_page_has_no_particles_and_fetches_them(finished, served):
    fetch = served(finished)
    whole = Page(fetch("/").decode())
    [policy] = [a["content"] for t, a in whole.attributes if "http-equiv" in a]
    assert policy.endswith("connect-src 'self'")
    assert not any("viewer-frame" in a.get("class", "") for _, a in whole.attributes)
    about = json.loads(fetch("/runs.json"))
    assert about["over"]
    [run] = about["runs"]
    keys = [frame["key"] for frame in run["frames"]]
    assert keys == [path.stem for path, _ in read_run(finished).snapshots]
    sizes = {len(zlib.decompress(fetch(f"/runs/0/frames/{key}"))) for key in keys}
    columns = len(run["frames"][0]["ranges"])
    assert sizes == {2 * columns * run["particles"]}
    assert len(zlib.decompress(fetch("/runs/0/fixed"))) == 2 * 5 * run["particles"]


def test_new_snapshots_are_shown_and_the_others_not_made_again(
    underway, served, monkeypatch
):
    folder, go_on = underway
    made = []
    make = data._frame
    monkeypatch.setattr(data, "_frame", lambda *of: made.append(of) or make(*of))
    fetch = served(folder)
    before = json.loads(fetch("/runs.json"))
    assert not before["over"]
    go_on()
    after = json.loads(fetch("/runs.json"))
    assert after["over"]
    kept, new = (
        [frame["key"] for frame in x["runs"][0]["frames"]] for x in (before, after)
    )
    assert new[: len(kept)] == kept
    assert len(new) == len(kept) + 2 == len(made)
    assert fetch(f"/runs/0/frames/{new[-1]}")


def test_what_cannot_be_read_for_a_moment_changes_nothing(
    underway, served, monkeypatch
):
    folder, go_on = underway
    fetch = served(folder)
    before = fetch("/runs.json")
    go_on()
    with monkeypatch.context() as patched:
        patched.setattr("mpisph.viewer.data.read_snapshot", fail)
        assert fetch("/runs.json") == before
    assert fetch("/runs.json") != before


def fail(path):
    raise OSError(f"{path}: it is being written")


@pytest.mark.parametrize(
    "path",
    ["/status.json", "/../status.json", "/runs/1/fixed", "/runs/-2/fixed",
     "/runs/0/frames/x", "/runs/0", "/runs/x/fixed", "/runs/0/frames/0/1"],
)  # fmt: skip
def test_nothing_else_is_served(finished, served, path):
    fetch = served(finished)
    with pytest.raises(urllib.error.HTTPError) as error:
        fetch(path)
    with error.value as answer:
        assert answer.code == 404


@pytest.mark.parametrize(
    "host", ["example.org", "example.org:80", "127.0.0.1.nip.io:9"]
)
def test_a_page_of_another_site_gets_nothing(finished, served, host):
    fetch = served(finished)
    with pytest.raises(urllib.error.HTTPError) as error:
        fetch("/runs.json", host)
    with error.value as answer:
        assert answer.code == 403
