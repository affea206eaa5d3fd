"""Figures of studies: what a reader would look for in them, read back from the axes."""

import math

import matplotlib.image
import numpy as np
import pytest
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

from mpisph.figures.style import BODY_COLOURS, DPI, WIDTH
from mpisph.study.plots.axes import Axis
from mpisph.study.plots.lines import LinesFigure, LinesPanel, LinesRow, draw_lines
from mpisph.study.plots.map import MapFigure, MapPanel, draw_map
from mpisph.study.plots.panels import Band, finish, panel_grid
from mpisph.study.plots.shots import ShotsFigure, ShotsSeries, draw_shots

NAN = math.nan


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


def legend_texts(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def curves(axes):
    """Lines of an axes that have more than the two ends of a measured value."""
    return [x for x in axes.lines if x.get_transform() == axes.transData]


# Lines


def lines_data(**changes):
    """Two rows, three lines over four points, in two panels; two runs are unstable."""
    values = np.arange(24.0).reshape(2, 3, 4) + 10.0
    unstable = np.zeros((3, 4), bool)
    unstable[1, 0] = unstable[2, 0] = True
    values[:, unstable] = NAN
    panels = [
        LinesPanel("one", values, unstable),
        LinesPanel("two", values + 5.0, np.zeros((3, 4), bool)),
    ]
    data = LinesFigure(
        title="A $title of L_b",
        x=Axis("alpha", "alpha", (0.5, 1.0, 2.0, 5.0), ("0.5", "1.0", "2.0", "5.0")),
        log_x=False,
        lines=Axis("nph", "NPH", (1.0, 1.5, 2.0), ("1.0", "1.5", "2.0")),
        rows=[
            LinesRow("late", True, 30.0),
            LinesRow("early", False, 15.0),
        ],
        bands=[Band("", panels)],
        note="A note.",
    )
    return data._replace(**changes)


def draw(function, data, tmp_path, drawn):
    out = tmp_path / "new" / "figure.png"
    function(data, out)
    image = matplotlib.image.imread(out)
    (figure,) = drawn
    assert image.shape[1] == round(WIDTH * DPI)
    return figure


def test_a_single_line_without_a_name_has_no_legend(tmp_path, drawn):
    panel = LinesPanel("one", np.ones((1, 1, 4)), np.zeros((1, 4), bool))
    alone = lines_data(
        lines=Axis("", "", ("",), ("",)),
        rows=[LinesRow("hole", True, NAN)],
        bands=[Band("", [panel])],
    )
    assert not draw(draw_lines, alone, tmp_path, drawn).legends
    drawn.clear()
    draw(draw_lines, alone._replace(rows=[LinesRow("R", True, 3.0)]), tmp_path, drawn)
    assert legend_texts(drawn[-1]) == ["computed", "measured"]


def grid_of(figure, rows, columns):
    return np.array(figure.axes[: rows * columns]).reshape(rows, columns)


def test_lines_pass_through_the_values_of_each_row_and_panel(tmp_path, drawn):
    data = lines_data()
    figure = draw(draw_lines, data, tmp_path, drawn)
    grid = grid_of(figure, 3, 2)
    for j, panel in enumerate(data.bands[0].panels):
        for k in range(2):
            found = curves(grid[k, j])
            for line, wanted in zip(found, panel.values[k], strict=True):
                np.testing.assert_array_equal(line.get_xdata(), data.x.values)
                np.testing.assert_array_equal(line.get_ydata(), wanted)
    assert [axes.get_ylabel() for axes in grid[:, 0]] == ["late", "early", "unstable"]
    assert [axes.get_title() for axes in grid[0]] == ["one", "two"]
    assert figure.get_suptitle() == data.title


def test_early_lines_are_thin_and_open_late_ones_thick_and_filled(tmp_path, drawn):
    grid = grid_of(draw(draw_lines, lines_data(), tmp_path, drawn), 3, 2)
    late, early = curves(grid[0, 0])[0], curves(grid[1, 0])[0]
    assert late.get_linewidth() > 1.5 * early.get_linewidth()
    assert early.get_markerfacecolor() == "white"
    assert to_hex(late.get_markerfacecolor()) == to_hex(late.get_color())
    assert to_hex(late.get_color()) == to_hex(early.get_color())


def test_unstable_runs_are_crosses_in_the_lines_colours(tmp_path, drawn):
    grid = grid_of(draw(draw_lines, lines_data(), tmp_path, drawn), 3, 2)
    crosses = [x for x in grid[2, 0].lines if len(x.get_xdata())]
    assert [list(x.get_xdata()) for x in crosses] == [[0.5], [0.5]]
    assert [list(x.get_ydata()) for x in crosses] == [[1], [2]]
    assert all(x.get_marker() == "x" for x in crosses)
    above = [to_hex(x.get_color()) for x in curves(grid[0, 0])]
    assert [to_hex(x.get_color()) for x in crosses] == above[1:]
    assert not any(len(x.get_xdata()) for x in grid[2, 1].lines)
    assert grid[2, 0].get_xlim() == grid[0, 0].get_xlim()


def test_without_unstable_runs_there_is_no_strip(tmp_path, drawn):
    data = lines_data()
    panels = [p._replace(unstable=np.zeros((3, 4), bool)) for p in data.bands[0].panels]
    data = data._replace(bands=[Band("", panels)])
    figure = draw(draw_lines, data, tmp_path, drawn)
    assert len(figure.axes) == 4
    assert "unstable run" not in legend_texts(figure)


def test_a_row_has_one_scale_that_holds_all_values_and_the_measured(tmp_path, drawn):
    data = lines_data()
    grid = grid_of(draw(draw_lines, data, tmp_path, drawn), 3, 2)
    for k, row in enumerate(data.rows):
        limits = {axes.get_ylim() for axes in grid[k]}
        assert len(limits) == 1
        low, high = limits.pop()
        everything = [
            row.measured,
            *(v for p in data.bands[0].panels for v in p.values[k].flat),
        ]
        assert low < np.nanmin(everything)
        assert high > np.nanmax(everything)


def test_what_was_measured_is_dashed_and_labelled(tmp_path, drawn):
    figure = draw(draw_lines, lines_data(), tmp_path, drawn)
    grid = grid_of(figure, 3, 2)
    for k, measured in enumerate((30.0, 15.0)):
        for axes in grid[k]:
            (line,) = (x for x in axes.lines if x not in curves(axes))
            assert set(line.get_ydata()) == {measured}
            assert line.is_dashed()
        (label,) = grid[k, 1].texts
        assert label.get_text() == f"measured\n{measured:.1f} mm"
    assert legend_texts(figure) == ["1.0", "1.5", "2.0", "measured", "unstable run"]
    assert figure.legends[0].get_title().get_text() == "NPH"


def test_a_measured_value_that_is_not_there_is_not_drawn(tmp_path, drawn):
    rows = [row._replace(measured=NAN) for row in lines_data().rows]
    figure = draw(draw_lines, lines_data(rows=rows), tmp_path, drawn)
    assert "measured" not in legend_texts(figure)
    axes = figure.axes[0]
    assert len(axes.lines) == len(curves(axes))


def test_categories_are_named_and_not_joined(tmp_path, drawn):
    data = lines_data(x=Axis("x", "", tuple("abcd"), tuple("abcd")))
    axes = draw(draw_lines, data, tmp_path, drawn).axes
    assert all(x.get_linestyle() == "None" for x in curves(axes[0]))
    names = [text.get_text() for text in axes[4].get_xticklabels()]
    assert names == ["a", "b", "c", "d"]


def test_a_logarithmic_axis_has_ticks_at_the_values(tmp_path, drawn):
    grid = grid_of(draw(draw_lines, lines_data(log_x=True), tmp_path, drawn), 3, 2)
    assert {axes.get_xscale() for axes in grid.flat} == {"log"}
    assert list(grid[2, 0].get_xticks()) == [0.5, 1.0, 2.0, 5.0]


def test_bands_lie_below_each_other_with_their_headings(tmp_path, drawn):
    panels = lines_data().bands[0].panels
    bands = [Band("first", panels), Band("second", panels[:1])]
    figure = draw(draw_lines, lines_data(bands=bands), tmp_path, drawn)
    grid = grid_of(figure, 6, 2)
    headings = [grid[k, 0].texts[0].get_text() for k in (0, 3)]
    assert headings == ["first", "second"]
    assert grid[3, 0].get_position().y1 < grid[2, 0].get_position().y0
    assert not grid[3, 1].axison


# Maps

ERRORS = np.array([[1.0, 20.0, NAN], [9.9, 10.0, 70.0]])


def map_data(ranges=(None, None, None), **changes):
    unstable = np.array([[False, False, True], [False, False, False]])
    panel = MapPanel("NPR 4", ERRORS, unstable, ranges)
    data = MapFigure(
        title="A map",
        x=Axis("nph", "NPH", (1.0, 1.5, 2.0), ("1.0", "1.5", "2.0")),
        y=Axis("alpha", "alpha", (0.5, 1.0), ("0.5", "1.0")),
        label="error [%]",
        limit=10.0,
        bands=[Band("nominal", [panel]), Band("offset", [panel])],
        note="A note.",
    )
    return data._replace(**changes)


def test_a_map_shows_the_errors_with_the_limit_between_two_hues(tmp_path, drawn):
    figure = draw(draw_map, map_data(), tmp_path, drawn)
    mesh = figure.axes[0].collections[0]
    np.testing.assert_array_equal(
        mesh.get_array().filled(NAN).reshape(ERRORS.shape), ERRORS
    )
    red, _, blue, _ = (mesh.to_rgba(np.array([9.99, 10.01])).T).astype(float)
    assert blue[0] > red[0]
    assert red[1] > blue[1]
    headings = [axes.texts[0].get_text() for axes in figure.axes[:2]]
    assert headings == ["nominal", "offset"]


def test_cells_below_the_limit_are_outlined(tmp_path, drawn):
    axes = draw(draw_map, map_data(), tmp_path, drawn).axes[0]
    outline = axes.collections[-1].get_segments()
    found = {tuple(sorted(map(tuple, segment.tolist()))) for segment in outline}
    # The left column: 1.0 and 9.9, not the 10.0 beside them.
    wanted = {
        ((-0.5, -0.5), (0.5, -0.5)),
        ((-0.5, 1.5), (0.5, 1.5)),
        ((-0.5, -0.5), (-0.5, 0.5)),
        ((-0.5, 0.5), (-0.5, 1.5)),
        ((0.5, -0.5), (0.5, 0.5)),
        ((0.5, 0.5), (0.5, 1.5)),
    }
    assert found == wanted


def test_unstable_cells_are_hatched(tmp_path, drawn):
    figure = draw(draw_map, map_data(), tmp_path, drawn)
    (hatched,) = (x for x in figure.axes[0].collections if x.get_hatch())
    (cell,) = hatched.get_paths()
    assert cell.get_extents().bounds == (1.5, -0.5, 1.0, 1.0)
    assert "unstable run" in legend_texts(figure)


def test_the_papers_ranges_are_bars_in_their_columns(tmp_path, drawn):
    data = map_data(ranges=[(0.6, 1.0), (0.75, math.inf), ()])
    figure = draw(draw_map, data, tmp_path, drawn)
    axes = figure.axes[0]
    bars = [x for x in axes.lines if len(x.get_xdata()) == 2]
    assert [list(x.get_xdata()) for x in bars] == [[0, 0], [1, 1]]
    # 0.5 and 1.0 are drawn at 0 and 1; the open end is at the upper edge.
    np.testing.assert_allclose([x.get_ydata() for x in bars], [[0.2, 1.0], [0.5, 1.5]])
    (arrow,) = (x for x in axes.lines if x.get_marker() == "^")
    assert (arrow.get_xdata()[0], arrow.get_ydata()[0]) == (1, 1.5)
    (none,) = (text for text in axes.texts if text.get_text() == "none")
    assert none.get_position()[0] == 2
    assert "the paper's range below 10 %" in legend_texts(figure)


@pytest.mark.parametrize(
    ("value", "place"), [(0.3, -0.4), (0.1, -0.5), (1.2, 1.4), (9.0, 1.5), (0.5, 0.0)]
)
def test_ends_beyond_the_map_stay_within_half_a_cell(tmp_path, drawn, value, place):
    ends = (min(value, 0.5), max(value, 0.5))
    axes = draw(draw_map, map_data(ranges=[ends, None, None]), tmp_path, drawn).axes[0]
    y = [float(v) for v in axes.lines[0].get_ydata()]
    assert sorted(y) == pytest.approx(sorted([place, 0.0]))


def test_without_ranges_no_bar_is_explained(tmp_path, drawn):
    figure = draw(draw_map, map_data(), tmp_path, drawn)
    assert legend_texts(figure) == ["below 10 %", "unstable run"]


# Shots


def shots_data():
    one = ShotsSeries("with", np.array([[-10.0, -8.0]]), np.array([[3.0, NAN]]))
    paper = ShotsSeries("paper", np.array([[-5.0, NAN]]), np.full((1, 2), NAN), True)
    return ShotsFigure(
        title="Shots",
        quantities=["$R_b$"],
        shots=["4-1283, 6 us", "4-1353, 6 us"],
        measured=np.array([[22.3, 15.3]]),
        series=[one, paper],
        offset_label="+1.05 us clock offset",
        note="A note.",
    )


def dots(axes):
    return [x for x in axes.lines if x.get_marker() in "osD" and len(x.get_xdata())]


def test_errors_of_shots_are_dots_open_at_the_nominal_time(tmp_path, drawn):
    axes = draw(draw_shots, shots_data(), tmp_path, drawn).axes[0]
    nominal, offset, paper, _ = dots(axes)
    np.testing.assert_array_equal(nominal.get_xdata(), [-10.0, -8.0])
    np.testing.assert_array_equal(offset.get_xdata(), [3.0, NAN])
    np.testing.assert_array_equal(paper.get_xdata(), [-5.0, NAN])
    assert nominal.get_markerfacecolor() == "white"
    assert offset.get_markerfacecolor() == BODY_COLOURS[0]
    assert (paper.get_color(), paper.get_marker()) == ("black", "D")
    # The two clocks of a series lie on one height, each series on its own.
    np.testing.assert_array_equal(nominal.get_ydata(), offset.get_ydata())
    assert (np.abs(nominal.get_ydata() - [0, 1]) < 0.5).all()
    assert (np.abs(nominal.get_ydata() - paper.get_ydata()) > 0.2).all()
    assert axes.yaxis_inverted()


def test_shots_are_named_with_what_was_measured(tmp_path, drawn):
    figure = draw(draw_shots, shots_data(), tmp_path, drawn)
    axes = figure.axes[0]
    names = [text.get_text() for text in axes.get_yticklabels()]
    assert names == ["4-1283, 6 us\n22.3 mm", "4-1353, 6 us\n15.3 mm"]
    band = axes.patches[0].get_extents().transformed(axes.transData.inverted())
    assert (band.x0, band.x1) == pytest.approx((-5.0, 5.0))
    assert legend_texts(figure) == [
        "with, nominal time",
        "with, +1.05 us clock offset",
        "paper, nominal time",
        "±5 %",
    ]


# Frame


def test_nothing_at_the_foot_of_a_figure_overlaps(tmp_path, drawn):
    """The axes with their labels, the legend and the note lie above each other."""
    names = ("a long name " * 3,) * 3
    lines = Axis("nph", "NPH", (1.0, 1.5, 2.0), names)
    data = lines_data(note="many words " * 40, lines=lines)
    figure = draw(draw_lines, data, tmp_path, drawn)
    renderer = figure.canvas.get_renderer()
    axes = min(x.get_tightbbox(renderer).y0 for x in figure.axes)
    legend = figure.legends[0].get_window_extent(renderer)
    (note,) = (x for x in figure.texts if x.get_text().startswith("many words"))
    note = note.get_window_extent(renderer)
    assert axes >= legend.y1
    assert legend.y0 >= note.y1
    assert note.y0 >= 0.0
    width = figure.bbox.width
    assert 0.0 <= note.x0 < note.x1 <= width
    assert 0.0 <= legend.x0 < legend.x1 <= width


def test_the_axes_keep_their_height_whatever_the_note(tmp_path):
    heights = []
    for note in ("short", "many words " * 60):
        with panel_grid("title", 3.0, 1, 1) as (figure, ((axes,),)):
            axes.plot([0, 1], label="line")
            finish(figure, axes.lines, note, tmp_path / "figure.png")
        heights.append(axes.get_window_extent().height)
    assert heights[1] == pytest.approx(heights[0], rel=0.02)
