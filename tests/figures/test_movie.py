"""Films: read back frame by frame."""

import builtins
import gc
import shutil
import tomllib
import warnings
from itertools import pairwise

import imageio_ffmpeg
import numpy as np
import pytest
from launch import CASES, MPISPH, call, launch
from small_runs import EXPOSED, small_run

from mpisph.case import case_from_dict, load_case
from mpisph.core.errors import InputError, MpisphError
from mpisph.figures import movie as module
from mpisph.figures.fields import choose_fields
from mpisph.figures.movie import FILM, Frame, animate, default_rate, find_ffmpeg
from mpisph.figures.view import View, body_view
from mpisph.io.snapshot import read_series, read_snapshot

SNAPSHOTS = 10


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    small_run(folder, *EXPOSED)
    return folder


def read(path):
    """What is known of a film, and its frames."""
    with warnings.catch_warnings():
        # The reader leaves its pipes to the garbage collector.
        warnings.simplefilter("ignore", ResourceWarning)
        reader = imageio_ffmpeg.read_frames(str(path))
        meta, *raw = list(reader)
        del reader
        gc.collect()
    width, height = meta["size"]
    return meta, [np.frombuffer(f, np.uint8).reshape(height, width, 3) for f in raw]


def test_every_snapshot_is_a_frame_of_a_film_that_browsers_play(folder, tmp_path):
    out = tmp_path / "new" / "film.mp4"
    assert animate(folder, out, fps=5.0) == out
    meta, frames = read(out)
    assert len(frames) == SNAPSHOTS
    assert meta["codec"] == "h264"
    assert meta["pix_fmt"].startswith("yuv420p")
    assert meta["fps"] == pytest.approx(5.0)
    assert meta["duration"] == pytest.approx(SNAPSHOTS / 5.0, abs=0.05)
    width, height = meta["size"]
    assert 640 <= width <= 1280
    assert width % 2 == 0
    assert height % 2 == 0
    assert 400 < height < 1080
    # Its table stands before its frames, so that it plays while it loads.
    data = out.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")
    assert [path.name for path in out.parent.iterdir()] == ["film.mp4"]


def test_frames_differ_where_matter_moves_and_nowhere_else(folder, tmp_path):
    _, frames = read(animate(folder, tmp_path / "film.mp4"))
    grey = [frame.astype(int).mean(axis=2) for frame in frames]
    changes = [np.abs(b - a) > 40 for a, b in pairwise(grey)]
    assert all(change.sum() > 100 for change in changes)
    # The axes and the title at the left stand still.
    still = ~np.any(changes, axis=0)
    height, width = still.shape
    # But for a pixel that the compression moves.
    assert still[: height // 2, : width // 20].mean() > 0.999
    assert (grey[0][:40, : width // 2] < 128).sum() > 200
    # The sphere, blue, goes on along the axis.
    blue = [frame[:, :, 2] > frame[:, :, 0].astype(int) + 80 for frame in frames]
    places = [np.nonzero(dots)[1].mean() for dots in blue]
    assert all(b > a for a, b in pairwise(places))
    assert places[-1] > places[0] + 100


@pytest.mark.parametrize(
    ("frames", "rate"), [(2, 2.0), (9, 2.0), (24, 4.0), (60, 10.0), (1000, 25.0)]
)
def test_a_film_takes_some_seconds_by_default(frames, rate):
    assert default_rate(frames) == rate


def test_one_snapshot_makes_no_film(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    (copy / "snapshots.vtkhdf.series").unlink()
    shutil.rmtree(copy / "snapshots")
    with pytest.raises(MpisphError, match=r"0 snapshots.*output\.every=0\.1us"):
        animate(copy, tmp_path / "film.mp4")
    assert not (tmp_path / "film.mp4").exists()


def test_a_field_that_the_run_lacks_makes_no_film(folder, tmp_path):
    with pytest.raises(InputError, match=r"no melt: .*; there are pressure, density"):
        animate(folder, tmp_path / "x.mp4", chosen=choose_fields(["melt"], []))
    assert not list(tmp_path.iterdir())


def test_a_body_is_shown_close_by(folder, tmp_path, monkeypatch):
    views = []
    kept = module.Frame

    def frame(case, view, *arguments):
        views.append(view)
        return kept(case, view, *arguments)

    monkeypatch.setattr(module, "Frame", frame)
    _, frames = read(animate(folder, tmp_path / "x.mp4", zoom="sphere"))
    assert len(frames) == SNAPSHOTS
    paths = [path for path, _ in read_series(folder)]
    case = case_from_dict(tomllib.loads(read_snapshot(paths[0]).case))
    assert views == [body_view(paths, case, "sphere")]
    with pytest.raises(InputError, match="no such body; there are sphere, plate"):
        animate(folder, tmp_path / "y.mp4", zoom="wall")
    assert not (tmp_path / "y.mp4").exists()


@pytest.fixture
def no_package(monkeypatch):
    """imageio-ffmpeg is not installed."""
    real = builtins.__import__

    def refuse(name, *arguments, **options):
        if name == "imageio_ffmpeg":
            raise ImportError(name)
        return real(name, *arguments, **options)

    monkeypatch.setattr(builtins, "__import__", refuse)


def test_without_ffmpeg_the_error_says_what_to_install(
    folder, tmp_path, no_package, monkeypatch
):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(MpisphError, match=r'pip install "mpisph\[animate\]"'):
        animate(folder, tmp_path / "film.mp4")


def test_the_systems_ffmpeg_serves_as_well(folder, tmp_path, no_package, monkeypatch):
    programs = tmp_path / "bin"
    programs.mkdir()
    (programs / "ffmpeg").symlink_to(imageio_ffmpeg.get_ffmpeg_exe())
    monkeypatch.setenv("PATH", str(programs))
    assert find_ffmpeg() == str(programs / "ffmpeg")
    _, frames = read(animate(folder, tmp_path / "film.mp4"))
    assert len(frames) == SNAPSHOTS


def test_a_film_that_fails_leaves_what_was_there(folder, tmp_path, monkeypatch):
    out = tmp_path / "film.mp4"
    out.write_text("the film before")
    monkeypatch.setattr(module, "find_ffmpeg", lambda: "/bin/false")
    with pytest.raises(MpisphError, match="could not write the film"):
        animate(folder, out)
    assert out.read_text() == "the film before"
    assert list(tmp_path.iterdir()) == [out]


def test_a_film_takes_the_place_of_another_at_once(folder, tmp_path):
    out, kept = tmp_path / "film.mp4", tmp_path / "kept.mp4"
    out.write_text("the film before")
    kept.hardlink_to(out)
    animate(folder, out, chosen=choose_fields(["speed", "body"], []))
    # Not written over: who is watching sees the old one to its end.
    assert kept.read_text() == "the film before"
    assert len(read(out)[1]) == SNAPSHOTS


def test_the_command_writes_into_the_runs_folder(folder, tmp_path):
    copy = shutil.copytree(folder, tmp_path / "copy")
    done = launch(2, MPISPH, "animate", copy, "--fps", "10")
    assert done.returncode == 0, done.stderr
    assert done.stdout == f"{copy / 'film.mp4'}\n"
    assert read(copy / "film.mp4")[0]["fps"] == 10.0
    options = ("--field", "speed", "--zoom", "sphere")
    done = call("animate", copy, *options)
    assert done.stdout == f"{copy / 'film_speed_sphere.mp4'}\n"
    done = call("animate", tmp_path)
    assert done.returncode == 2
    assert "is it a run's folder?" in done.stderr


def test_the_legend_stands_below_the_label_of_the_axis():
    case = load_case(CASES / "piekutowski-4-1353.toml", ["boundary.z_max=20 mm"])
    frame = Frame(case, View(-20.0, 30.0, 25.0), FILM)
    (axes,), (legend,) = frame.figure.axes, frame.figure.legends
    frame.figure.draw_without_rendering()
    highest = max(text.get_window_extent().y1 for text in legend.get_texts())
    assert highest <= axes.xaxis.label.get_window_extent().y0
