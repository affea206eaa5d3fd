"""The figure of a convergence study, read back from the axes."""

from itertools import pairwise

import numpy as np
import pytest
from matplotlib.figure import Figure

from mpisph.analysis.convergence import converge
from mpisph.study.plots.convergence import (
    ConvergencePanel,
    ConvergenceSeries,
    draw_convergence,
)

NPR = (10, 20, 40)
FIRST_ORDER = ConvergenceSeries(
    "4-1353", converge(NPR, [0.016 - 0.02 / n for n in NPR]), 0.0153
)
OSCILLATORY = ConvergenceSeries("4-1352", converge(NPR, [0.012, 0.014, 0.013]))
DIVERGENT = ConvergenceSeries("4-1291", converge(NPR, [0.012, 0.013, 0.015]))
TWO = ConvergenceSeries("4-1283", converge([10, 20, 40], [0.02, None, 0.022]))
ONE = ConvergenceSeries("other", converge([10], [0.02]))


@pytest.fixture
def draw(monkeypatch, tmp_path):
    """Draw panels and return the figure that was saved."""
    figures = []
    save = Figure.savefig

    def keep(figure, *arguments, **options):
        figures.append(figure)
        save(figure, *arguments, **options)

    monkeypatch.setattr(Figure, "savefig", keep)

    def run(*panels):
        path = tmp_path / "new" / "convergence.png"
        draw_convergence(panels, "A title", path)
        assert path.exists()
        return figures[-1]

    return run


def panel(*series):
    return ConvergencePanel("$R_b$", "mm", series, 1e3)


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def bars(axes):
    """Centre and half height of each error bar."""
    segments = [x.get_segments()[0] for x in axes.collections]
    return [(s[:, 1].mean(), 0.5 * np.ptp(s[:, 1])) for s in segments]


def test_levels_stand_at_one_over_npr_in_the_unit(draw):
    axes = draw(panel(FIRST_ORDER)).axes[0]
    line = axes.lines[0]
    assert line.get_xdata() == pytest.approx([0.1, 0.05, 0.025])
    assert line.get_ydata() == pytest.approx([14.0, 15.0, 15.5])
    assert axes.get_ylabel() == "$R_b$ [mm]"
    labels = {t.get_text() for t in axes.get_xticklabels()}
    assert labels == {"∞", "10", "20", "40"}
    assert legend(axes) == ["4-1353: p 1.00"]


def test_the_extrapolation_leads_to_zero_with_its_bar(draw):
    axes = draw(panel(FIRST_ORDER)).axes[0]
    # A straight line: the order is one.
    (curve,) = (x for x in axes.lines if x.get_linestyle() == ":")
    x, y = curve.get_xdata(), curve.get_ydata()
    assert y == pytest.approx(16.0 - 20.0 * x)
    assert (x[0], x[-1]) == (0.0, 0.025)
    (bar,) = bars(axes)
    assert bar == pytest.approx((16.0, 1.25 * 0.5))
    (limit,) = axes.containers[0].lines[0].get_data()[1]
    assert limit == pytest.approx(16.0)


def test_the_measured_value_is_a_dashed_line_of_the_series_colour(draw):
    axes = draw(panel(FIRST_ORDER, OSCILLATORY)).axes[0]
    (line,) = (
        x for x in axes.lines if x.get_transform() != axes.transData and x.is_dashed()
    )
    assert line.get_ydata() == pytest.approx([15.3, 15.3])
    assert line.get_color() == axes.lines[0].get_color()


def test_an_oscillation_is_not_extrapolated(draw):
    axes = draw(panel(OSCILLATORY)).axes[0]
    assert not [x for x in axes.lines if x.get_linestyle() == ":"]
    assert bars(axes) == [pytest.approx((13.0, 2.0))]
    assert axes.containers[0].lines[0].get_markerfacecolor() == "white"
    assert legend(axes) == ["4-1352: oscillatory"]


def test_a_divergence_has_no_bar(draw):
    axes = draw(panel(DIVERGENT)).axes[0]
    assert not axes.collections
    assert axes.containers[0].lines[0].get_markerfacecolor() == "white"
    assert legend(axes) == ["4-1291: divergent"]


def test_two_levels_and_one(draw):
    axes = draw(panel(TWO, ONE)).axes[0]
    assert legend(axes) == ["4-1283: p 1 assumed", "other: too few"]
    # (22 - 20)/(4 - 1) beyond 22, three times that as its uncertainty.
    assert bars(axes) == [pytest.approx((22.0 + 2 / 3, 2.0))]


def test_a_limited_order_is_said(draw):
    values = [1.0 - 0.5 * n**-0.2 for n in NPR]
    axes = draw(panel(ConvergenceSeries("a", converge(NPR, values)))).axes[0]
    assert legend(axes) == ["a: p 0.20, limited"]


def test_bars_of_several_series_stand_side_by_side(draw):
    axes = draw(panel(FIRST_ORDER, OSCILLATORY, TWO)).axes[0]
    places = [float(c.lines[0].get_xdata()[0]) for c in axes.containers]
    assert places[0] == 0.0
    assert axes.get_xlim()[0] < places[2] < places[1] < 0.0


def test_panels_stand_two_in_a_row(draw):
    figure = draw(*[panel(FIRST_ORDER)] * 3)
    boxes = [axes.get_position() for axes in figure.axes]
    assert boxes[0].y0 == pytest.approx(boxes[1].y0)
    assert boxes[2].y1 < boxes[0].y0
    assert [axes.axison for axes in figure.axes] == [True, True, True, False]


def test_labels_that_would_touch_are_left_out(draw):
    npr = (4, 8, 16, 32, 64, 128)
    series = ConvergenceSeries("a", converge(npr, [1.0 + 1 / n for n in npr]))
    axes = draw(panel(series)).axes[0]
    labels = [t.get_text() for t in axes.get_xticklabels()]
    assert labels[:4] == ["∞", "4", "8", "16"]
    assert labels[-1] == ""
    boxes = [t.get_window_extent() for t in axes.get_xticklabels() if t.get_text()]
    boxes.sort(key=lambda box: box.x0)
    for left, right in pairwise(boxes):
        assert left.x1 < right.x0


@pytest.mark.parametrize("count", [1, 4])
def test_text_and_legend_stay_within_the_figure(draw, count):
    series = [
        s._replace(name=f"4-135{k}")
        for k, s in enumerate((DIVERGENT, TWO, OSCILLATORY, FIRST_ORDER))
    ]
    figure = draw(*[panel(*series)] * count)
    (note,) = (x for x in figure.texts if x.get_text().startswith("At ∞"))
    note = note.get_window_extent()
    assert note.x0 > 0
    assert note.y0 > 0
    assert note.x1 < figure.bbox.width
    for axes in figure.axes:
        frame, box = axes.get_window_extent(), axes.get_legend().get_window_extent()
        assert frame.x0 <= box.x0
        assert box.x1 <= frame.x1
        # Above all that is drawn.
        top = max(centre + half for centre, half in bars(axes))
        assert box.y0 > axes.transData.transform((0.0, top))[1]


def test_a_panel_without_values(draw):
    draw(panel(ConvergenceSeries("a", converge([10], [None]))))
    draw(panel())
