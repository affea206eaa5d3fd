"""What is accepted but hardly meant: warnings, each with its key and what to do."""

import math
import tomllib

import pytest
from launch import CASES

from mpisph.case import case_from_dict, load_case
from mpisph.case.contact import first_contact, meeting_time, time_origin
from mpisph.case.plausibility import find_warnings
from mpisph.case.sections import Boundary

SHOT = CASES / "piekutowski-4-1353.toml"


def body(shape="plate", **settings):
    sizes = {
        "plate": {"thickness": 2e-3, "radius": 20e-3},
        "sphere": {"radius": 5e-3},
        "cylinder": {"length": 10e-3, "radius": 5e-3},
        "spherical_shell": {"outer_radius": 20e-3, "inner_radius": 15e-3},
    }
    common = {"name": shape.replace("_", "-"), "material": "al-6061-t6"}
    return {**common, "shape": shape, **sizes[shape], **settings}


def case_of(*bodies, end=10e-6, **sections):
    return case_from_dict(
        {
            "title": "t",
            "bodies": list(bodies),
            "resolution": {"spacing": 0.25e-3},
            "time": {"end": end},
            **sections,
        }
    )


def keys(case):
    return [text.partition(":")[0].partition(",")[0] for text in find_warnings(case)]


@pytest.mark.parametrize(
    "name", ["piekutowski-4-1291", "piekutowski-4-1352", "piekutowski-4-1353"]
)
def test_shots_have_none(name):
    assert find_warnings(load_case(CASES / f"{name}.toml")) == []


@pytest.mark.parametrize(
    ("overrides", "key", "words"),
    [
        (["bodies.sphere.velocity=-6.68 km/s"], "bodies.*.velocity", "signs"),
        (["bodies.sphere.velocity=0"], "bodies.*.velocity", "no two bodies ever meet"),
        (["bodies.sphere.position=-500 mm"], "time.end", "meet at 74.1"),
        (["bodies.sphere.position=-14.765 mm"], "bodies.*.position", "1.497 us only"),
        (["bodies.sphere.velocity=6.68 km/h"], "bodies.*.velocity", "1.856 m/s"),
        (["bodies.sphere.velocity=66.8 km/s"], "bodies.*.velocity", "6.68e+04 m/s"),
        (["bodies.plate.thickness=0.5 mm"], "bodies.plate", "resolution.npr = 29"),
        (["bodies.sphere.velocity=2 km/s"], "scheme.p_min", "such as"),
        (["resolution.npr=3"], "resolution.npr", "resolve no shock"),
        (["resolution.nph=0.7"], "resolution.nph", "take 0.8 or more"),
        (["scheme.viscosity.alpha=0.5"], "scheme.viscosity.alpha", "take 1 or more"),
        (["scheme.viscosity.alpha=0.1"], "time.cfl", "take 0.2 or less"),
    ],
)
def test_each_warning_names_its_key_and_what_to_do(overrides, key, words):
    texts = find_warnings(load_case(SHOT, overrides))
    found = [text for text in texts if text.startswith(key) and words in text]
    assert len(found) == 1, texts


FOAM = {"strength": "elastic-plastic", "p_min": {"value": 0.0}}


@pytest.mark.parametrize(
    "settings",
    [
        {"p_min": {"mode": "off"}, "ductile": "none"},
        {"p_min": {"value": -1.2e9}},
        {"strength": "none", "ductile": "none"},
    ],
)
def test_foam_needs_strength_and_a_limit_of_zero(settings):
    bodies = body("cylinder", velocity=200.0, position=-10e-3), body()
    assert keys(case_of(*bodies, scheme=FOAM)) == ["scheme.p_min"]
    assert keys(case_of(*bodies, scheme=FOAM | settings)) == []
    assert keys(case_of(*bodies)) == []


SLOW = (
    body("sphere", position=-5e-3, velocity=2e3),
    body(material="steel-304", thickness=10e-3),
)


@pytest.mark.parametrize(
    "advice",
    [
        {"minimum-pressure": {"value": "-1.2 GPa"}},
        {"minimum-pressure": {"mode": "off"}},
        {"failure": "spall", "spall": {"strength": "2 GPa"}},
    ],
)
def test_foam_of_one_card_is_cured_where_the_others_stay(advice):
    (warning,) = find_warnings(case_of(*SLOW))
    assert warning.startswith("materials.steel-304.minimum-pressure: ")
    case = case_of(*SLOW, materials={"steel-304": advice})
    assert find_warnings(case) == []
    assert case.material_table[0].names["failure"] == "spall"


def test_what_fractures_is_not_advised_to_bear_any_tension():
    sphere, plate = SLOW
    hard = plate | {"material": "steel-4340"}
    (warning,) = find_warnings(case_of(sphere, hard))
    assert 'mode = "off"' not in warning
    own = {"steel-4340": {"minimum-pressure": {"mode": "off"}}}
    (warning,) = find_warnings(case_of(sphere, hard, materials=own))
    assert warning.startswith("materials.steel-4340.failure: ")
    own["steel-4340"] = {"minimum-pressure": {"value": "-inf"}}
    assert find_warnings(case_of(sphere, hard, materials=own)) != []


def test_foam_of_a_table_of_ones_own_is_cured_there():
    own = {"steel-304": {"minimum-pressure": {"value": 0.0}}}
    case = case_of(*SLOW, scheme={"failure": "minimum-pressure"}, materials=own)
    found = [text.partition(":")[0] for text in find_warnings(case)]
    assert found == [
        "scheme.p_min, for al-6061-t6",
        "materials.steel-304.minimum-pressure",
    ]


CHOSEN = {"failure": "spall", "spall": {"strength": "2 GPa"}}


@pytest.mark.parametrize(
    ("scheme", "warned"),
    [
        ({"strength": "johnson-cook"}, ["scheme.strength"]),
        ({"strength": "none"}, ["scheme.strength"]),
        ({"strength": "elastic-plastic"}, []),  # the default
        ({"strength": "steinberg-guinan"}, []),  # as they have it
        ({"failure": "grady-kipp"}, ["scheme.failure"]),
        ({"p_min": {"value": "-1 GPa"}}, ["scheme.p_min"]),
        ({"p_min": {"value": 0.0}}, []),
        ({"eos": "tillotson"}, ["scheme.eos"]),
    ],
)
def test_a_scheme_that_no_material_takes_is_told(scheme, warned):
    names = {"eos": "mie-grueneisen", "strength": "steinberg-guinan"}
    own = {name: CHOSEN | names for name in ("al-6061-t6", "steel-304")}
    case = case_of(*SLOW, scheme=scheme, materials=own)
    assert keys(case) == warned
    again = case_from_dict(tomllib.loads(case.to_toml()))
    assert keys(again) == warned


def test_a_scheme_that_one_material_takes_is_not_told():
    case = case_of(*SLOW, materials={"steel-304": CHOSEN})
    again = case_from_dict(tomllib.loads(case.to_toml()))
    assert keys(case) == keys(again) == []


def test_a_wall_that_nothing_reaches_in_time_is_named():
    """What the sphere makes of the bumper may spread and reach a ring around."""
    bumper, wall = body(name="bumper"), body(name="wall", position=60e-3)
    sphere = body("sphere", velocity=6e3, position=-5e-3)
    (text,) = find_warnings(case_of(sphere, bumper, wall, end=5e-6))
    assert text.startswith("bodies.wall: nothing reaches wall before 10 us")
    assert find_warnings(case_of(sphere, bumper, wall, end=12e-6)) == []
    ring = {**wall, "inner_radius": 10e-3}
    assert find_warnings(case_of(sphere, bumper, ring, end=12e-6)) == []


def test_one_body_alone_hits_nothing():
    assert keys(case_of(body("sphere", velocity=5e3))) == ["bodies"]


@pytest.mark.parametrize("velocity", [0.0, 1.0, 1e5])
@pytest.mark.parametrize("bodies", [1, 2])
def test_a_gas_of_any_density_and_speed_has_none(velocity, bodies):
    """Not even where c is 1 m/s: a gas moves by itself, and problems have no units."""
    gas = {"rho0": 1.0, "strength": "none", "ideal-gas": {"gamma": 5 / 3, "c0": 1.0}}
    tubes = [
        body("cylinder", name=f"b{k}", material="gas", position=k * 10e-3, energy=1.0)
        for k in range(bodies)
    ]
    tubes[-1]["velocity"] = -velocity
    case = case_of(*tubes, materials={"gas": gas}, scheme={"eos": "ideal-gas"})
    assert find_warnings(case) == []
    solid = {**gas, "eos": "linear", "linear": {"bulk_modulus": 1.0}}
    assert find_warnings(case_of(*tubes, materials={"gas": solid})) != []


GAS = {"rho0": 1.2, "strength": "none", "ideal-gas": {"gamma": 1.4, "c0": 340.0}}


@pytest.mark.parametrize(
    ("settings", "warned"),
    [
        ({"energy": 2e5}, []),
        ({}, ["bodies.cylinder.energy"]),
        ({"velocity": 1.0}, []),  # Noh's problem
        ({"radial_velocity": "-s"}, []),
        ({"energy": 2e5, "density": 1200.0}, ["bodies.cylinder.density"]),
        ({"energy": 2e5, "density": "1200 * (1 + r)"}, ["bodies.cylinder.density"]),
        ({"energy": 2e5, "density": "1 / (z - z)"}, []),  # refused with its particle
    ],
)
def test_a_gas_needs_energy_and_a_density_within_the_limits(settings, warned):
    gas = body("cylinder", material="gas", **settings)
    case = case_of(gas, materials={"gas": GAS}, scheme={"eos": "ideal-gas"})
    assert keys(case) == warned


@pytest.mark.parametrize(
    ("density", "time", "warned"),
    [
        (1.2, {}, ["time.cfl"]),
        (1.2, {"cfl": 0.05}, []),
        (1.2, {"dt": 1e-9}, []),
        (10.0, {}, []),
    ],
)
def test_a_light_gas_before_a_solid_needs_short_steps(density, time, warned):
    sphere = body("sphere", position=-5e-3, velocity=5e3)
    state = {"density": density, "energy": 2e5, "eos": "ideal-gas"}
    gas = body("cylinder", material="gas", **state)
    sections = {"materials": {"gas": GAS}, "time": {"end": 1e-6, **time}}
    assert keys(case_of(sphere, gas, **sections)) == warned


def test_a_gas_does_not_vibrate():
    scheme = {"eos": "ideal-gas", "viscosity": {"alpha": 0.1}}
    gas = body("cylinder", material="gas", energy=2e5)
    case = case_of(gas, materials={"gas": GAS}, scheme=scheme)
    assert keys(case) == ["scheme.viscosity.alpha"]


def test_fixed_steps_have_no_courant_factor():
    steps = ["scheme.viscosity.alpha=0.1", "time.step=fixed", "time.dt=1 ns"]
    assert keys(load_case(SHOT, steps)) == ["scheme.viscosity.alpha"]


@pytest.mark.parametrize("density", [2.7, "2.7 * (1 + r)", 1e6])
def test_a_density_that_no_solid_has(density):
    case = case_of(
        body("sphere", position=-5e-3, velocity=5e3, density=density), body()
    )
    assert keys(case) == ["bodies.sphere.density"]


@pytest.mark.parametrize(
    ("velocity", "planes", "warned"),
    [
        (-4e3, {"z_min": 0.0}, []),
        (4e3, {"z_max": 10e-3}, []),
        (4e3, {"z_min": 0.0}, ["bodies.*.velocity"]),
        (0.0, {"z_min": 0.0}, ["bodies.*.velocity"]),
        (-4e3, {"z_min": -1.0}, ["time.end"]),
        (-4e3, {"z_min": -10e-3}, ["bodies.*.position"]),
        (-300.0, {"z_min": 0.0}, ["scheme.p_min"]),
        (-1e5, {"z_min": 0.0}, ["bodies.*.velocity"]),
    ],
)
def test_a_plane_may_be_hit_like_a_body(velocity, planes, warned):
    rod = body("cylinder", velocity=velocity)
    assert keys(case_of(rod, boundary=planes, scheme=FOAM)) == warned


def test_a_gauge_behind_a_plane():
    rod = body("cylinder", velocity=-4e3)
    gauges = [{"name": "on", "z": 0.0}, {"name": "behind", "z": -1e-3}]
    case = case_of(rod, boundary={"z_min": 0.0}, gauges=gauges)
    assert keys(case) == ["gauges.behind.z"]


DEBRIS = {"thermal": "heat-capacity", "failure": "spall"}


@pytest.mark.parametrize(
    ("changes", "key", "words"),
    [
        ({"spall": {"strength": "1.2 MPa"}}, "spall.strength", "of the bulk modulus"),
        (
            {"ductile": "johnson-cook-damage", "failure": "none"},
            "failure",
            "strains nothing",
        ),
        (
            {"strength": "none", "ductile": "johnson-cook-damage"},
            "ductile",
            "breaks nothing",
        ),
        ({"elongation": 12}, "elongation", "in per cent"),
    ],
)
def test_doubtful_materials(changes, key, words):
    sphere = body("sphere", position=-5e-3, velocity=5e3)
    sound = {"al-6061-t6": DEBRIS}
    assert find_warnings(case_of(sphere, body(), materials=sound)) == []
    case = case_of(sphere, body(), materials={"al-6061-t6": DEBRIS | changes})
    (warning,) = find_warnings(case)
    assert warning.startswith(f"materials.al-6061-t6.{key}: ")
    assert words in warning


def test_artificial_heat_everywhere_spoils_temperatures():
    sphere = body("sphere", position=-5e-3, velocity=5e3)
    scheme = {"heat": {"g1": 0.5}}
    assert keys(case_of(sphere, body(), scheme=scheme)) == ["scheme.heat.g1"]
    cold = FOAM | {"thermal": "none", "ductile": "none"}
    assert keys(case_of(sphere, body(), scheme=scheme | cold)) == []


def test_hardening_matter_without_tension_is_foam_too():
    hard = {"strength": "johnson-cook", "failure": "minimum-pressure"}
    sphere = body("sphere", position=-5e-3, velocity=2e3)
    case = case_of(sphere, body(), materials={"al-6061-t6": hard})
    assert keys(case) == ["materials.al-6061-t6.minimum-pressure"]


def test_a_radial_velocity_in_a_wrong_unit():
    rod = body("cylinder", radial_velocity=5e5)
    assert keys(case_of(rod)) == ["bodies.cylinder.radial_velocity"]


@pytest.mark.parametrize(
    ("one", "other", "meets"),
    [
        # Tangent, and moving on or away.
        (body("sphere", position=-5e-3, velocity=1e3), body(), 0.0),
        (body("sphere", position=-5e-3, velocity=-1e3), body(), math.inf),
        # From behind.
        (body("sphere", position=17e-3, velocity=-1e3), body(), 10e-6),
        # Through a hole, or into its edge.
        (
            body("cylinder", radius=4e-3, position=-20e-3, velocity=1e3),
            body(inner_radius=5e-3),
            math.inf,
        ),
        (
            body("cylinder", position=-20e-3, velocity=1e3),
            body(inner_radius=4e-3),
            10e-6,
        ),
        # A sphere of 5 mm meets a hole of 3 mm 1 mm later than a plate.
        (
            body("sphere", position=-15e-3, velocity=1e3),
            body(inner_radius=3e-3),
            11e-6,
        ),
        # Within the hollow, and at rest beside one another.
        (body("sphere", velocity=1e3), body("spherical_shell"), 0.0),
        (body(), body(position=2e-3), 0.0),
        (body(), body(position=3e-3), math.inf),
    ],
)
def test_meeting_times_against_closed_forms(one, other, meets):
    bodies = case_of(one, {**other, "name": "other"}).bodies
    for pair in (bodies, bodies[::-1]):
        assert meeting_time(*pair) == pytest.approx(meets, abs=2e-8)
    if "velocity" in one:
        assert first_contact(bodies, Boundary()) == meeting_time(*bodies)


@pytest.mark.parametrize(
    ("position", "words"),
    [
        (-5e-3, "after first contact"),
        (-5.001e-3, "after first contact"),
        (-15e-3, "after the start"),
    ],
)
def test_times_count_from_the_first_contact_only_where_the_run_begins_with_it(
    position, words
):
    sphere = body("sphere", position=position, velocity=5e3)
    case = case_of(sphere, body())
    assert time_origin(case.bodies, case.boundary) == words
    away = case_of({**sphere, "velocity": -5e3}, body())
    assert time_origin(away.bodies, away.boundary) == "after the start"
    alone = case_of(sphere, boundary={"z_max": 0.0})
    assert time_origin(alone.bodies, alone.boundary) == words
