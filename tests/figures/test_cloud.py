"""Figures: what a reader would look for in them, read back from the axes and pixels."""

import matplotlib.image
import numpy as np
import pytest
from launch import CASES
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from mpi4py import MPI
from pictures import dots_by_colour, points_per_mm

from mpisph.case import load_case
from mpisph.core.particles import Particles
from mpisph.diagnostics.cloud import CloudMeasure
from mpisph.figures.cloud import draw_cloud, draw_run
from mpisph.figures.fields import choose_fields
from mpisph.figures.style import BODY_COLOURS
from mpisph.figures.view import body_view, exposure_at
from mpisph.io.snapshot import read_series, write_snapshot

TIME = 6e-6
OFFSET_TIME = 6.89e-6


@pytest.fixture(scope="module")
def case():
    """Shot 4-1353: 15.3 and 31.7 mm at 6 us; rear face at 4.039 mm."""
    return load_case(CASES / "piekutowski-4-1353.toml")


def cloud_particles(strays=0):
    """A hemispherical shell of debris behind a plate with a hole."""
    angle = np.linspace(0.01, np.pi / 2 - 0.01, 200)
    r, z = np.meshgrid(np.arange(12e-3, 40e-3, 0.5e-3), np.arange(0.2e-3, 4e-3, 5e-4))
    n = angle.size + r.size
    p = Particles.zeros(n)
    p.id[:] = np.arange(n)
    p.body[angle.size :] = 1
    p.m[:] = 2e-5
    p.r[:] = np.concatenate([14e-3 * np.sin(angle), r.ravel()])
    p.z[:] = np.concatenate([5e-3 + 26e-3 * np.cos(angle), z.ravel()])
    p.u_z[: angle.size] = 4000.0
    p.z[:strays] = 0.5
    return p


def write(folder, case, time=TIME, index=0, strays=0):
    p = cloud_particles(strays)
    return write_snapshot(
        MPI.COMM_SELF,
        folder,
        index,
        p,
        time=time,
        step=1,
        metadata={"case": case.to_toml()},
        n_total=p.n,
    )


@pytest.fixture
def drawn(monkeypatch):
    """Keep the figures that are saved."""
    figures = []
    save = Figure.savefig

    def keep(figure, *arguments, **options):
        figures.append(figure)
        save(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", keep)
    return figures


def draw(tmp_path, case, drawn, **options):
    path = write(
        tmp_path, case, **{k: options.pop(k) for k in {"strays", "time"} & set(options)}
    )
    draw_cloud(path, case, tmp_path / "new" / "cloud.png", **options)
    (axes,) = drawn[-1].axes
    return axes


def texts(axes):
    legend = axes.figure.legends[0].get_texts()
    found = [*axes.texts, *legend]
    return [axes.get_title(loc="left"), *(text.get_text() for text in found)]


def plain(text):
    return text.replace("\u2009", ",")


def vertical_lines(axes):
    """Axial positions [mm] of the lines right across the axes."""
    lines = [x.get_xdata() for x in axes.lines if x.get_transform() != axes.transData]
    return sorted({round(float(x[0]), 6) for x in lines if len(x) and x[0] == x[-1]})


def test_both_directions_have_one_scale(tmp_path, case, drawn):
    axes = draw(tmp_path, case, drawn)
    box = axes.bbox
    (z_low, z_high), (r_low, r_high) = axes.get_xlim(), axes.get_ylim()
    scale = box.width / (z_high - z_low)
    assert box.height / (r_high - r_low) == pytest.approx(scale, rel=1e-9)
    assert r_low == -r_high


def test_particles_are_mirrored_and_coloured_by_body(tmp_path, case, drawn):
    axes = draw(tmp_path, case, drawn)
    p = cloud_particles()
    dots = dots_by_colour(axes)
    assert tuple(dots) == BODY_COLOURS[:2]
    for shown in dots.values():
        np.testing.assert_array_equal(np.sort(shown[:, 1]), np.sort(-shown[:, 1]))
    sphere = dots[BODY_COLOURS[0]][:, 0]
    assert sphere.size == 2 * np.count_nonzero(p.body == 0)
    assert sphere.max() == pytest.approx(1e3 * p.z[p.body == 0].max())
    assert [text for text in texts(axes) if text in ("sphere", "plate")]
    assert any(f"{p.n:,} particles, mirrored" in plain(t) for t in texts(axes))


def test_a_dot_covers_the_section_of_its_particle(tmp_path, case, drawn):
    axes = draw(tmp_path, case, drawn)
    p, rest = cloud_particles(), 2710.0
    _, r, size = dots_by_colour(axes)[BODY_COLOURS[1]].T
    assert np.ptp(size) > 0.2 * size.min()
    mm, pixel = points_per_mm(axes), 72.0 / axes.figure.dpi
    side = 1e3 * np.sqrt(p.m[-1] / (2.0 * np.pi * 1e-3 * np.abs(r) * rest))
    # The disc about a square, and 1.5 pixels more.
    over = size / (np.sqrt(2.0) * side * mm + 1.5 * pixel)
    assert 0.999 < over.min() < over.max() < 1.055


def test_measured_and_computed_sizes_stand_at_their_places(tmp_path, case, drawn):
    measure = CloudMeasure(14e-3, 27e-3, 13e-3, 26e-3, 4000.0, 1e-3)
    exposure = case.measured.exposures[0]
    axes = draw(tmp_path, case, drawn, measure=measure, exposure=exposure)
    # Rear face, then both lengths counted from it.
    assert vertical_lines(axes) == [4.039, 31.039, 35.739]
    heights = {
        round(float(abs(segment[0, 1])), 6)
        for lines in axes.collections
        for segment in lines.get_segments()
    }
    assert heights == {14.0, 15.3}
    legend = [text for text in texts(axes) if "$ " in text and "mm" in text]
    assert legend == [
        "measured: $R_b$ 15.3 mm, $L_b$ 31.7 mm",
        "computed, outermost: $R_b$ 14.0 mm (−8.5 %), $L_b$ 27.0 mm (−14.8 %)",
        "computed, 99 % of the mass: $R_b$ 13.0 mm, $L_b$ 26.0 mm",
    ]


def test_without_an_exposure_nothing_is_drawn_in(tmp_path, case, drawn):
    axes = draw(tmp_path, case, drawn)
    assert vertical_lines(axes) == [4.039]
    assert not axes.collections
    assert not [text for text in texts(axes) if "measured" in text]


def test_only_what_was_measured_is_drawn_in(tmp_path, case, drawn):
    exposure = case.measured.exposures[0].model_copy(update={"radius": None})
    axes = draw(tmp_path, case, drawn, exposure=exposure)
    assert "measured: $L_b$ 31.7 mm" in texts(axes)
    assert 35.739 in vertical_lines(axes)
    assert len(axes.collections) == 1


def test_the_measure_is_taken_from_the_snapshot(tmp_path, case, drawn):
    exposure = case.measured.exposures[0]
    p = cloud_particles()
    axes = draw(tmp_path, case, drawn, exposure=exposure)
    assert round(1e3 * p.z.max(), 6) in vertical_lines(axes)


@pytest.mark.parametrize(
    ("time", "words"),
    [
        (
            TIME,
            "t = 6.00 µs after first contact: the exposure at nominal 6 µs, no clock",
        ),
        (
            OFFSET_TIME,
            "t = 6.89 µs after first contact: "
            "the exposure at nominal 6 µs + 0.89 µs clock offset",
        ),
    ],
)
def test_the_title_says_how_the_clock_was_read(tmp_path, case, drawn, time, words):
    exposure = case.measured.exposures[0]
    axes = draw(tmp_path, case, drawn, time=time, exposure=exposure)
    title = axes.get_title(loc="left")
    assert title.startswith(case.title)
    assert words in title


def test_strays_are_left_out_and_counted(tmp_path, case, drawn):
    wide = draw(tmp_path, case, drawn).get_xlim()
    axes = draw(tmp_path, case, drawn, strays=1)
    assert axes.get_xlim() == pytest.approx(wide, abs=1.0)
    assert any("1 outside this view, 1 of them of the cloud" in t for t in texts(axes))


def test_text_stays_within_the_figure(tmp_path, case, drawn):
    measure = CloudMeasure(0.3, 0.196, 13e-3, 26e-3, 4000.0, 1e-3)
    exposure = case.measured.exposures[0]
    axes = draw(tmp_path, case, drawn, measure=measure, exposure=exposure)
    figure = axes.figure
    width, height = figure.bbox.width, figure.bbox.height
    for text in [*figure.legends[0].get_texts(), axes.xaxis.label, axes.title]:
        box = text.get_window_extent()
        assert box.x0 >= 0
        assert box.y0 >= 0
        assert box.x1 <= width, text.get_text()
        assert box.y1 <= height


def test_the_picture_shows_both_bodies(tmp_path, case, drawn):
    draw(tmp_path, case, drawn)
    pixels = matplotlib.image.imread(tmp_path / "new" / "cloud.png")[:, :, :3]
    assert pixels.shape[1] >= 1200
    for colour in BODY_COLOURS[:2]:
        near = np.abs(pixels - to_rgb(colour)).max(axis=2) < 0.02
        assert near.sum() > 1000


def test_exposures_are_found_at_both_times(case):
    first, second = case.measured.exposures
    assert exposure_at(case, 6e-6) is first
    assert exposure_at(case, 6e-6 + 0.89e-6) is first
    assert exposure_at(case, 19.89e-6) is second
    assert exposure_at(case, 7e-6) is None
    assert exposure_at(load_case(CASES / "plate-impact.toml"), 6e-6) is None


def test_a_run_is_drawn_with_lines_at_exposures_only(tmp_path, case, drawn):
    for index, time in enumerate([3e-6, TIME, OFFSET_TIME]):
        write(tmp_path, case, time, index)
    paths = draw_run(tmp_path)
    names = ["cloud_03.00us.png", "cloud_06.00us.png", "cloud_06.89us.png"]
    assert [path.name for path in paths] == names
    assert all(path.parent == tmp_path / "figures" for path in paths)
    assert [bool(figure.axes[0].collections) for figure in drawn] == [False, True, True]


def test_all_figures_of_a_run_have_one_view_and_one_size(tmp_path, case, drawn):
    for index, time in enumerate([3e-6, TIME, OFFSET_TIME]):
        write(tmp_path, case, time, index, strays=index % 2)
    draw_run(tmp_path)
    assert len({tuple(f.get_size_inches()) for f in drawn}) == 1
    boxes = {(f.axes[0].get_xlim(), f.axes[0].get_ylim()) for f in drawn}
    assert len(boxes) == 1
    assert len({f.axes[0].get_position().bounds for f in drawn}) == 1
    # It holds what was measured, though two figures draw no measurement in.
    ((z, r),) = boxes
    assert z[1] > 4.039 + 31.7
    assert r[1] > 15.3


def test_every_plate_that_stands_has_its_rear_face(tmp_path, case, drawn):
    plate = case.bodies[1]
    wall = plate.model_copy(update={"name": "wall", "position": 50e-3})
    shield = case.model_copy(update={"bodies": (*case.bodies, wall)})
    axes = draw(tmp_path, shield, drawn)
    assert vertical_lines(axes) == [4.039, 54.039]
    assert texts(axes).count("original rear faces") == 1


@pytest.mark.parametrize(
    ("planes", "hatched", "entries"),
    [
        ({}, 0, 0),
        ({"z_min": 0.0}, 1, 1),
        ({"z_min": 0.0, "z_max": 0.03}, 2, 1),
        ({"z_max": 10.0}, 0, 0),  # beyond the view
    ],
)
def test_what_lies_behind_a_plane_is_hatched(
    tmp_path, case, drawn, planes, hatched, entries
):
    boundary = case.boundary.model_copy(update=planes)
    axes = draw(tmp_path, case.model_copy(update={"boundary": boundary}), drawn)
    assert sum(bool(patch.get_hatch()) for patch in axes.patches) == hatched
    assert texts(axes).count("rigid plane") == entries


def test_times_near_each_other_get_names_of_their_own(tmp_path, case, drawn):
    for index, time in enumerate([3.001e-6, 3.002e-6]):
        write(tmp_path, case, time, index)
    names = [path.name for path in draw_run(tmp_path)]
    assert names == ["cloud_03.001us.png", "cloud_03.002us.png"]


def test_a_case_without_a_plate_or_a_cloud(tmp_path, drawn):
    text = (CASES / "plate-impact.toml").read_text().replace('plate"', 'cylinder"')
    text = text.replace("thickness", "length")
    path = tmp_path / "rods.toml"
    path.write_text(text)
    case = load_case(path)
    axes = draw(tmp_path, case, drawn)
    assert vertical_lines(axes) == []


@pytest.mark.parametrize("title", ["$\\frac{", "a $ or $5", "\\alpha & #1 % _x ^2"])
def test_a_title_is_drawn_as_it_stands(tmp_path, case, drawn, title):
    axes = draw(tmp_path, case.model_copy(update={"title": title}), drawn)
    assert axes.get_title(loc="left").splitlines()[0] == title


def test_letters_that_the_font_lacks_are_no_warning(tmp_path, case, drawn):
    draw(tmp_path, case.model_copy(update={"title": "\u597d"}), drawn)


def test_fields_are_drawn_under_their_names_with_the_same_colours(
    tmp_path, case, drawn
):
    for index, time in enumerate([3e-6, TIME]):
        write(tmp_path, case, time, index, strays=index)
    names = [path.name for path in draw_run(tmp_path, choose_fields(["speed"], []))]
    assert names == ["speed_03.00us.png", "speed_06.00us.png"]
    pair = choose_fields(["damage", "speed"], [])
    names = [path.name for path in draw_run(tmp_path, pair)]
    assert names == ["damage_speed_03.00us.png", "damage_speed_06.00us.png"]
    bars = [figure.axes[1:] for figure in drawn]
    assert list(map(len, bars)) == [1, 1, 2, 2]
    assert len({bar[-1].get_ylim() for bar in bars}) == 1
    # What the legend says of the sizes stands within the figure.
    figure = drawn[-1]
    right = [x.get_window_extent().x1 for x in figure.legends[0].get_texts()]
    assert max(right) < figure.bbox.width
    tight = figure.get_tightbbox()
    assert tight.x1 <= figure.get_figwidth()
    assert "above: damage; below: speed" in figure.axes[0].get_title(loc="left")


def test_a_body_is_shown_close_by_in_one_view(tmp_path, case, drawn):
    for index, time in enumerate([3e-6, TIME]):
        write(tmp_path, case, time, index)
    names = [path.name for path in draw_run(tmp_path, zoom="sphere")]
    assert names == ["cloud_sphere_03.00us.png", "cloud_sphere_06.00us.png"]
    fields = choose_fields(["speed"], [])
    names = [path.name for path in draw_run(tmp_path, fields, "sphere")]
    assert names == ["speed_sphere_03.00us.png", "speed_sphere_06.00us.png"]
    paths = [path for path, _ in read_series(tmp_path)]
    view = body_view(paths, case, "sphere")
    for figure in drawn:
        axes = figure.axes[0]
        assert (*axes.get_xlim(), axes.get_ylim()[1]) == pytest.approx(view)
        assert not any("R_b" in text for text in texts(axes))


def test_the_condition_of_the_matter_is_drawn_at_the_end(breaking, tmp_path, drawn):
    for name in ("snapshots", "snapshots.vtkhdf.series"):
        (tmp_path / name).symlink_to(breaking / name)
    *clouds, last = draw_run(tmp_path)
    assert all(path.name.startswith("cloud_") for path in clouds)
    assert last.name == "condition.png"
    labels = [axes.get_ylabel() for axes in drawn[-1].axes[1:]]
    assert labels == ["damage", "temperature [K]"]
