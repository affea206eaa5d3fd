"""Dots: their places and colours, and the limits of these."""

import numpy as np
import pytest
from launch import CASES
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from pictures import dots_by_colour, points_per_mm

from mpisph.case import load_case
from mpisph.figures.dots import (
    Dots,
    Shading,
    dot_sizes,
    draw_bars,
    draw_plain,
    find_shadings,
    halves_text,
    legend_entries,
)
from mpisph.figures.fields import SHOWN_FIELDS, Chosen
from mpisph.figures.style import BODY_COLOURS
from mpisph.figures.view import View, set_limits
from mpisph.io.snapshot import Snapshot

VIEW = View(-10.0, 30.0, 20.0)


@pytest.fixture(scope="module")
def case():
    return broken_case("sphere", "plate")


def broken_case(*names):
    """A case whose bodies of these names can break."""
    alloys = [f"bodies.{name}.material=al-6061-t6" for name in names]
    paper = [] if len(names) == 2 else ["materials.al-lee2003.failure=none"]
    path = CASES / "piekutowski-4-1353.toml"
    return load_case(path, [*alloys, *paper, "scheme.failure=spall"])


@pytest.fixture
def axes():
    axes = Figure(figsize=(7.0, 7.0)).add_axes((0.1, 0.1, 0.7, 0.7))
    set_limits(axes, VIEW)
    return axes


def snapshot(pressure=0.0, n=1000):
    """Particles of two bodies in a row, with pressures from 0; the last is far off."""
    arrays = {
        "id": np.arange(n),
        "body": np.arange(n) % 2,
        "r": np.full(n, 5e-3),
        "z": np.append(np.linspace(0.0, 20e-3, n - 1), 1.0),
        "m": np.full(n, 1e-9),
        "rho": np.full(n, 2800.0),
        "u_r": np.full(n, 3e3),
        "u_z": np.full(n, 4e3),
        "P": np.append(np.linspace(0.0, pressure, n - 1), 1e12),
        "damage": np.linspace(0.0, 1.0, n),
    }
    return Snapshot(0.0, 0, "", arrays, {})


def chosen(*names):
    return [Chosen(SHOWN_FIELDS[name]) for name in names]


def test_limits_hold_98_percent_of_what_all_snapshots_show(case):
    shots = [snapshot(-1e9), snapshot(3e9)]
    (shading,) = find_shadings(chosen("pressure"), shots, VIEW, case)
    assert (shading.low, shading.high) == pytest.approx((-0.98, 2.94), abs=0.01)
    assert shading.extend == "both"
    assert find_shadings(chosen("pressure"), shots[::-1], VIEW, case) == (shading,)


def test_limits_that_are_known_need_no_snapshot(case):
    def none():
        raise AssertionError("not to be read")
        yield

    given = Chosen(SHOWN_FIELDS["speed"], (0.0, 7.0))
    damage, speed, body = find_shadings(
        [*chosen("damage"), given, *chosen("body")], none(), VIEW, case
    )
    assert damage[1:] == (0.0, 1.0, "neither")
    assert speed[1:] == (0.0, 7.0, "both")
    assert not body.has_bar


@pytest.mark.parametrize(
    ("name", "shots", "limits"),
    [
        ("speed", [snapshot()], (4.75, 5.25)),  # all are equally fast
        ("pressure", [snapshot()], (-1.0, 1.0)),
        ("speed", [], (-1.0, 1.0)),
    ],
)
def test_one_value_alone_has_limits_about_it(case, name, shots, limits):
    (shading,) = find_shadings(chosen(name), shots, VIEW, case)
    assert (shading.low, shading.high) == pytest.approx(limits)
    assert shading.extend == "neither"


@pytest.mark.parametrize("limits", [(-1.0, 4.0), (-2.0, 2.0), (0.0, 3.0), (1.0, 3.0)])
def test_the_middle_of_centred_colours_is_zero(limits):
    shading = Shading(SHOWN_FIELDS["pressure"], *limits)
    whole = Shading(SHOWN_FIELDS["pressure"], -4.0, 4.0)
    reach = max(map(abs, limits))
    for x in np.linspace(*limits, 9):
        colour = shading.colour_map(shading.norm(x))
        assert colour == pytest.approx(
            whole.colour_map(whole.norm(4.0 * x / reach)), abs=0.02
        )


def test_one_field_is_mirrored_and_two_are_half_and_half(axes, case):
    shot = snapshot()
    (damage,) = find_shadings(chosen("damage"), [], VIEW, case)
    Dots(axes, case, VIEW, [damage]).show(shot)
    (dots,) = axes.collections
    places = np.asarray(dots.get_offsets())
    assert len(places) == 2 * 999  # the last particle is outside the view
    assert set(places[:, 1]) == {5.0, -5.0}
    assert np.asarray(dots.get_array()) == pytest.approx(
        np.tile(shot.arrays["damage"][:999], 2)
    )
    dots.remove()
    pair = find_shadings(chosen("damage", "speed"), [shot], VIEW, case)
    Dots(axes, case, VIEW, pair).show(shot)
    for half, side, name in zip(axes.collections, (5.0, -5.0), (1, 5), strict=True):
        assert set(np.asarray(half.get_offsets())[:, 1]) == {side}
        assert np.asarray(half.get_array()).max() == pytest.approx(name, abs=0.01)
    assert halves_text(pair) == ["above: damage; below: speed"]


def test_bodies_without_the_model_are_grey_and_do_not_count(axes):
    case, shot = broken_case("sphere"), snapshot(1e9)
    shot.arrays["damage"][:] = np.where(shot.arrays["body"] == 0, 0.5, np.nan)
    shown = SHOWN_FIELDS["damage"].shown(shot.arrays, case)
    assert np.isnan(shown).tolist() == (shot.arrays["body"] == 1).tolist()
    free = SHOWN_FIELDS["damage"]._replace(limits=None)
    (shading,) = find_shadings([Chosen(free)], [shot], VIEW, case)
    assert (shading.low, shading.high) == pytest.approx((0.475, 0.525))
    Dots(axes, case, VIEW, [shading]).show(shot)
    (dots,) = axes.collections
    axes.figure.draw_without_rendering()
    colours = dots.get_facecolors()
    assert len(colours) == 2 * 999
    grey = (colours == to_rgba("0.75")).all(axis=1)
    assert grey.tolist() == 2 * (shot.arrays["body"][:999] == 1).tolist()
    assert axes.get_legend_handles_labels()[1] == ["no model of damage"]
    assert legend_entries(case, [shading]) == 2  # with the rear face


def test_a_half_may_have_names(axes, case):
    pair = find_shadings(chosen("body", "damage"), [], VIEW, case)
    Dots(axes, case, VIEW, pair).show(snapshot())
    filled = dots_by_colour(axes)
    assert tuple(filled) == BODY_COLOURS[:2]
    for shown in filled.values():
        assert set(shown[:, 1]) == {5.0}
    names = axes.get_legend_handles_labels()[1]
    assert names == ["sphere, above", "plate, above"]
    assert legend_entries(case, pair) == 3  # with the rear face


def test_bars_stand_beside_their_halves_with_units(axes, case):
    pair = find_shadings(chosen("damage", "speed"), [snapshot()], VIEW, case)
    draw_bars(axes, pair)
    _, above, below = axes.figure.axes
    assert above.get_ylabel() == "damage"
    assert below.get_ylabel() == "speed [km/s]"
    box = axes.get_position()
    middle = 0.5 * (box.y0 + box.y1)
    assert box.y1 == pytest.approx(above.get_position().y1)
    assert above.get_position().y0 > middle > below.get_position().y1
    assert below.get_position().y0 == pytest.approx(box.y0)
    assert above.get_ylim() == (0.0, 1.0)


def test_dots_of_a_lattice_leave_no_gaps_at_any_resolution(axes):
    for side in (0.5e-3, 0.2e-3, 0.1e-3, 0.05e-3):
        (size,) = dot_sizes(axes, np.array([side**2]), 1000)
        diagonal = 1e3 * side * np.sqrt(2.0) * points_per_mm(axes)
        assert diagonal < size < diagonal + 3.0 * 72.0 / axes.figure.dpi


@pytest.mark.parametrize(("count", "pixels"), [(1, 3.0), (8000, 3.0), (30_000, 2.0)])
def test_what_is_small_or_no_number_is_still_seen(axes, count, pixels):
    sizes = dot_sizes(axes, np.array([0.0, 1e-18, np.nan]), count)
    np.testing.assert_allclose(sizes, pixels * 72.0 / axes.figure.dpi)


SIDE = 0.1e-3
"""Of the cells of a plate [m]."""


def plate(n):
    """n by n particles of a sound plate."""
    ticks = np.arange(n) * SIDE
    z, r = (x.ravel() for x in np.meshgrid(ticks, 3e-3 + ticks))
    arrays = {"id": np.arange(n**2), "body": np.ones(n**2, int), "z": z, "r": r}
    arrays |= {"m": 2.0 * np.pi * r * 2710.0 * SIDE**2, "rho": np.full(n**2, 2710.0)}
    return arrays | {"u_r": z, "u_z": r}


def pixels_of(arrays, case, name, width):
    """Pixels between the outermost particles, so many wide."""
    z, r = (1e3 * arrays[k] for k in "zr")
    high = width * np.ptp(r) / np.ptp(z)
    figure = Figure(figsize=(width / 200.0, high / 200.0), dpi=200)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), frameon=False)
    axes.set_xlim(z.min(), z.max())
    axes.set_ylim(r.min(), r.max())
    view, shading = View(-100.0, 100.0, 100.0), Shading(SHOWN_FIELDS[name])
    Dots(axes, case, view, [shading]).show(Snapshot(0.0, 0, "", arrays, {}))
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].astype(int)


@pytest.mark.parametrize("pitch", [1.15, 1.4, 1.7, 2.3, 7.1, 20.0])
@pytest.mark.parametrize("name", ["body", "speed"])
def test_solid_matter_has_no_gaps_however_wide_a_cell_is(case, name, pitch):
    arrays = plate(60) | {"u_r": np.zeros(3600), "u_z": np.zeros(3600)}
    pixels = pixels_of(arrays, case, name, 59 * pitch)[3:-3, 3:-3]
    assert np.ptp(pixels.reshape(-1, 3), axis=0).max() < 12, "of one colour"
    assert pixels.min() < 100, "and that is not white"


@pytest.mark.parametrize("name", ["body", "speed"])
def test_matter_that_flies_apart_has_little_more_than_its_section(case, name):
    near = plate(40)
    r = 3e-3 + 4.0 * (near["r"] - 3e-3)
    thin = {"z": 5.0 * near["z"], "r": r, "rho": 2710.0 * near["r"] / (20.0 * r)}
    section = (near["m"] / (2.0 * np.pi * r * 2710.0)).sum()
    share = section / (np.ptp(thin["z"]) * np.ptp(r))
    assert share < 0.03
    inked = (pixels_of(near | thin, case, name, 1400) < 250).any(axis=2).mean()
    assert share < inked < 3.5 * share


def test_the_smaller_dots_lie_upon_the_larger_whatever_was_shown_before(axes, case):
    shot = snapshot(n=100)
    shot.arrays["r"][:-1] = np.linspace(1e-3, 19e-3, 99)
    dots = Dots(axes, case, VIEW)
    for mass, least in ((1e-6, 5), (1e-10, 1), (1e-5, 5)):
        shot.arrays["m"][:] = mass
        dots.show(shot)
        lines = [x for x in axes.lines if x.get_rasterized() and len(x.get_xdata())]
        plate = [x for x in lines if x.get_color() == BODY_COLOURS[1]]
        sphere = [x for x in lines if x.get_color() == BODY_COLOURS[0]]
        drawn = sorted(plate, key=lambda line: line.get_zorder())
        sizes = [line.get_markersize() for line in drawn]
        assert sizes == sorted(sizes, reverse=True)
        assert len(sizes) >= least
        top = max(line.get_zorder() for line in sphere)
        assert top < drawn[0].get_zorder()
        assert drawn[-1].get_zorder() < 3.0
        assert sum(len(line.get_xdata()) for line in lines) == 2 * 99


def test_plain_dots_are_below_and_named(axes, case):
    draw_plain(axes, snapshot(n=11), case, VIEW, "0.82", "the rest")
    (shown,) = dots_by_colour(axes).values()
    assert sorted(shown[:, 1]) == 10 * [-5.0] + 10 * [5.0]
    assert max(x.get_zorder() for x in axes.lines if x.get_rasterized()) < 2.0
    assert axes.get_legend_handles_labels()[1] == ["the rest"]
