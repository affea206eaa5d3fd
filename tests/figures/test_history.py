"""Figures of the history: their lines and marks, read back from the axes."""

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure
from small_runs import EXPOSED, small_run

from mpisph.analysis.shield_history import wall_arrival
from mpisph.analysis.verdict import damage_ratio
from mpisph.case import load_case
from mpisph.case.sections import Gauge
from mpisph.figures.history import (
    RunHistory,
    draw_history,
    history_figures,
    shield_figures,
)
from mpisph.io.history import read_history
from mpisph.io.probe_files import BODIES_FILE, probe_headers
from mpisph.io.stored_run import read_run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "run"
    result = small_run(folder, *EXPOSED)
    rows = read_history(folder / "history.csv")
    return RunHistory(rows, load_case(folder / "case.toml"), result.clouds)


def draw(run, name):
    """The axes of one of the figures."""
    (figure,) = [f for f in history_figures(run) if f.name == name]
    axes = Figure().add_subplot()
    figure.draw(axes, run)
    return axes


def lines(axes):
    """Abscissae and ordinates by label."""
    return {x.get_label(): np.array(x.get_data(), float) for x in axes.lines}


@pytest.mark.parametrize(("name", "measured"), [("radius", 7.0), ("length", 2.1)])
def test_the_cloud_beside_what_was_measured(run, name, measured):
    found = lines(draw(run, name))
    time, size = found["computed, outermost"]
    np.testing.assert_allclose(time, 1e6 * run.rows["time"])
    np.testing.assert_allclose(size, 1e3 * run.rows[f"cloud_{name}"])
    time, size = found["computed, 99 % of the mass"]
    np.testing.assert_allclose(time, [1e6 * cloud.time for cloud in run.clouds])
    np.testing.assert_allclose(
        size, [1e3 * getattr(cloud, f"{name}_robust") for cloud in run.clouds]
    )
    # The exposure at 19 us lies beyond the end of the run.
    assert found["measured, nominal time"].T.tolist() == [[1.0, measured]]
    offset = found["measured, +0.35 µs clock offset"].T
    np.testing.assert_allclose(offset, [[1.35, measured]])


def test_without_an_offset_or_a_measurement_there_is_less_to_draw(run):
    measured = run.case.measured.model_copy(update={"clock_offset": 0.0})
    case = run.case.model_copy(update={"measured": measured})
    labels = lines(draw(run._replace(case=case), "radius")).keys()
    assert [label for label in labels if "measured" in label] == [
        "measured, nominal time"
    ]
    case = run.case.model_copy(update={"measured": None})
    captions = [figure.caption for figure in history_figures(run._replace(case=case))]
    assert not [text for text in captions if "measured" in text]
    assert [f.caption for f in history_figures(run) if "measured" in f.caption]
    labels = lines(draw(run._replace(case=case, clouds=()), "length")).keys()
    assert list(labels) == ["computed, outermost"]


def test_energies_in_kilojoules_and_their_sum(run):
    found = lines(draw(run, "energies"))
    kinetic, internal = run.rows["kinetic_energy"], run.rows["internal_energy"]
    np.testing.assert_allclose(found["kinetic"][1], 1e-3 * kinetic)
    np.testing.assert_allclose(found["internal"][1], 1e-3 * internal)
    np.testing.assert_allclose(found["total"][1], 1e-3 * (kinetic + internal))


def test_error_mass_and_steps(run):
    error = next(iter(lines(draw(run, "energy_error")).values()))
    np.testing.assert_allclose(error[1], run.rows["energy_error"])
    mass = next(iter(lines(draw(run, "cloud_mass")).values()))
    np.testing.assert_allclose(mass[1], 1e3 * run.rows["cloud_mass"])
    time, step = next(iter(lines(draw(run, "step")).values()))
    # The line of the start has no step.
    np.testing.assert_allclose(step, 1e9 * run.rows["dt"][1:])
    np.testing.assert_allclose(time, 1e6 * run.rows["time"][1:])


def test_the_imbalance_is_that_of_several_ranks(run):
    assert "imbalance" not in [figure.name for figure in history_figures(run)]
    rows = run.rows.copy()
    rows["imbalance"] = np.linspace(0.0, 0.2, len(rows))
    found = lines(draw(run._replace(rows=rows), "imbalance"))
    values = next(iter(found.values()))
    np.testing.assert_allclose(values[1], 100.0 * rows["imbalance"])
    assert set(found["threshold"][1]) == {5.0}


def test_what_has_nothing_to_show_is_left_out(run):
    assert history_figures(run._replace(rows=run.rows[:1])) == []
    assert history_figures(run._replace(rows=np.array([]))) == []
    rows = run.rows.copy()
    rows["cloud_mass"] = 0.0
    names = [figure.name for figure in history_figures(run._replace(rows=rows))]
    assert names == ["energies", "energy_error", "step"]


def test_every_figure_is_written(run, tmp_path):
    rows = run.rows.copy()
    rows["imbalance"] = 0.1
    # A run that breaks down may leave such a line.
    rows["energy_error"][-1] = np.inf
    rows["cloud_length"][-1] = np.nan
    broken = run._replace(rows=rows)
    figures = history_figures(broken)
    assert len(figures) == 7
    for figure in figures:
        path = tmp_path / "new" / f"{figure.name}.png"
        draw_history(figure, broken, path)
        pixels = matplotlib.image.imread(path)[:, :, :3]
        assert pixels.shape == (620, 1000, 3)
        assert (pixels < 0.5).any(axis=2).mean() > 0.01
        assert figure.title
        assert figure.caption


def test_bodies_and_gauges_have_a_line_each(run):
    gauges = Gauge(name="g", z=0.0), Gauge(name="h", z=1.0)
    case = run.case.model_copy(update={"gauges": gauges})
    headers = probe_headers(case)
    rows = {}
    for file, header in headers.items():
        rows[file] = np.zeros(3, [(name, "f8") for name in header])
        for k, name in enumerate(header):
            rows[file][name] = (k + 1) * np.arange(3.0)
    probed = run._replace(case=case, probes=rows)
    axes = draw(probed, "bodies_peak_pressure")
    found = lines(axes)
    assert set(found) == {"sphere", "plate"}
    peak = rows["bodies.csv"]["peak_pressure_plate_Pa"]
    np.testing.assert_allclose(found["plate"][1], 1e-9 * peak)
    assert axes.get_ylabel() == "largest pressure so far of a particle [GPa]"
    found = lines(draw(probed, "gauges_u_z"))
    np.testing.assert_allclose(
        found["h"][1], 1e-3 * rows["gauges.csv"]["u_z_h_m_per_s"]
    )
    shown = {figure.name for figure in history_figures(run)}
    assert not {name for name in shown if name.startswith(("bodies", "gauges"))}


@pytest.fixture(scope="module")
def shield(judged):
    return RunHistory.of(read_run(judged))


def draw_of_shield(run, name):
    """The axes of one of the figures of a shield, and its caption."""
    (figure,) = [f for f in shield_figures(run) if f.name == name]
    axes = Figure().add_subplot()
    figure.draw(axes, run)
    return axes, figure.caption


def test_momentum_by_body_and_of_all(shield):
    found = lines(draw_of_shield(shield, "momentum")[0])
    rows = shield.probes[BODIES_FILE]
    names = ["projectile", "bumper", "wall"]
    columns = [rows[f"momentum_z_{name}_kg_m_per_s"] for name in names]
    for name, column in zip(names, columns, strict=True):
        np.testing.assert_allclose(found[name], [1e6 * rows["time_s"], column])
    np.testing.assert_allclose(found["all"][1], sum(columns))


def test_arrival_and_rest_are_marked_where_they_are(shield):
    verdict = shield.verdict.model_copy(update={"rest_time": 9e-6})
    axes, caption = draw_of_shield(shield._replace(verdict=verdict), "momentum")
    arrival = 1e6 * wall_arrival(shield.case, shield.probes[BODIES_FILE])
    assert 1.0 < arrival < 3.0
    assert list(lines(axes)["cloud at the wall"][0]) == pytest.approx([arrival] * 2)
    assert list(lines(axes)["wall at rest"][0]) == pytest.approx([9.0] * 2)
    assert f"({arrival:.1f} µs)" in caption
    assert "from 9.0 µs" in caption
    moving = shield.verdict.model_copy(update={"rest_time": None})
    axes, caption = draw_of_shield(shield._replace(verdict=moving), "momentum")
    assert "wall at rest" not in lines(axes)
    assert "still moves" in caption


def test_damage_and_bulge_of_the_wall_over_time(shield):
    time = [1e6 * wall.time for wall in shield.walls]
    axes, _ = draw_of_shield(shield, "damage")
    ratios = [damage_ratio(shield.case, wall) for wall in shield.walls]
    np.testing.assert_allclose(axes.lines[0].get_data(), [time, ratios])
    assert set(lines(axes)["critical"][1]) == {1.0}
    found = lines(draw_of_shield(shield, "bulge")[0])
    bulge = [1e3 * wall.bulge for wall in shield.walls]
    np.testing.assert_allclose(found["bulge of the rear face"], [time, bulge])
    crater = [1e3 * wall.crater_depth for wall in shield.walls]
    np.testing.assert_allclose(found["depth of the crater"][1], crater)


def test_a_shield_shows_no_sizes_of_a_cloud_that_nobody_measured(shield, run):
    names = [figure.name for figure in history_figures(shield)]
    assert not {"radius", "length", "cloud_mass", "bodies_momentum_z"} & set(names)
    assert {"energies", "bodies_kinetic_energy"} <= set(names)
    assert shield_figures(run) == []
    assert shield_figures(shield._replace(walls=(), probes={})) == []
