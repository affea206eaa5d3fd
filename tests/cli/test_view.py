"""`mpisph view`: where the page goes, what is refused, how serving ends."""

import os
import signal
import subprocess
import urllib.request

import pytest
from launch import MPISPH, call, environment, launch

from mpisph.cli import view


@pytest.fixture
def screen(monkeypatch):
    """A screen, and what is opened on it."""
    opened = []
    monkeypatch.setenv("DISPLAY", ":99")
    monkeypatch.setattr(view.webbrowser, "open", opened.append)
    return opened


def test_the_path_is_printed_and_opened_where_there_is_a_screen(
    finished, tmp_path, screen
):
    out = tmp_path / "new" / "page one.html"
    done = call("view", finished, "-o", out)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{out}\n"
    assert out.read_text().startswith("<!DOCTYPE html>")
    assert screen == [out.resolve().as_uri()]


def test_without_a_screen_or_when_asked_nothing_is_opened(
    finished, tmp_path, screen, monkeypatch
):
    out = tmp_path / "view.html"
    assert call("view", finished, "-o", out, "--no-browser").returncode == 0
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert call("view", finished, "-o", out).returncode == 0
    assert screen == []


def test_fields_limits_and_thinning_reach_the_page(finished, tmp_path):
    out = tmp_path / "view.html"
    fields = ("--field", "speed", "--field", "h", "--range", "1km/s", "2km/s")
    done = call("view", finished, "-o", out, *fields, "--particles", "20")
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith(f"{finished.name}: 20 of ")
    text = out.read_text()
    assert 'data-field="speed" data-below="h"' in text
    assert '"low": 1.0, "high": 2.0' in text


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--port", "8000"), "--port: is for --serve"),
        (("--serve", "-o", "x.html"), "--output: --serve writes no file"),
        (("--field", "damage", "--field", "h", "--field", "body"), "3 fields"),
        (("--particles", "0"), "0 is not in the range"),
        (("--field", "melt"), "no melt"),
    ],
)
def test_what_makes_no_sense_is_refused(finished, options, message):
    done = call("view", finished, *options)
    assert done.returncode == 2
    assert message in done.stderr
    assert not (finished / "view.html").exists()


def test_a_folder_without_a_run_is_refused(tmp_path):
    done = call("view", tmp_path)
    assert done.returncode == 2
    assert "is it a run's folder?" in done.stderr


def test_two_ranks_write_one_page(finished, tmp_path):
    out = tmp_path / "view.html"
    done = launch(2, MPISPH, "view", finished, "-o", out)
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{out}\n"


def test_serving_ends_with_ctrl_c(finished):
    server = subprocess.Popen(
        [MPISPH, "view", str(finished), "--serve", "--no-browser"],
        env=environment(),
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        url = server.stdout.readline().split()[0]
        assert url.startswith("http://127.0.0.1:")
        with urllib.request.urlopen(url, timeout=30) as answer:
            assert b"viewer" in answer.read()
        os.kill(server.pid, signal.SIGINT)
        _, err = server.communicate(timeout=30)
    finally:
        server.kill()
        server.communicate()
    assert server.returncode == 0, err
    assert err == "ended\n"
