"""Bodies that start with a radial velocity, a density or an energy of their own."""

import math

import numpy as np
import pytest
from launch import CASES, MPISPH, launch

from mpisph.case import case_from_dict, load_case
from mpisph.case.discretise import discretise
from mpisph.case.identity import case_key, differences
from mpisph.case.initial import complete_particles
from mpisph.case.plausibility import find_warnings
from mpisph.core.errors import CaseError
from mpisph.report.page import NONE
from mpisph.report.run_tables import bodies_table

GAS = {"rho0": 2.0, "strength": "none", "eos": "ideal-gas"}
GAS |= {"ideal-gas": {"gamma": 1.4, "c0": 1.0}}

SPHERE = """
title = "t"
resolution.spacing = 0.1
time.end = 1.0
[materials.gas]
rho0 = 1.0
eos = "ideal-gas"
strength = "none"
ideal-gas = { gamma = 1.4, c0 = 1.0 }
[[bodies]]
name = "ball"
shape = "sphere"
radius = 1.0
material = "gas"
energy = "1/(z - 0.65)**2"
"""


def ball(**changes):
    body = {"shape": "sphere", "name": "ball", "radius": 1.0, "position": 3.0}
    return {**body, "material": "gas", **changes}


def tube(**changes):
    body = {"shape": "cylinder", "name": "tube", "radius": 1.0, "length": 2.0}
    return {**body, "material": "gas", "position": -4.0, **changes}


def make(*bodies, **sections):
    return case_from_dict(
        {
            "title": "t",
            "bodies": list(bodies),
            "materials": {"gas": GAS},
            "resolution": {"spacing": 0.1},
            "time": {"end": 1.0},
            **sections,
        }
    )


def test_a_sphere_moves_away_from_its_centre_and_along_z():
    p = discretise(make(ball(radial_velocity="-3*s**2", velocity=7.0)))
    s = np.hypot(p.r, p.z - 3.0)
    np.testing.assert_allclose(p.u_r, -3 * s * p.r, rtol=1e-14)
    np.testing.assert_allclose(p.u_z, 7.0 - 3 * s * (p.z - 3.0), rtol=1e-13)
    assert p.E is None


def test_a_cylinder_moves_away_from_the_axis():
    p = discretise(make(tube(radial_velocity="2 m/s"), ball(velocity="1 m/s")))
    np.testing.assert_array_equal(p.u_r, np.where(p.body == 0, 2.0, 0.0))
    np.testing.assert_array_equal(p.u_z, np.where(p.body == 0, 0.0, 1.0))


def test_s_counts_from_the_middle_of_each_body():
    p = discretise(make(tube(energy="s"), ball(energy="s")))
    middle = np.where(p.body == 0, -3.0, 3.0)
    np.testing.assert_allclose(p.E, np.hypot(p.r, p.z - middle), rtol=1e-15)


def test_r_and_z_are_those_of_the_case():
    p = discretise(make(tube(energy="r - 9*z", radial_velocity=0.0)))
    np.testing.assert_array_equal(p.E, p.r - 9 * p.z)
    assert p.u_r is None


def test_the_mass_follows_the_density():
    plain = discretise(make(tube()))
    dense = discretise(make(tube(density="where(z < -3, 8, 1)")))
    np.testing.assert_array_equal(plain.rho, 2.0)
    np.testing.assert_array_equal(dense.rho, np.where(plain.z < -3, 8.0, 1.0))
    np.testing.assert_allclose(dense.m, plain.m * dense.rho / 2.0, rtol=1e-15)
    assert dense.m.sum() == pytest.approx(math.pi * (8.0 + 1.0), rel=1e-14)
    np.testing.assert_array_equal(dense.h, plain.h)


def test_a_share_has_the_same_bits():
    bodies = tube(energy="exp(-s)"), ball(radial_velocity="sin(r) + 1", density="1+s")
    case = make(*bodies)
    everything = discretise(case).fields()
    assert {"u_r", "E"} <= everything.keys()
    for first, end in [(0, 1), (180, 230), (7, 7)]:
        for name, values in discretise(case, first, end).fields().items():
            assert values.tobytes() == everything[name][first:end].tobytes()


@pytest.mark.parametrize(
    ("key", "text", "words"),
    [
        (
            "energy",
            "1/(z + 3.95)**2",
            "it is inf; expected 0 to 1e+15 J/kg",
        ),
        ("energy", "sqrt(z + 3)", "r = 0.059356 m, z = -3.95 m it is no number"),
        ("energy", "9**9**9*r", "it is inf"),
        ("energy", "-r", "it is -0.059356; expected 0 to 1e+15 J/kg"),
        ("density", "0*r", "it is 0; expected 0.001 to 1e+06 kg/m^3"),
        ("radial_velocity", "r*1e7", "expected -1e+06 to 1e+06 m/s"),
    ],
)
def test_a_place_without_a_sound_value_is_told(key, text, words):
    with pytest.raises(CaseError) as caught:
        discretise(make(tube(**{key: text})))
    (problem,) = caught.value.problems
    assert problem.key == f"bodies.tube.{key}"
    assert problem.value == f'"{text}"'
    assert words in problem.expected


def test_a_case_with_expressions_is_written_and_known_again(tmp_path):
    case = make(tube(energy="2*r", density="1 g/cm3", radial_velocity="r"))
    (tmp_path / "case.toml").write_text(case.to_toml())
    again = load_case(tmp_path / "case.toml")
    assert again == case
    assert case_key(again) == case_key(case)
    other = load_case(tmp_path / "case.toml", ["bodies.tube.energy=3*r"])
    assert differences(case, other) == ["bodies.0.energy: 2*r, now 3*r"]
    assert case_key(other) != case_key(case)


def test_a_mistake_is_told_with_its_line(tmp_path):
    (tmp_path / "case.toml").write_text(SPHERE.replace("(z", "(q"))
    with pytest.raises(CaseError) as caught:
        load_case(tmp_path / "case.toml")
    (problem,) = caught.value.problems
    place = 'case.toml:15: bodies.0.energy = "1/(q - 0.65)**2": no name q'
    assert f"{place} at character 4" in str(problem)


def test_own_particles_take_what_is_not_given_from_their_body():
    case = make(tube(energy="r", radial_velocity=2.0), ball(density=5.0, velocity=1.0))
    places = {"r": [0.5, 0.25], "z": [-3.0, 3.0], "m": [1.0, 1.0], "body": [0, 1]}
    p = complete_particles(case, places, "particles")
    assert p.E.tolist() == [0.5, 0.0]
    assert p.u_r.tolist() == [2.0, 0.0]
    assert p.u_z.tolist() == [0.0, 1.0]
    assert p.rho.tolist() == [2.0, 5.0]
    given = complete_particles(case, {**places, "E": [7.0, 7.0]}, "particles")
    assert given.E.tolist() == [7.0, 7.0]
    with pytest.raises(CaseError, match=r"z: expected a finite number"):
        complete_particles(case, {**places, "z": [math.nan, 3.0]}, "particles")


@pytest.mark.parametrize(
    ("changes", "keys"),
    [
        ({"radial_velocity": "-0.3*s"}, []),
        ({"energy": "1 MJ/kg"}, []),
        ({"energy": 1.0, "eos": "linear"}, ["bodies.shell.energy"]),
        ({"density": 2700.0}, []),
        ({"density": "2.7 kg/m3"}, ["bodies.shell.density"]),
        ({}, ["bodies"]),
    ],
)
def test_a_body_that_moves_by_itself_needs_none_to_hit(changes, keys):
    shell = {"shape": "spherical_shell", "name": "shell", "material": "al-6061-t6"}
    shell |= {"outer_radius": 1.0, "inner_radius": 0.5, **changes}
    texts = find_warnings(make(shell))
    assert [text.partition(":")[0] for text in texts] == keys


def test_the_table_of_bodies_shows_what_they_start_with():
    plain = bodies_table(load_case(CASES / "plate-impact.toml"))
    table = bodies_table(make(tube(energy="2*r", density=3.0), ball()))
    assert len(plain.columns) == 5
    assert table.columns[5:] == ("density [kg/m^3]", "energy [J/kg]")
    assert [row[5:] for row in table.rows] == [("3", "2*r"), (NONE, "0")]


@pytest.mark.parametrize("options", [("--dry-run",), ()])
def test_every_rank_ends_where_one_meets_no_number(options, tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(SPHERE)
    folder = tmp_path / "run"
    done = launch(2, MPISPH, "run", path, "-o", folder, *options)
    assert done.returncode == 2, done.stderr
    assert "z = 0.65 m it is inf" in done.stderr
    assert done.stderr.count("bodies.ball.energy") == 1
    assert not (folder / "status.json").exists()
