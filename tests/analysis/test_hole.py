"""The hole: plates with holes of known size, strays, gaps and lips; and the fits."""

import numpy as np
import pytest
from launch import CASES

from mpisph.analysis.hole import maiden_diameter, measure_hole, nysmith_diameter
from mpisph.case import load_case
from mpisph.case.discretise import discretise
from mpisph.diagnostics.cloud import cloud_definition, target_plate


@pytest.fixture(scope="module")
def case():
    return load_case(CASES / "piekutowski-4-1353.toml")


def initial(case):
    start = discretise(case)
    arrays = {name: np.array(getattr(start, name)) for name in ("m", "r", "z", "rho")}
    return {**arrays, "u_z": start.u_z.copy(), "body": start.body.copy()}


def holed(case, radius):
    """The case's plate with all within a radius thrown far ahead."""
    arrays = initial(case)
    gone = (arrays["body"] == 1) & (arrays["r"] < radius)
    arrays["u_z"][gone] = 3000.0
    arrays["z"][gone] += 20e-3
    return arrays


@pytest.mark.parametrize("shot", ["1283", "1291", "1352", "1353"])
def test_a_whole_plate_has_no_hole(shot):
    case = load_case(CASES / f"piekutowski-4-{shot}.toml")
    hole = measure_hole(initial(case), case)
    assert hole.diameter == pytest.approx(0.0, abs=0.1 * case.spacing)
    assert hole.opening == pytest.approx(0.0, abs=0.1 * case.spacing)
    assert hole.grain == case.spacing


@pytest.mark.parametrize("radius", [3e-3, 9.1e-3, 20.4e-3])
def test_the_hole_that_was_cut_is_found(case, radius):
    hole = measure_hole(holed(case, radius), case)
    assert hole.diameter == pytest.approx(2 * radius, abs=hole.grain)
    assert hole.opening == pytest.approx(2 * radius, abs=hole.grain)


def test_what_flies_through_the_hole_is_no_plate(case):
    arrays = holed(case, 9e-3)
    arrays["z"][arrays["u_z"] == 3000.0] -= 20e-3
    assert measure_hole(arrays, case).diameter == pytest.approx(18e-3, abs=case.spacing)
    arrays["u_z"][arrays["u_z"] == 3000.0] = -3000.0
    assert measure_hole(arrays, case).diameter == pytest.approx(18e-3, abs=case.spacing)


def test_slow_strays_in_the_hole_do_not_set_it(case):
    arrays = holed(case, 9e-3)
    clean = measure_hole(arrays, case)
    stray = np.flatnonzero(arrays["u_z"] == 3000.0)[::40]
    assert len(stray) > 2
    arrays["u_z"][stray] = 0.0
    arrays["z"][stray] -= 20e-3
    assert measure_hole(arrays, case) == clean


def test_a_gap_in_the_plate_does_not_set_it(case):
    arrays = holed(case, 9e-3)
    clean = measure_hole(arrays, case)
    arrays["z"][(arrays["body"] == 1) & (abs(arrays["r"] - 12e-3) < 0.3e-3)] = 1.0
    assert measure_hole(arrays, case) == clean


def test_the_sphere_is_no_plate(case):
    arrays = holed(case, 9e-3)
    arrays["z"][arrays["body"] == 0] = 2e-3
    arrays["r"][arrays["body"] == 0] += 5e-3
    arrays["u_z"][arrays["body"] == 0] = 0.0
    assert measure_hole(arrays, case).diameter == pytest.approx(18e-3, abs=case.spacing)


def test_half_of_the_mass_makes_the_edge(case):
    """Of the rows near the edge, some are gone: more than half, or less."""
    plate = target_plate(case)
    for share, edge in ((0.3, 9e-3), (0.7, 12e-3)):
        arrays = holed(case, 9e-3)
        mine = (arrays["body"] == 1) & (arrays["r"] < 12e-3) & (arrays["r"] > 9e-3)
        low = mine & (arrays["z"] < plate.position + share * plate.thickness)
        arrays["u_z"][low] = -2000.0
        found = measure_hole(arrays, case).diameter
        assert found == pytest.approx(2 * edge, abs=case.spacing)


def test_mass_counts_and_not_width(case):
    """A disc of 4 mm left in a hole of 7 mm is less than the mass that is gone."""
    arrays = holed(case, 7e-3)
    disc = (arrays["u_z"] == 3000.0) & (arrays["r"] < 4e-3)
    arrays["u_z"][disc] = 0.0
    arrays["z"][disc] -= 20e-3
    assert measure_hole(arrays, case).diameter == pytest.approx(14e-3, abs=case.spacing)


def test_a_lip_outside_of_the_plate_narrows_the_opening_alone(case):
    arrays = holed(case, 12e-3)
    lip = (arrays["body"] == 1) & (arrays["r"] < 12e-3) & (arrays["r"] > 9e-3)
    arrays["z"][lip] -= 15e-3  # 5 mm behind the plate
    arrays["u_z"][lip] = 300.0
    hole = measure_hole(arrays, case)
    assert hole.diameter == pytest.approx(24e-3, abs=case.spacing)
    assert hole.opening == pytest.approx(18e-3, abs=case.spacing)


def test_debris_is_what_is_faster_than_the_cloud_at_least(case):
    limit = cloud_definition(case).min_velocity
    arrays = initial(case)
    arrays["u_z"][(arrays["body"] == 1) & (arrays["r"] < 9e-3)] = 0.99 * limit
    assert measure_hole(arrays, case).opening == 0.0
    arrays["u_z"][(arrays["body"] == 1) & (arrays["r"] < 9e-3)] = 1.01 * limit
    assert measure_hole(arrays, case).opening == pytest.approx(18e-3, abs=case.spacing)


def test_without_a_plate_at_rest_there_is_no_figure(case, tmp_path):
    arrays = initial(case)
    text = (CASES / "piekutowski-4-1353.toml").read_text()
    rod = text.replace('shape = "plate"', 'shape = "cylinder"')
    rod = rod.replace("thickness", "length").split("[measured]")[0]
    (tmp_path / "rod.toml").write_text(rod)
    hole = measure_hole(arrays, load_case(tmp_path / "rod.toml"))
    assert np.isnan(hole.diameter)
    assert np.isnan(hole.opening)
    moving = load_case(
        CASES / "piekutowski-4-1353.toml", ["bodies.plate.velocity=-1 km/s"]
    )
    assert np.isnan(measure_hole(arrays, moving).diameter)


def test_maidens_fit_by_hand():
    # t/d = 1/8 to the power 2/3 is 1/4; V/c = 2.
    assert maiden_diameter(8e-3, 1e-3, 10e3, 5e3) == pytest.approx(8e-3 * (1.2 + 0.9))
    assert maiden_diameter(8e-3, 8e-3, 5e3, 5e3) == pytest.approx(8e-3 * 3.3)


def test_nysmiths_fit_by_hand():
    # V = 4 km/s; t/d to the power 0.45 is 1/2 at 2^(-20/9).
    t = 2 ** (-20 / 9) * 6e-3
    assert nysmith_diameter(6e-3, t, 4e3) == pytest.approx(6e-3 * (0.88 + 1.0))
    assert nysmith_diameter(6e-3, 6e-3, 4e3) == pytest.approx(6e-3 * 2.76)


def test_a_plate_of_which_nothing_is_left_has_no_hole(case):
    arrays = initial(case)
    arrays["z"] += 1.0
    hole = measure_hole(arrays, case)
    assert np.isnan(hole.diameter)
    assert hole.opening == pytest.approx(0.0, abs=0.1 * case.spacing)
