"""Dots: their places and colours, and the limits of these."""

import numpy as np
import pytest
from launch import CASES
from matplotlib.colors import to_rgb, to_rgba
from matplotlib.figure import Figure

from mpisph.case import load_case
from mpisph.figures.dots import (
    Dots,
    Shading,
    draw_bars,
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
    filled = [line for line in axes.lines if line.get_marker() == "o"]
    filled = [line for line in filled if len(line.get_xdata())]
    for line, colour in zip(filled, BODY_COLOURS, strict=False):
        assert set(line.get_ydata()) == {5.0}
        assert to_rgb(line.get_color()) == to_rgb(colour)
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
