"""The case files that come with mpisph, and its material cards in a case."""

import tomllib

import numpy as np
import pytest
from launch import CASES as FOLDER

from mpisph.case import case_from_dict, load_case
from mpisph.case.discretise import discretise
from mpisph.case.plausibility import find_warnings
from mpisph.materials import card_names, load_card
from mpisph.physics.response import KINDS

FILES = sorted(FOLDER.glob("*.toml"))

# Shot, velocity [m/s], plate thickness [m], exposures (time [s], R_b, L_b [m]).
SHOTS = [
    ("1283", 6720.0, 0.968e-3, [(6e-6, 22.3e-3, 47.7e-3)]),
    ("1291", 6710.0, 1.549e-3, [(6e-6, 20.8e-3, 43.6e-3)]),
    ("1352", 6640.0, 2.225e-3, [(6e-6, 17.7e-3, 36.4e-3)]),
    (
        "1353",
        6680.0,
        4.039e-3,
        [(6e-6, 15.3e-3, 31.7e-3), (19e-6, 37.5e-3, 98.0e-3)],
    ),
]


def test_all_files_are_known():
    shots = [f"piekutowski-4-{shot}" for shot, *_ in SHOTS]
    others = ["plate-impact", "whipple-shield"]
    assert [f.stem for f in FILES] == ["paper-base-case", *shots, *others]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_case_loads_round_trips_and_makes_particles(path):
    case = load_case(path)
    assert case_from_dict(tomllib.loads(case.to_toml())) == case
    particles = discretise(case)
    assert np.unique(particles.body).size == len(case.bodies)
    # Bodies touch at z = 0; none reaches into the other.
    assert particles.z[particles.body == 0].max() < 0.0
    assert particles.z[particles.body == 1].min() > 0.0


@pytest.mark.parametrize(("shot", "velocity", "thickness", "exposures"), SHOTS)
def test_shots(shot, velocity, thickness, exposures):
    case = load_case(FOLDER / f"piekutowski-4-{shot}.toml")
    sphere, plate = case.bodies
    assert sphere.radius == 4.765e-3
    assert sphere.position == -sphere.radius
    assert (sphere.velocity, plate.thickness) == (velocity, thickness)
    assert (plate.position, plate.radius) == (0.0, 0.04)
    assert case.spacing == pytest.approx(4.765e-4)
    assert case.smoothing_length == pytest.approx(9.53e-4)
    assert (case.scheme.viscosity.alpha, case.scheme.viscosity.beta) == (5.0, 5.0)
    assert case.time.step == "automatic"
    assert set(case.materials) == {"al-lee2003"}
    measured = case.measured
    assert [(e.time, e.radius, e.length) for e in measured.exposures] == exposures
    assert measured.clock_offset == 0.89e-6
    wanted = [time + shift for time, *_ in exposures for shift in (0.0, 0.89e-6)]
    for time in wanted:
        assert np.isclose(case.output_times, time, rtol=1e-9, atol=0.0).any()


def test_base_case_is_table_4():
    case = load_case(FOLDER / "paper-base-case.toml")
    assert (case.resolution.npr, case.resolution.nph) == (6, 2.0)
    assert (case.time.step, case.time.dt) == ("fixed", 1e-9)
    scheme = case.scheme
    viscosity = scheme.viscosity
    assert (viscosity.alpha, viscosity.beta, viscosity.epsilon) == (2.5, 2.5, 0.001)
    assert (scheme.heat.g1, scheme.heat.g2) == (0.5, 1.0)
    assert (scheme.eos, scheme.strength) == ("mie-grueneisen", "elastic-plastic")
    assert (scheme.p_min.value, scheme.p_min.mode) == (0.0, "clamp")


def test_plate_impact_is_symmetric():
    case = load_case(FOLDER / "plate-impact.toml")
    flyer, target = case.bodies
    assert flyer.velocity == 3000.0
    assert target.velocity == 0.0
    assert case.output_times == (2e-7, 4e-7, 6e-7, 8e-7, 1e-6)
    p = discretise(case)
    mass = np.bincount(p.body, weights=p.m)
    assert mass[0] == pytest.approx(mass[1])


def choices(card):
    """Every choice of a model that a card has the constants of, alone and bare."""
    yield {}
    thermal = {"thermal": "heat-capacity"} if "heat-capacity" in card.given else {}
    for kind, models in KINDS.items():
        for name in card.given:
            if name in models:
                yield {**thermal, kind: name}


@pytest.mark.parametrize("name", card_names())
def test_every_model_of_a_card_can_be_chosen_without_a_doubt(name):
    card = load_card(name)
    sphere = {"name": "sphere", "shape": "sphere", "radius": 5e-3, "material": name}
    sphere |= {"position": -5e-3, "velocity": 5e3}
    plate = {"name": "plate", "shape": "plate", "thickness": 2e-3, "radius": 20e-3}
    for choice in choices(card):
        case = case_from_dict(
            {
                "title": "t",
                "bodies": [sphere, {**plate, "material": "al-6061-t6"}],
                "materials": {name: choice},
                "resolution": {"npr": 8},
                "time": {"end": 1e-6},
            }
        )
        assert find_warnings(case) == []
        assert choice.items() <= case.material_table[0].names.items()
