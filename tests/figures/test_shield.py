"""Cuts through a shield: times, particles and limits, read back from the axes."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from pictures import dots_by_colour

from mpisph.figures.cloud import draw_run
from mpisph.figures.shield import choose_grid, draw_shield
from mpisph.figures.style import BODY_COLOURS
from mpisph.figures.view import View, choose_view
from mpisph.io.run_folder import WHOLE_RUN_FIGURES
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import read_run


@pytest.fixture
def drawn(monkeypatch):
    """Keep the figures that are saved."""
    figures = []
    monkeypatch.setattr(
        Figure, "savefig", lambda figure, *_, **__: figures.append(figure)
    )
    return figures


@pytest.fixture(scope="module")
def run(judged):
    return read_run(judged)


@pytest.fixture
def figure(run, drawn, tmp_path):
    draw_shield(run, tmp_path / "shield.png")
    return drawn[-1]


def test_a_panel_for_each_moment_all_in_one_scale(run, figure):
    titles = [axes.get_title("left") for axes in figure.axes]
    assert titles == ["3.0 µs: at the wall", "12.0 µs: at the end"]
    limits = {(axes.get_xlim(), axes.get_ylim()) for axes in figure.axes}
    assert len(limits) == 1
    names = [text.get_text() for text in figure.legends[0].get_texts()]
    assert names == ["original faces", "projectile", "bumper", "wall"]


def test_particles_stand_where_the_snapshot_has_them(run, figure):
    axes = figure.axes[-1]
    arrays = read_snapshot(run.snapshots[-1][0]).arrays
    lines = {line.get_label(): line for line in axes.lines}
    low, high = axes.get_xlim()
    z, r = 1e3 * arrays["z"], 1e3 * arrays["r"]
    dots = dots_by_colour(axes)
    assert tuple(dots) == BODY_COLOURS[:3]
    for body, shown in enumerate(dots.values()):
        mine = (arrays["body"] == body) & (z >= low) & (z <= high)
        mine &= r <= axes.get_ylim()[1]
        assert sorted(shown[:, 0]) == sorted([*z[mine], *z[mine]])
        assert sorted(shown[:, 1]) == sorted([*r[mine], *-r[mine]])
    assert {"projectile", "bumper", "wall"} <= lines.keys()


def test_original_faces_are_those_of_bumper_and_wall(run, figure):
    shown = [
        tuple(segment[0][0] for segment in lines.get_segments())
        for lines in figure.axes[0].collections
    ]
    faces = [1e3 * z for body in run.case.bodies[1:] for z in body.section.ends]
    np.testing.assert_allclose(np.ravel(shown), faces)


def test_what_flies_far_does_not_widen_the_view(run):
    snapshot = read_snapshot(run.snapshots[-1][0])
    view = choose_view(snapshot, run.case, None)
    shield, rear = run.case.shield, 1e3 * run.case.bodies[-1].section.ends[1]
    assert view.z_low == pytest.approx(-2e3 * shield.projectile.diameter)
    assert view.z_high > rear + 1e3 * run.result.verdict.wall.bulge
    arrays = {name: values.copy() for name, values in snapshot.arrays.items()}
    arrays["z"][:4], arrays["r"][:4] = [-1.0, 1.0, 0.0, 2.0], [0.1, 0.1, 3.0, 2.0]
    arrays["u_z"][:4] = 5e3
    far = choose_view(snapshot._replace(arrays=arrays), run.case, None)
    widest = 1.04e3 * max(body.section.widest for body in run.case.bodies)
    assert far.r_high <= max(view.r_high, widest)
    assert far.z_low == view.z_low
    assert far.z_high <= 1.6 * rear


def test_a_title_of_signs_stays_text(run, drawn, tmp_path):
    title = "<b>5</b> & $x_b$ {{ 7 }}"
    case = run.case.model_copy(update={"title": title})
    draw_shield(run._replace(case=case), tmp_path / "shield.png")
    (text,) = drawn[-1].texts
    assert text.get_text().startswith(title)
    assert not text.get_parse_math()


@pytest.mark.parametrize(("aspect", "columns"), [(0.2, 1), (1.0, 2), (4.0, 4)])
def test_panels_are_arranged_to_be_large(aspect, columns):
    grid = choose_grid(View(0.0, 10.0, 5.0 * aspect), 4, 6.0, 0.3)
    assert grid.columns == columns
    assert grid.height == pytest.approx(aspect * grid.width)
    two = choose_grid(View(0.0, 10.0, 5.0 * aspect), 2, 6.0, 0.3)
    assert two.columns == min(columns, 2)
    assert grid.rows * (grid.height + 0.3) <= 8.0 + 1e-9


def test_the_figures_of_a_shield_are_drawn_with_those_of_the_run(judged, drawn):
    names = [path.name for path in draw_run(judged)]
    assert names == [f"{name}.png" for name in WHOLE_RUN_FIGURES]
    assert len(drawn) == len(names)
