"""The figure of damage against the equation shows what the tests say."""

import numpy as np
from launch import CASES

from mpisph.study.assess.outcome import Assessed
from mpisph.study.assess.published import read_tests
from mpisph.study.assess.scatter import RANGE, can_draw, draw_scatter, scatter_figure

TESTS = read_tests(CASES / "studies" / "whipple-tests.csv")


def judged(k, damage, outcome):
    return Assessed(TESTS[k], "completed", outcome, "", None, damage)


def test_each_test_stands_where_it_belongs():
    failed = [k for k, test in enumerate(TESTS) if test.failed][:3]
    held = [k for k, test in enumerate(TESTS) if not test.failed][:2]
    tests = [
        judged(failed[0], 2.0, "perforated"),
        judged(failed[1], 1.01, "undecided"),
        judged(failed[2], None, "undecided"),
        judged(held[0], 0.5, "holds"),
        judged(held[1], 0.0, "holds"),
    ]
    figure = scatter_figure(tests)
    (axes,) = figure.axes
    circles, triangles, hollow = axes.collections
    ratios = [TESTS[k].ratio for k in held]
    assert np.allclose(circles.get_offsets()[:, 0], ratios)
    heights = circles.get_offsets()[:, 1]
    assert heights[0] == 0.5
    assert RANGE[0] < heights[1] < 1.1 * RANGE[0]  # at the edge
    assert np.allclose(triangles.get_offsets(), [[TESTS[failed[0]].ratio, 2.0]])
    assert np.allclose(hollow.get_offsets(), [[TESTS[failed[1]].ratio, 1.01]])
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == [
        "2 tests that held",
        "2 tests that failed",
        "of these undecided: 1",
    ]


def test_all_marks_and_words_lie_within_the_figure(tmp_path):
    tests = [
        judged(k, 10.0 ** (0.04 * k - 2.0), "holds" if k < 50 else "perforated")
        for k in range(100)
    ]
    figure = scatter_figure(tests)
    draw_scatter(tests, tmp_path / "figure.png")
    figure.canvas.draw()
    whole = figure.bbox
    (axes,) = figure.axes
    boxes = [text.get_window_extent() for text in axes.texts]
    boxes += [figure.legends[0].get_window_extent()]
    for box in boxes:
        assert whole.x0 <= box.x0
        assert box.x1 <= whole.x1
        assert whole.y0 <= box.y0
        assert box.y1 <= whole.y1
    low, high = axes.get_xlim()
    assert low < min(t.test.ratio for t in tests)
    assert high > max(t.test.ratio for t in tests)


def test_without_a_damage_there_is_nothing_to_draw():
    assert not can_draw([judged(0, None, "undecided")])
    assert can_draw([judged(0, 0.0, "holds")])
