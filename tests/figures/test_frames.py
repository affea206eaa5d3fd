"""Frames: one view for all snapshots, one scale, every particle in its place."""

import h5py
import matplotlib.image
import numpy as np
import pytest
from launch import CASES
from matplotlib.colors import to_rgb
from pictures import dots_by_colour, store

from mpisph.case import load_case
from mpisph.core.particles import Particles
from mpisph.figures.dots import find_shadings
from mpisph.figures.fields import choose_fields
from mpisph.figures.movie import FILM, PANEL, Frame
from mpisph.figures.style import BODY_COLOURS
from mpisph.figures.view import View, common_view, only_finite
from mpisph.io.snapshot import read_snapshot


@pytest.fixture(scope="module")
def case():
    return load_case(CASES / "piekutowski-4-1353.toml")


def write(folder, case, index, reach, strays=0):
    """A shell of debris of the sphere that reaches so far behind the plate."""
    angle = np.linspace(0.01, np.pi / 2 - 0.01, 400)
    p = Particles.zeros(800)
    p.id[:] = np.arange(800)
    p.body[400:] = 1
    p.m[:] = 1e-9
    p.r[:400], p.z[:400] = 0.5 * reach * np.sin(angle), 0.005 + reach * np.cos(angle)
    p.r[400:], p.z[400:] = np.linspace(0.01, 0.04, 400), 0.002
    p.u_z[:400] = 4000.0
    p.z[:strays], p.r[:strays] = 3.0, 2.0
    return store(folder, case, index, p)


def test_the_view_holds_all_snapshots(tmp_path, case):
    near, far = (
        write(tmp_path, case, k, reach) for k, reach in enumerate((0.01, 0.05))
    )
    view = common_view([near, far], case)
    assert view == common_view([far, near], case)
    assert 55.0 < view.z_high < 70.0
    assert 25.0 < view.r_high < 40.0
    assert view.z_low < 0.0
    alone = [common_view([path], case) for path in (near, far)]
    assert alone[0].z_high < 30.0
    assert view.z_low == min(one.z_low for one in alone) != max(alone).z_low
    assert view.r_high == max(one.r_high for one in alone)


def test_particles_that_are_nowhere_do_not_either(tmp_path, case):
    path = write(tmp_path, case, 0, 0.05)
    whole = common_view([path], case)
    with h5py.File(path, "r+") as file:
        data = file["VTKHDF/PointData"]
        data["z"][:4] = [np.nan, np.inf, -np.inf, 0.02]
        data["u"][3, 0] = np.nan
    view = common_view([path], case)
    assert view == pytest.approx(whole, abs=0.5)
    snapshot = read_snapshot(path)
    assert len(only_finite(snapshot).arrays["z"]) == len(snapshot.arrays["z"]) - 4
    frame = Frame(case, view, FILM)
    frame.show(snapshot)
    frame.save(tmp_path / "frame.png")


def test_strays_do_not_set_it(tmp_path, case):
    paths = [write(tmp_path, case, k, 0.05, strays=k) for k in range(2)]
    assert common_view(paths, case).z_high == pytest.approx(
        common_view(paths[:1], case).z_high, abs=0.5
    )


@pytest.mark.parametrize("layout", [PANEL, FILM])
@pytest.mark.parametrize(
    "view", [View(-10, 20, 90), *(View(-10, 90, 30 + 0.1 * k) for k in range(6))]
)
def test_both_directions_have_one_scale_and_pixels_are_even(case, view, layout):
    frame = Frame(case, view, layout)
    (axes,) = frame.figure.axes
    box = axes.get_position()
    size = frame.figure.get_size_inches()
    along = box.width * size[0] / np.ptp(axes.get_xlim())
    across = box.height * size[1] / np.ptp(axes.get_ylim())
    assert along == pytest.approx(across, rel=1e-9)
    pixels = size * layout.dpi
    assert pixels == pytest.approx(2 * np.round(pixels / 2))
    assert layout.narrowest - 2 <= pixels[0] <= layout.widest
    assert box.height * pixels[1] <= layout.highest + 2
    # No wider than the matter, where it is as high as may be.
    if pixels[0] > layout.narrowest + 2:
        assert np.ptp(axes.get_xlim()) == pytest.approx(
            view.z_high - view.z_low, rel=0.02
        )
    # Nothing of what was asked for is cut off, but for the rounding to pixels.
    assert frame.view.z_low <= view.z_low + 1e-9
    assert frame.view.z_high >= view.z_high - 1e-9
    assert frame.view.r_high >= 0.98 * view.r_high


def test_a_frame_shows_one_snapshot_after_another(tmp_path, case):
    paths = [write(tmp_path, case, k, reach) for k, reach in enumerate((0.02, 0.05))]
    frame = Frame(case, common_view(paths, case), FILM)
    (axes,) = frame.figure.axes
    for path in paths:
        snapshot = read_snapshot(path)
        frame.show(snapshot)
        dots = dots_by_colour(axes)
        assert tuple(dots) == BODY_COLOURS[:2]
        for body, shown in enumerate(dots.values()):
            mine = snapshot.arrays["body"] == body
            r = 1e3 * snapshot.arrays["r"][mine]
            seen = r <= frame.view.r_high
            assert len(shown) == 2 * np.count_nonzero(seen)
            assert sorted(shown[:, 1]) == pytest.approx(
                sorted(np.concatenate([r[seen], -r[seen]]))
            )
        title = axes.get_title(loc="right")
        assert title == f"t = {1e6 * snapshot.time:.2f} µs"
    assert axes.get_title(loc="left").replace("\n", " ") == case.title


def test_what_is_written_stays_within_the_frame(case):
    long = case.model_copy(update={"title": "$ " + 50 * "long "})
    frame = Frame(long, View(-10, 100, 40), FILM)
    (axes,) = frame.figure.axes
    figure = frame.figure
    figure.draw_without_rendering()
    legend = figure.legends[0].get_texts()
    for text in [*legend, axes.xaxis.label, axes.yaxis.label, axes._left_title]:
        box = text.get_window_extent()
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= figure.bbox.width, text.get_text()
        assert box.y1 <= figure.bbox.height


def test_a_frame_with_bars_has_room_for_them(tmp_path, case):
    path = write(tmp_path, case, 0, 0.05)
    view, snapshot = common_view([path], case), read_snapshot(path)
    chosen = choose_fields(["damage", "speed"], [])
    shadings = find_shadings(chosen, [snapshot], view, case)
    frame = Frame(case, view, FILM, shadings)
    frame.show(snapshot)
    figure = frame.figure
    assert [axes.get_ylabel() for axes in figure.axes[1:]] == ["damage", "speed [km/s]"]
    figure.draw_without_rendering()
    assert figure.get_tightbbox().x1 <= figure.get_figwidth()
    pixels = figure.get_size_inches() * FILM.dpi
    assert pixels == pytest.approx(2 * np.round(pixels / 2))


def test_a_panel_is_saved_with_both_bodies(tmp_path, case):
    path = write(tmp_path, case, 0, 0.03)
    frame = Frame(case, common_view([path], case), PANEL)
    frame.show(read_snapshot(path))
    frame.save(tmp_path / "new" / "panel.png")
    pixels = matplotlib.image.imread(tmp_path / "new" / "panel.png")[:, :, :3]
    assert PANEL.narrowest <= pixels.shape[1] <= PANEL.widest
    for colour in BODY_COLOURS[:2]:
        near = np.abs(pixels - to_rgb(colour)).max(axis=2) < 0.02
        assert near.sum() > 200
