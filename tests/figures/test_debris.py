"""Figures of the debris: what is in them, read back from axes, images and pixels."""

from itertools import pairwise

import matplotlib.image
import numpy as np
import pytest
from launch import CASES
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch

from mpisph.case import load_case
from mpisph.figures import debris
from mpisph.figures.debris import draw_fragments, draw_radiograph, draw_spray
from mpisph.figures.style import label_log_axis
from mpisph.io.snapshot import Snapshot

TIME = 6.89e-6


@pytest.fixture(scope="module")
def case():
    """Shot 4-1353: rear face at 4.039 mm."""
    return load_case(CASES / "piekutowski-4-1353.toml")


def snapshot(time=TIME, cloud=True):
    """A block of debris of both bodies, one ring apart, one thrown back, a plate."""
    block = np.meshgrid(0.5e-3 * (np.arange(10) + 0.5), 20e-3 + 0.5e-3 * np.arange(20))
    plate = np.meshgrid(np.arange(14e-3, 40e-3, 0.5e-3), 0.5e-3 * (np.arange(8) + 0.5))
    r = np.concatenate([block[0].ravel(), [12e-3, 15e-3], plate[0].ravel()])
    z = np.concatenate([block[1].ravel(), [30e-3, -2e-3], plate[1].ravel()])
    debris = block[0].size + 2
    u_z, u_r, body = np.zeros(r.size), np.zeros(r.size), np.ones(r.size, np.int64)
    u_z[: debris - 2], body[20 : debris - 2] = 5000.0, 0
    u_z[debris - 2], u_r[debris - 2] = 3000.0, 3000.0
    u_z[debris - 1], u_r[debris - 1] = -1500.0, 1500.0
    if not cloud:
        z = z - 60e-3 * (z > 4.1e-3)
    rho = np.full(r.size, 2000.0)
    arrays = {
        "id": np.arange(r.size),
        "body": body,
        "material": np.zeros_like(body),
        "m": 2 * np.pi * r * rho * 0.5e-3**2,
        "r": r,
        "z": z,
        "u_r": u_r,
        "u_z": u_z,
        "rho": rho,
    }
    return Snapshot(time, 1, "", arrays, {})


@pytest.fixture
def draw(monkeypatch, tmp_path, case):
    """Draw into a new folder, and return the figure and its pixels."""
    figures = []
    save = Figure.savefig

    def keep(figure, *arguments, **options):
        figures.append(figure)
        save(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", keep)

    def call(function, shot=None, of=None, **options):
        path = tmp_path / "new" / "figure.png"
        function(shot or snapshot(), of or case, path, **options)
        return figures[-1], matplotlib.image.imread(path)[:, :, :3]

    return call


def film_of(figure):
    (mesh,) = (x for x in figure.axes[1].collections if isinstance(x, QuadMesh))
    return mesh


def film_and_particles(figure):
    particles, film, _ = figure.axes
    return film, particles


def all_texts(figure):
    found = list(figure.texts)
    for legend in figure.legends + [a.get_legend() for a in figure.axes]:
        found += legend.get_texts() if legend else []
    for axes in figure.axes:
        title = axes.title if axes.title.get_text() else axes._left_title
        found += [title, axes.xaxis.label, axes.yaxis.label]
    return [text for text in found if text.get_text()]


def test_film_and_particles_have_one_scale(draw):
    figure, _ = draw(draw_radiograph)
    film, particles = film_and_particles(figure)
    assert film.get_xlim() == particles.get_xlim()
    assert film.get_ylim() == particles.get_ylim()
    for axes in (film, particles):
        scale = axes.bbox.width / np.ptp(axes.get_xlim())
        assert axes.bbox.height / np.ptp(axes.get_ylim()) == pytest.approx(scale)
    assert film.bbox.x0 == pytest.approx(particles.bbox.x0)
    assert film.bbox.width == pytest.approx(particles.bbox.width)
    assert film.bbox.y0 > particles.bbox.y1


def test_the_film_holds_the_mass_in_g_per_cm2(draw):
    figure, _ = draw(draw_radiograph)
    mesh = film_of(figure)
    values = np.asarray(mesh.get_array())
    edges = mesh.get_coordinates()
    z, y = edges[0, :, 0], edges[:, 0, 1]
    pixel = (np.diff(y)[:, None] * np.diff(z)) / 100.0  # cm2
    behind = z[:-1] > 10.0
    a = snapshot().arrays
    mass = 1e3 * a["m"][a["z"] > 10e-3].sum()  # g
    assert (values * pixel)[:, behind].sum() == pytest.approx(mass, rel=1e-6)
    assert figure.axes[2].get_ylabel() == "areal density along the ray [g/cm²]"


def test_dense_matter_is_dark_on_a_light_field(draw):
    figure, pixels = draw(draw_radiograph)
    film, _ = film_and_particles(figure)

    def grey(z, y):
        x, up = film.transData.transform((z, y))
        row, column = pixels.shape[0] - round(up), round(x)
        return float(pixels[row - 3 : row, column : column + 3].mean())

    assert grey(2.0, 0.5) < 0.05, "the plate"
    assert grey(10.0, 8.0) > 0.99, "nothing"
    assert grey(25.0, 0.5) < grey(25.0, 4.0) < 0.9, "the block, thinner at its side"
    assert grey(30.0, 11.0) > 0.4, "one thin ring"
    assert grey(30.0, -11.0) == pytest.approx(grey(30.0, 11.0), abs=0.05)


def test_grey_follows_the_attenuation_that_is_given(draw):
    figure, _ = draw(draw_radiograph)
    norm = film_of(figure).norm
    harder, _ = draw(draw_radiograph, energy=100e3)
    assert "0.202 cm²/g" in figure.texts[0].get_text()
    assert "0.17 cm²/g" in harder.texts[0].get_text()
    half = 0.5 * norm.vmax
    ratio = (1 - np.exp(-0.2018 * half)) / (1 - np.exp(-0.2018 * norm.vmax))
    assert float(norm(half)) == pytest.approx(ratio**0.6, rel=1e-4)
    assert norm.inverse(float(norm(half))) == pytest.approx(half)


def test_before_there_is_a_cloud_what_moves_sets_the_scale(draw):
    figure, _ = draw(draw_radiograph, snapshot(cloud=False))
    # 10 mm across at 2 g/cm3; the plate, seen along 80 mm, has 16 g/cm2.
    assert 1.0 < film_of(figure).norm.vmax < 2.5


@pytest.mark.parametrize("function", [draw_radiograph, draw_spray, draw_fragments])
@pytest.mark.parametrize("cloud", [True, False])
def test_text_stays_within_the_figure_and_apart(draw, function, cloud):
    figure, pixels = draw(function, snapshot(cloud=cloud))
    assert pixels.shape[1] == 1400
    texts = all_texts(figure)
    assert len(texts) > 4
    boxes = [text.get_window_extent() for text in texts]
    for text, box in zip(texts, boxes, strict=True):
        assert box.x0 >= 0, text.get_text()
        assert box.y0 >= 0, text.get_text()
        assert box.x1 <= figure.bbox.width, text.get_text()
        assert box.y1 <= figure.bbox.height, text.get_text()
    for k, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:k]), texts[k]


@pytest.mark.parametrize("function", [draw_radiograph, draw_spray, draw_fragments])
def test_the_title_says_case_and_time(draw, case, function):
    title = "$\\frac{ & #1"  # as it stands, though it looks like a formula
    figure, _ = draw(function, of=case.model_copy(update={"title": title}))
    found = [x.get_text() for x in all_texts(figure) if title in x.get_text()]
    assert found[0].startswith(title)
    assert (
        "t = 6.89 µs after first contact: the exposure at nominal 6 µs + 0.89 µs clock"
        in found[0]
    )


def test_the_spray_shows_each_bodys_mass_and_momentum(draw):
    figure, _ = draw(draw_spray)
    a = snapshot().arrays
    sphere, apart, ejecta = a["body"] == 0, a["u_r"] > 2e3, a["u_z"] < 0.0
    plate = (a["u_z"] == 5000.0) & ~sphere
    heights = []
    for axes in figure.axes:
        per_body = [p.get_data() for p in axes.patches if isinstance(p, StepPatch)]
        assert len(per_body) == 2
        edges = per_body[0].edges
        width = edges[1] - edges[0]
        heights.append([width * (top - bottom) for top, _, bottom in per_body])
    mass, axial, radial = heights
    aside, back = int(45.0 / width), int(135.0 / width)
    assert mass[0][0] == pytest.approx(1e6 * a["m"][sphere].sum())
    assert mass[1][0] == pytest.approx(1e6 * a["m"][plate].sum())
    assert mass[1][aside] == pytest.approx(1e6 * a["m"][apart].sum())
    assert mass[1][back] == pytest.approx(1e6 * a["m"][ejecta].sum())
    assert axial[0][0] == pytest.approx(5000.0 * a["m"][sphere].sum())
    assert axial[1][back] == pytest.approx(-1500.0 * a["m"][ejecta].sum())
    assert radial[1][aside] == pytest.approx(3000.0 * a["m"][apart].sum())
    assert [axes.get_ylabel() for axes in figure.axes] == [
        "mass [mg/°]",
        "axial momentum [N s/°]",
        "radial momentum [N s/°]",
    ]
    grams = 1e3 * a["m"][sphere].sum()
    legend = figure.axes[0].get_legend().get_texts()
    assert legend[0].get_text() == f"sphere ({grams:.3g} g)"


@pytest.mark.parametrize(
    ("particles", "bins"), [(20, 12), (106, 20), (160, 30), (200, 36), (5000, 60)]
)
def test_bins_of_the_spray_are_as_fine_as_the_particles_allow(particles, bins):
    assert debris._spray_bins(particles) == bins


def test_the_spray_shows_the_angles_in_which_something_moves(draw):
    shot = snapshot()
    whole, _ = draw(draw_spray, shot)
    assert whole.axes[0].get_xlim() == (0.0, 150.0)
    forward = {n: x[shot.arrays["u_z"] >= 0.0] for n, x in shot.arrays.items()}
    cloud, _ = draw(draw_spray, shot._replace(arrays=forward))
    assert cloud.axes[0].get_xlim() == (0.0, 60.0)


@pytest.mark.parametrize(("low", "high"), [(2.0, 9.0), (0.2, 5.0), (0.3, 2e3)])
def test_labels_of_a_log_axis_stand_apart(low, high):
    figure = Figure(figsize=(3.0, 2.0))
    axes = figure.add_subplot()
    axes.plot([1.0, 2.0], [low, high])
    axes.set_yscale("log")
    label_log_axis(axes.yaxis)
    figure.draw_without_rendering()
    ticks = axes.yaxis.get_ticklabels(which="both")
    shown = [t for t in ticks if t.get_text() and low <= t.get_position()[1] <= high]
    assert shown, "no label"
    assert all("e" not in t.get_text() and "$" not in t.get_text() for t in shown)
    boxes = sorted((t.get_window_extent() for t in shown), key=lambda box: box.y0)
    assert all(a.y1 < b.y0 for a, b in pairwise(boxes))


def test_fragments_are_shown_by_mass_and_velocity(draw):
    figure, _ = draw(draw_fragments)
    left, right = figure.axes
    a = snapshot().arrays
    sphere, plate = (line.get_xydata() for line in left.lines)
    assert sphere[0] == pytest.approx([5.0, 1e6 * a["m"][a["u_z"] == 5e3].sum()])
    apart = a["m"][a["u_r"] > 2e3]
    assert plate[0] == pytest.approx([3.0, 1e6 * float(apart[0])])
    counts = [text.get_text() for text in right.get_legend().get_texts()]
    assert counts == ["1.2: 2", "1.5: 2", "2: 2", "3: 2"]
    assert "A fragment is a ring" in figure.get_suptitle()


def test_the_number_of_fragments_falls_behind_each_mass(draw):
    figure, _ = draw(draw_fragments)
    line = figure.axes[1].lines[1]
    mass, number = line.get_data()
    assert (np.diff(mass) <= 0).all(), "the heaviest first"
    assert number.tolist() == [1, 2]
    # Between two masses as many are at least as heavy as the heavier one has above.
    assert line.get_drawstyle() == "steps-post"


def test_without_a_cloud_there_are_no_fragments(draw):
    figure, _ = draw(draw_fragments, snapshot(cloud=False))
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert texts == ["no cloud", "no cloud"]


@pytest.mark.parametrize("function", [draw_radiograph, draw_spray, draw_fragments])
def test_a_case_without_a_plate_is_drawn(draw, tmp_path, function):
    text = (CASES / "plate-impact.toml").read_text().replace('plate"', 'cylinder"')
    path = tmp_path / "rods.toml"
    path.write_text(text.replace("thickness", "length"))
    draw(function, of=load_case(path))
