"""Measures of a wall, on walls whose measures are known."""

import numpy as np
import pytest
from shields import shield_case, wall_particles

from mpisph.analysis.wall import ligament, measure_wall, wall_layout
from mpisph.case.discretise import discretise


@pytest.fixture(scope="module")
def layout():
    return wall_layout(shield_case())


def measured(layout, *args, **kwargs):
    return measure_wall(layout, wall_particles(layout, *args, **kwargs), 1e-6)


def test_layout_is_that_of_the_particles():
    case = shield_case()
    layout = wall_layout(case)
    particles = discretise(case)
    mine = particles.body == 2
    shape = layout.z.size, layout.r.size
    assert particles.id[mine][0] == layout.first_id
    assert mine.sum() == shape[0] * shape[1]
    assert np.array_equal(particles.r[mine].reshape(shape)[3], layout.r)
    assert np.array_equal(particles.z[mine].reshape(shape)[:, 5], layout.z)
    assert layout.thickness == pytest.approx(3.18e-3)


def test_an_untouched_wall(layout):
    wall = measured(layout)
    for name in ("shear", "hole", "detached", "velocity", "detached_momentum"):
        assert getattr(wall, name) == 0.0, name
    for name in ("bulge", "crater_depth", "crater_diameter"):
        assert getattr(wall, name) == pytest.approx(0.0, abs=1e-12), name
    assert (wall.ligament, wall.sound_share) == (1.0, 1.0)


def test_tilt_is_that_of_a_cone_and_bulge_its_height(layout):
    slope, foot = 0.1, 12e-3
    wall = measured(layout, np.maximum(slope * (foot - layout.r), 0.0))
    # Over one thickness a slope of .1 rises by .1 thicknesses.
    assert wall.shear == pytest.approx(0.1, rel=1e-6)
    assert wall.bulge == pytest.approx(slope * (foot - layout.r[0]), rel=1e-6)
    assert wall.hole == 0.0


def test_a_short_step_counts_over_a_thickness(layout):
    height = 0.3e-3
    wall = measured(layout, np.where(layout.r < 8e-3, height, 0.0))
    assert wall.shear == pytest.approx(height / layout.thickness, rel=1e-6)


def test_broken_columns_around_the_axis_are_a_hole(layout):
    damage = np.zeros((layout.z.size, layout.r.size))
    inner = layout.r < 4e-3
    damage[:, inner] = 1.0
    wall = measured(layout, damage=damage)
    assert wall.hole == pytest.approx(2 * layout.r[~inner][0])
    assert wall.sound_share == 0.0
    assert wall.ligament == 0.0


def test_one_sound_row_closes_the_hole(layout):
    rows = layout.z.size
    damage = np.zeros((rows, layout.r.size))
    damage[:, layout.r < 4e-3] = 1.0
    damage[rows // 2] = 0.0
    wall = measured(layout, damage=damage)
    assert wall.hole == 0.0
    assert wall.sound_share == pytest.approx(1 / rows)


def test_a_scab_behind_a_crack_is_no_part_of_the_wall(layout):
    rows, columns = layout.z.size, layout.r.size
    damage = np.zeros((rows, columns))
    damage[rows - 5 : rows - 2, layout.r < 5e-3] = 1.0  # a plane,
    edge = np.flatnonzero(layout.r < 5e-3)[-1]
    damage[rows - 5 :, edge - 2 : edge + 1] = 1.0  # and its edge
    particles = wall_particles(layout, damage=damage)
    row = (particles["id"] - layout.first_id) // columns
    column = (particles["id"] - layout.first_id) % columns
    scab = (row >= rows - 2) & (column < edge - 2)
    particles["z"][scab] += 2e-3
    particles["u_z"][scab] = 150.0
    wall = measure_wall(layout, particles, 1e-6)
    assert wall.hole == 0.0
    assert wall.detached == pytest.approx(particles["m"][scab].sum())
    assert wall.detached_velocity == pytest.approx(150.0)
    assert wall.detached_momentum == pytest.approx(150.0 * wall.detached)
    assert wall.ligament == pytest.approx((rows - 5) / rows)
    assert wall.bulge == 0.0  # of what holds


def test_what_flies_past_the_rim_has_not_come_through(layout):
    rim, behind = layout.r[-1], layout.rear + 5e-3
    through = measured(layout, extra=[(1e-6, 2e-3, behind, 900.0)])
    assert through.detached == 1e-6
    past = measured(layout, extra=[(1e-6, 1.1 * rim, behind, 900.0)])
    assert past.detached == 0.0


def test_crater_is_what_is_missing_in_front(layout):
    rows = layout.z.size
    damage = np.zeros((rows, layout.r.size))
    width = layout.thickness / rows
    damage[:4, layout.r < 5e-3] = 1.0
    outside = layout.r[layout.r >= 5e-3][0]
    # A wall that bulges takes its crater along.
    for bulge in (0.0, 1e-3):
        moved = np.full(layout.r.size, bulge)
        wall = measured(layout, moved, damage=damage)
        assert wall.crater_depth == pytest.approx(4 * width)
        assert wall.crater_diameter == pytest.approx(2 * outside)


def test_ligament_follows_an_oblique_crack():
    sound = np.ones((4, 9))
    for k in range(4):
        sound[k, 2 + k] = 0.0
    assert ligament(sound) == 0.0
    sound[2, 4] = 0.6
    assert ligament(sound) == pytest.approx(0.15)


def test_ligament_is_the_least_over_all_ways():
    rng = np.random.default_rng(4)
    sound = rng.random((4, 5))
    ways = [[k] for k in range(5)]
    for _ in range(3):
        ways = [[*w, w[-1] + s] for w in ways for s in (-1, 0, 1)]
        ways = [w for w in ways if 0 <= w[-1] < 5]
    least = min(sum(sound[i, c] for i, c in enumerate(w)) for w in ways)
    assert ligament(sound) == pytest.approx(least / 4)


def test_what_has_no_number_is_lost(layout):
    particles = wall_particles(layout)
    first = np.flatnonzero(particles["id"] == layout.first_id)
    particles["z"][first] = np.nan
    particles["u_z"][first] = np.inf
    wall = measure_wall(layout, particles, 1e-6)
    rows = layout.z.size
    assert wall.sound_share == pytest.approx(1.0 - 1.0 / rows)
    assert (wall.hole, wall.velocity, wall.detached) == (0.0, 0.0, 0.0)
