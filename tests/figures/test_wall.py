"""The wall close by: colours, marks and words follow the snapshots."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from pictures import dots_by_colour
from shields import coarse

from mpisph.analysis.wall import wall_layout
from mpisph.figures.wall import draw_wall, wall_record
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


def draw(run, drawn, tmp_path):
    """The panels of the figure, and the axes of its colour bars."""
    draw_wall(run, tmp_path / "wall.png")
    axes = drawn[-1].axes
    return axes[:-2], axes[-2:]


def with_last_wall(run, **changes):
    walls = run.result.walls
    last = walls[-1].model_copy(update=changes)
    result = run.result.model_copy(update={"walls": (*walls[:-1], last)})
    return run._replace(result=result)


def marks(axes):
    """Positions of the dotted lines across and along the axis."""
    dotted = [line for line in axes.lines if line.get_color() == "#B2182B"]
    z = [x[0] for x, y in (line.get_data() for line in dotted) if list(y) == [0, 1]]
    r = [y[0] for x, y in (line.get_data() for line in dotted) if list(x) == [0, 1]]
    return z, r


def test_damage_above_and_axial_velocity_below_of_the_wall_alone(run, drawn, tmp_path):
    panels, bars = draw(run, drawn, tmp_path)
    arrays = read_snapshot(run.snapshots[-1][0]).arrays
    axes = panels[-1]
    z, r = 1e3 * arrays["z"], 1e3 * arrays["r"]
    (low, high), top = axes.get_xlim(), axes.get_ylim()[1]
    seen = (z >= low) & (z <= high) & (r <= top)
    wall = seen & (arrays["body"] == 2)
    assert np.count_nonzero(wall) > 30
    above, below = [c for c in axes.collections if c.get_array() is not None]
    np.testing.assert_allclose(above.get_offsets(), np.stack([z, r], 1)[wall])
    np.testing.assert_allclose(below.get_offsets(), np.stack([z, -r], 1)[wall])
    np.testing.assert_allclose(above.get_array(), arrays["damage"][wall])
    np.testing.assert_allclose(below.get_array(), arrays["u_z"][wall])
    others = dots_by_colour(axes)["0.82"]
    assert sorted(others[:, 0]) == sorted(np.tile(z[seen & ~wall], 2))
    assert np.unique(others[:, 2]).size > 3
    assert [bar.get_ylabel() for bar in bars] == ["damage", "axial velocity [m/s]"]
    assert below.norm.vmin <= 0.0 <= below.norm.vmax


def test_times_and_sizes_stand_above_the_panels(run, drawn, tmp_path):
    whole = with_last_wall(run, hole=0.0)
    panels, _ = draw(whole, drawn, tmp_path)
    titles = [axes.get_title("left") for axes in panels]
    wall = run.result.walls[-1]
    assert [title.splitlines()[0] for title in titles[1:]] == [
        "10.0 µs: earlier verdict",
        "12.0 µs: end",
    ]
    assert titles[0].splitlines()[0].endswith("µs: loading")
    assert f"bulge {1e3 * wall.bulge:.1f} mm" in titles[-1].replace("\n", " ")
    assert f"crater {1e3 * wall.crater_depth:.1f} mm" in titles[-1]


def test_crater_and_bulge_are_marked_where_they_are(run, drawn, tmp_path):
    panels, _ = draw(with_last_wall(run, hole=0.0), drawn, tmp_path)
    wall, (front, rear) = run.result.walls[-1], run.case.bodies[-1].section.ends
    z, r = marks(panels[-1])
    expected = [
        1e3 * (front + wall.bulge + wall.crater_depth),
        1e3 * (rear + wall.bulge),
    ]
    np.testing.assert_allclose(z, expected)
    assert r == []


def test_a_hole_is_marked_by_its_edge(run, drawn, tmp_path):
    holed = with_last_wall(run, hole=6e-3, detached=2e-5)
    panels, _ = draw(holed, drawn, tmp_path)
    z, r = marks(panels[-1])
    assert z == []
    np.testing.assert_allclose(r, [3.0, -3.0])
    title = panels[-1].get_title("left").replace("\n", " ")
    assert "hole 6.0 mm" in title
    assert "0.02 g off" in title
    assert "crater" not in title


def test_the_verdict_and_a_title_of_signs_stay_text(run, drawn, tmp_path):
    verdict = run.result.verdict.model_copy(
        update={"reason": "over at 5 us, $x$ & <b>"}
    )
    result = run.result.model_copy(update={"verdict": verdict})
    case = run.case.model_copy(update={"title": "$y_b$ <i>"})
    draw(run._replace(result=result, case=case), drawn, tmp_path)
    text = drawn[-1].texts[0]
    assert text.get_text().startswith("$y_b$ <i>\nperforated: over at 5 µs, $x$ & <b>")
    assert not text.get_parse_math()


def test_without_a_result_the_snapshots_are_measured(run, drawn, tmp_path):
    layout = wall_layout(run.case)
    last = wall_record(layout, read_snapshot(run.snapshots[-1][0]))
    assert last == run.result.walls[-1]
    with_result, _ = draw(run, drawn, tmp_path)
    without, _ = draw(run._replace(result=None), drawn, tmp_path)
    titles = [[axes.get_title("left") for axes in p] for p in (with_result, without)]
    assert titles[0] == titles[1]
    assert "perforated" not in drawn[-1].texts[0].get_text()


def test_a_wall_that_cannot_break_shows_its_plastic_strain(run, drawn, tmp_path):
    case = coarse(materials={"al-6061-t6": {"failure": "none", "ductile": "none"}})
    _, bars = draw(run._replace(case=case), drawn, tmp_path)
    assert bars[0].get_ylabel() == "plastic strain"


def test_what_lies_nowhere_is_not_shown(run, drawn, tmp_path, monkeypatch):
    broken = with_last_wall(run, bulge=np.nan)
    panels, _ = draw(broken, drawn, tmp_path)
    titles = [axes.get_title("left").splitlines()[0] for axes in panels]
    assert titles[-1] == "10.0 µs: end"

    def read(path):
        snapshot = read_snapshot(path)
        if path == run.snapshots[-1][0]:
            snapshot.arrays["z"][-1] = np.nan
        return snapshot

    monkeypatch.setattr("mpisph.figures.wall.read_snapshot", read)
    panels, _ = draw(run._replace(result=None), drawn, tmp_path)
    assert panels[-1].get_title("left").startswith("10.0 µs: end")
