"""The figure of the clock's offset, read back from the axes."""

from pathlib import Path

import numpy as np
import pytest
from launch import CASES
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from mpisph.analysis.clock_offset import PREDICTIONS, ClockRun, conclude, fit_clock
from mpisph.case import load_case
from mpisph.core.errors import MpisphError
from mpisph.figures.clock import draw_clock


@pytest.fixture(scope="module")
def case():
    """Shot 4-1353: 15.3 and 31.7 mm at 6 us, 37.5 and 98 mm at 19 us."""
    return load_case(CASES / "piekutowski-4-1353.toml")


def make_run(case, npr, offset, end=22e-6):
    """A cloud that passes near all measured sizes at the offset times."""
    time = np.linspace(0.0, end, 2001)
    rows = np.zeros(
        time.size, [(n, "f8") for n in ("time", "cloud_radius", "cloud_length")]
    )
    rows["time"] = time
    nominal = time - offset
    rows["cloud_radius"] = np.interp(nominal, [-3e-6, 6e-6, 30e-6], [0, 0.016, 0.055])
    rows["cloud_length"] = 31.7e-3 + 5100.0 * (nominal - 6e-6)
    resolution = case.resolution.model_copy(update={"npr": npr})
    case = case.model_copy(update={"resolution": resolution})
    fit = fit_clock(rows, case)
    return ClockRun(Path(f"{npr}"), case, npr, 10 * npr, rows, fit)


@pytest.fixture(scope="module")
def runs(case):
    return [make_run(case, npr, 0.8e-6 + 4e-6 / npr) for npr in (20, 10, 40)]


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


def legend(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_each_runs_minimum_is_marked_on_its_curve(tmp_path, runs, drawn):
    path = draw_clock(*runs, out_png=tmp_path / "new" / "clock.png")
    assert path.exists()
    above = drawn[-1].axes[0]
    curves = [x for x in above.lines if len(x.get_xdata()) > 2]
    dots = [x for x in above.lines if x.get_marker() == "o"]
    ordered = sorted(runs, key=lambda run: run.npr)
    for curve, dot, run in zip(curves, dots, ordered, strict=True):
        (offset,), (left,) = dot.get_xdata(), dot.get_ydata()
        assert offset == pytest.approx(run.fit.offset * 1e6)
        errors = np.asarray(run.fit.errors)
        assert left == pytest.approx(100 * (errors @ errors / 4) ** 0.5)
        assert left <= curve.get_ydata().min() + 1e-9
        assert left == pytest.approx(curve.get_ydata().min(), rel=1e-2)
        assert dot.get_color() == curve.get_color()
        label = f"NPR {run.npr}: {offset:.2f} µs, {left:.1f} % left"
        assert label in legend(above)


def test_both_uncertainties_are_shaded(tmp_path, runs, drawn):
    found = conclude(runs)
    draw_clock(*runs, out_png=tmp_path / "clock.png")
    above = drawn[-1].axes[0]
    widths = [x.get_width() for x in above.patches if isinstance(x, Rectangle)]
    sizes = [2e6 * found.numerical, 2e6 * found.figures]
    assert widths == pytest.approx(sizes)
    assert any(t == f"numerical: ±{sizes[0] / 2:.2f} µs" for t in legend(above))


def test_one_run_has_no_numerical_uncertainty_to_shade(tmp_path, runs, drawn):
    draw_clock(runs[0], out_png=tmp_path / "clock.png")
    above = drawn[-1].axes[0]
    assert len(above.patches) == 1
    assert not [text for text in legend(above) if "numerical" in text]


def test_measured_sizes_stand_at_nominal_and_at_shifted_times(tmp_path, runs, drawn):
    conclusion = conclude(runs, npr=10)
    draw_clock(*runs, out_png=tmp_path / "clock.png", conclusion=conclusion)
    below = drawn[-1].axes[1]
    nominal, shifted = (x for x in below.lines if x.get_marker() == "o")
    assert nominal.get_xdata().tolist() == [6.0, 6.0, 19.0, 19.0]
    assert nominal.get_ydata() == pytest.approx([15.3, 31.7, 37.5, 98.0])
    shift = shifted.get_xdata() - nominal.get_xdata()
    assert shift == pytest.approx(np.full(4, 1e6 * runs[1].fit.offset))
    assert nominal.get_fillstyle() == "none"
    assert f"measured, {shift[0]:.2f} µs later" in legend(below)


def test_each_runs_sizes_are_drawn_in_its_colour(tmp_path, runs, drawn):
    draw_clock(*runs, out_png=tmp_path / "clock.png")
    above, below = drawn[-1].axes
    curves = {x.get_label(): x for x in below.lines}
    for run, dot in zip(
        sorted(runs, key=lambda run: run.npr),
        [x for x in above.lines if x.get_marker() == "o"],
        strict=True,
    ):
        for symbol, column in (("L_b", "cloud_length"), ("R_b", "cloud_radius")):
            line = curves[f"${symbol}$, NPR {run.npr}"]
            np.testing.assert_allclose(line.get_ydata(), 1e3 * run.history[column])
            assert line.get_color() == dot.get_color()


def test_the_note_on_predictions_is_shown_within_the_figure(tmp_path, runs, drawn):
    draw_clock(*runs, out_png=tmp_path / "clock.png")
    below = drawn[-1].axes[1]
    (note,) = (x for x in below.texts if "predictions" in x.get_text())
    assert note.get_text().split() == PREDICTIONS.split()
    frame, box = below.get_window_extent(), note.get_window_extent()
    assert frame.x0 < box.x0
    assert box.x1 < frame.x1
    assert frame.y0 < box.y0


def test_curves_end_with_what_the_run_covers(tmp_path, case, drawn):
    run = make_run(case, 10, 0.8e-6, end=20.1e-6)
    draw_clock(run, out_png=tmp_path / "clock.png")
    (curve,) = (x for x in drawn[-1].axes[0].lines if len(x.get_xdata()) > 2)
    assert curve.get_xdata().max() == pytest.approx(1.1)


def test_a_long_title_is_wrapped_and_drawn_as_it_stands(tmp_path, case, drawn):
    title = "$\\frac{ " + "a long title " * 12
    case = case.model_copy(update={"title": title})
    draw_clock(make_run(case, 10, 0.8e-6), out_png=tmp_path / "clock.png")
    figure = drawn[-1]
    shown = figure.axes[0].get_title(loc="left")
    assert shown.split() == title.split()
    assert figure.axes[0]._left_title.get_window_extent().x1 < figure.bbox.width


def test_runs_that_do_not_belong_together_are_refused(tmp_path, runs):
    with pytest.raises(MpisphError, match="one run for each resolution"):
        draw_clock(runs[0], runs[0], out_png=tmp_path / "clock.png")
    assert not (tmp_path / "clock.png").exists()
