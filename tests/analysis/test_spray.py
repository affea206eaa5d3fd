"""The spray: directions by hand, totals by plain sums."""

import numpy as np
import pytest

from mpisph.analysis.spray import measure_spray
from mpisph.diagnostics.cloud import CloudDefinition


def faster_than(velocity, direction=1.0):
    return CloudDefinition(0.0, velocity, 0.99, direction)


def particles(n=3000):
    rng = np.random.default_rng(4)
    return {
        "m": rng.uniform(0.1, 1.0, n),
        "u_r": rng.normal(0.0, 900.0, n),
        "u_z": rng.normal(0.0, 900.0, n),
        "body": rng.integers(0, 3, n),
    }


def one(u_z, u_r, m=2.0):
    arrays = {"m": m, "u_r": u_r, "u_z": u_z}
    return {**{k: np.array([x]) for k, x in arrays.items()}, "body": np.array([0])}


@pytest.mark.parametrize(
    ("u_z", "u_r", "place"),
    [
        (5000.0, 0.0, 0),
        (1000.0, 1000.0 * np.tan(np.radians(4.0)), 1),
        (1000.0, 1000.0 * np.tan(np.radians(46.0)), 15),
        (1000.0, -1000.0 * np.tan(np.radians(46.0)), 15),
        (0.0, 1000.0, 30),
        (-1000.0, 1000.0 * np.tan(np.radians(44.0)), 45),
        (-5000.0, 0.0, 59),
    ],
)
def test_angles_from_the_axis(u_z, u_r, place):
    spray = measure_spray(one(u_z, u_r), faster_than(100.0))
    assert spray.edges[place + 1] - spray.edges[place] == pytest.approx(3.0)
    assert np.flatnonzero(spray.mass[0]).tolist() == [place]
    assert spray.momentum_z[0, place] == pytest.approx(2.0 * u_z)
    assert spray.momentum_r[0, place] == pytest.approx(2.0 * u_r)


def test_angles_count_from_the_way_of_the_impact():
    forward = measure_spray(one(4000.0, 1000.0), faster_than(100.0))
    backward = measure_spray(one(-4000.0, 1000.0), faster_than(100.0, -1.0))
    np.testing.assert_array_equal(backward.mass, forward.mass)
    np.testing.assert_array_equal(backward.momentum_z, -forward.momentum_z)


@pytest.mark.parametrize("bins", [1, 7, 60, 90])
def test_totals_of_each_body_are_those_of_what_moves(bins):
    a = particles()
    spray = measure_spray(a, faster_than(600.0), bins)
    speed = np.sqrt(a["u_r"] ** 2 + a["u_z"] ** 2)
    assert spray.mass.shape == (3, bins)
    assert spray.edges[[0, -1]].tolist() == [0.0, 180.0]
    for body in range(3):
        mine = (speed > 600.0) & (a["body"] == body)
        assert 0 < mine.sum() < (a["body"] == body).sum()
        for sums, x in (
            (spray.mass, a["m"]),
            (spray.momentum_z, a["m"] * a["u_z"]),
            (spray.momentum_r, a["m"] * a["u_r"]),
        ):
            total = x[mine].sum()
            assert sums[body].sum() == pytest.approx(total, rel=1e-12, abs=1e-9)


def test_a_bin_holds_what_moves_between_its_edges():
    a = particles()
    spray = measure_spray(a, faster_than(600.0), 90)
    angle = np.degrees(np.arccos(a["u_z"] / np.hypot(a["u_r"], a["u_z"])))
    fast = np.hypot(a["u_r"], a["u_z"]) > 600.0
    mass, _ = np.histogram(angle[fast], spray.edges, weights=a["m"][fast])
    assert spray.mass.sum(axis=0) == pytest.approx(mass)


def test_a_bodys_row_is_there_though_it_rests():
    arrays = {k: np.concatenate([x, x]) for k, x in one(5000.0, 0.0).items()}
    arrays["body"][1] = 1
    arrays["u_z"][1] = 50.0
    spray = measure_spray(arrays, faster_than(100.0))
    assert spray.mass.sum(axis=1).tolist() == [2.0, 0.0]


def test_nothing_moves():
    assert not measure_spray(one(0.0, 0.0), faster_than(0.0)).mass.any()


def test_no_bins_are_refused():
    with pytest.raises(ValueError, match="bins = 0"):
        measure_spray(particles(), faster_than(100.0), 0)


def test_matter_of_bodies_behind_the_plate_is_left_out():
    a = particles()
    walls = faster_than(600.0)._replace(behind=np.array([np.nan, 0.0, np.nan]))
    spray, of_all = (measure_spray(a, d) for d in (walls, faster_than(600.0)))
    assert not spray.mass[1].any()
    np.testing.assert_array_equal(spray.mass[[0, 2]], of_all.mass[[0, 2]])
