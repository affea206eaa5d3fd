"""When the cloud reaches the wall, and which moments are shown."""

import numpy as np
import pytest
from shields import SHIELD, shield_case

from mpisph.analysis.shield_history import (
    ARRIVED,
    cloud_moments,
    wall_arrival,
    wall_moments,
)
from mpisph.io.probe_files import BODIES_FILE, probe_headers
from mpisph.io.verdict import WallRecord


@pytest.fixture(scope="module")
def case():
    return shield_case(time={"end": "12 us"})


def bodies(case, wall):
    """Rows at 0, 1, 2 ... us where the wall has shares of the projectile's momentum."""
    names = probe_headers(case)[BODIES_FILE]
    rows = np.zeros(len(wall), [(name, "f8") for name in names])
    rows["time_s"] = 1e-6 * np.arange(len(wall))
    rows["momentum_z_projectile_kg_m_per_s"] = 0.3
    rows["momentum_z_wall_kg_m_per_s"] = 0.3 * np.array(wall)
    return rows


def record(time, velocity):
    figures = dict.fromkeys(WallRecord.model_fields, 0.0)
    return WallRecord(**{**figures, "time": time, "velocity": velocity})


def words(moments):
    return [(moment.number, moment.words) for moment in moments]


def test_the_cloud_arrives_where_the_wall_gains_momentum(case):
    rows = bodies(case, [0.0, -0.5, 0.5 * ARRIVED, 2.0 * ARRIVED, 0.8])
    assert wall_arrival(case, rows) == pytest.approx(3e-6)
    assert wall_arrival(case, rows[:3]) is None
    assert wall_arrival(case, rows[:0]) is None


def test_cuts_are_shown_at_four_times(case):
    times = [1e-6 * time for time in range(13)]
    # Through 3.2 and 0.8 mm at 6.5 km/s twice: 1.2 us.
    assert words(cloud_moments(case, times, 8.5e-6)) == [
        (2, "behind the bumper"),
        (5, "halfway to the wall"),
        (9, "at the wall"),
        (12, "at the end"),
    ]


def test_a_cloud_on_its_way_has_no_arrival(case):
    times = [0.0, 3e-6, 6e-6]
    shown = words(cloud_moments(case, times, None))
    assert shown == [(1, "behind the bumper"), (2, "at the end")]
    assert words(cloud_moments(case, [0.0], None)) == [(0, "at the end")]


def test_of_several_bumpers_the_first_makes_the_cloud():
    shield = {**SHIELD["shield"], "bumpers": 2 * SHIELD["shield"]["bumpers"]}
    case = shield_case(shield=shield)
    first = cloud_moments(case, [0.0, 3e-6, 6e-6], None)[0]
    assert first.words == "behind the first bumper"


def test_the_wall_is_shown_where_it_moves_fastest_and_at_both_verdicts(case):
    times = [0.0, 3e-6, 6e-6, 9e-6, case.verdict_time, 12e-6]
    walls = [record(*pair) for pair in zip(times, [0, 1, 7, 3, 2, 1], strict=True)]
    shown = words(wall_moments(case, walls))
    assert shown == [(2, "loading"), (4, "earlier verdict"), (5, "end")]
    assert words(wall_moments(case, walls[:1])) == [(0, "end")]
