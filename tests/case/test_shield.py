"""Cases of a shield: what the program makes of them, and what it refuses."""

import tomllib

import pytest
from shields import shield_case, shield_data

from mpisph.case import case_from_dict, load_case
from mpisph.case.identity import case_key, differences
from mpisph.case.plausibility import find_warnings
from mpisph.case.shield import (
    COARSEST_NPR,
    FINEST_NPR,
    USUAL_NPR,
    WALL_ROWS,
    default_end,
    default_npr,
    default_radii,
    flights_of,
    is_block,
)
from mpisph.core.errors import CaseError

CARD = """
rho0 = "2700 kg/m3"
[mie-grueneisen]
c0 = "5300 m/s"
slope = 1.3
gamma0 = 2.0
[elastic-plastic]
shear_modulus = "26 GPa"
yield_strength = "300 MPa"
"""


def problems(data):
    with pytest.raises(CaseError) as caught:
        case_from_dict(data)
    return {problem.key: problem.expected for problem in caught.value.problems}


def test_bodies_are_made_of_the_shield():
    case = shield_case()
    sphere, bumper, wall = case.bodies
    assert [b.name for b in case.bodies] == ["projectile", "bumper", "wall"]
    assert sphere.radius == pytest.approx(3.175e-3 / 2)
    assert sphere.section.ends[1] == pytest.approx(0.0, abs=1e-12)  # touches
    assert sphere.velocity == 6500.0
    assert bumper.section.ends == pytest.approx((0.0, 0.787e-3))
    assert wall.section.ends == pytest.approx((51.587e-3, 54.767e-3))
    assert (bumper.material, wall.material) == ("al-6061-t6", "al-6061-t6")
    assert (case.time.cfl, case.resolution.npr) == (0.6, USUAL_NPR)


def test_bumpers_stand_one_behind_the_other():
    data = shield_data()
    first = data["shield"]["bumpers"][0]
    data["shield"]["bumpers"] = [first, {**first, "standoff": "20 mm"}]
    case = case_from_dict(data)
    names = ["projectile", "bumper-1", "bumper-2", "wall"]
    assert [b.name for b in case.bodies] == names
    ends = [b.section.ends for b in case.bodies]
    assert ends[2][0] - ends[1][1] == pytest.approx(50.8e-3)
    assert ends[3][0] - ends[2][1] == pytest.approx(20e-3)
    assert case.bodies[2].radius > case.bodies[1].radius  # the cloud has spread


def test_what_is_given_is_kept():
    case = shield_case(
        wall={"radius": "20 mm"},
        resolution={"npr": 5},
        time={"end": "30 us", "cfl": 0.2},
        output={"times": ["12 us"], "history_every": 3},
    )
    assert case.bodies[-1].radius == 0.02
    assert case.resolution.npr == 5
    assert (case.end_time, case.time.cfl) == (30e-6, 0.2)
    assert case.output.history_every == 3
    assert case.output_times == pytest.approx((12e-6, 25e-6, 30e-6))


def test_the_earlier_verdict_has_an_output_time():
    case = shield_case()
    assert min(abs(t / case.verdict_time - 1.0) for t in case.output_times) < 1e-9
    assert len(case.output_times) == 12
    assert case.verdict_time == pytest.approx(case.end_time / 1.2)


def test_the_end_is_the_clouds_flight_and_the_walls_response():
    shield = shield_case().shield
    # By hand: 2785 and 2703 kg/m3, of the cards.
    rho = [2785.0, 2703.0]
    sphere = rho[0] * 3.175e-3 / 1.5
    slow = 6500.0 * sphere / (sphere + rho[1] * 0.787e-3)
    flight = 3.175e-3 / 6500.0 + 1.1 * 51.587e-3 / slow
    assert default_end(shield, rho) == pytest.approx(flight + 8e-6 * 3.18)
    assert shield_case().end_time >= flight + 8e-6 * 3.18
    thick = shield_case(wall={"thickness": "20 mm"}).shield
    # Of a block three diameters respond.
    assert default_end(thick, rho) == pytest.approx(flight + 8e-6 * 3 * 3.175)


def test_matter_leaves_once_it_cannot_come_to_what_stands_behind():
    """Half of the way past a bumper; a near bumper has four times the way through."""
    d, v = 3.175e-3, 6500.0
    bumpers = [
        {"thickness": "0.787 mm", "standoff": "50.8 mm", "material": "al-6061-t6"},
        {"thickness": "0.5 mm", "standoff": "6 mm", "material": "al-6061-t6"},
    ]
    data = shield_data()
    data["shield"]["bumpers"] = bumpers
    sphere, first, second, wall = flights_of(case_from_dict(data).shield)
    front = 0.787e-3 + 50.8e-3
    assert first == pytest.approx((front - d, (0.787e-3 + 25.4e-3) / v))
    behind = front + 0.5e-3 + 6e-3
    passed = (front + 4.0 * (d + 0.5e-3)) / v
    assert second == sphere == pytest.approx((behind - d, passed))
    assert wall == pytest.approx((behind - d, 0.0))


def test_when_matter_leaves_depends_on_no_time_that_is_given():
    case = shield_case()
    assert case.horizon == pytest.approx(2.0 * case.end_time, rel=0.01)  # rounded up
    assert shield_case(time={"end": "90 us"}).horizon == case.horizon


def test_resolution_goes_with_the_walls_rows():
    def npr(thickness):
        return default_npr(shield_case(wall={"thickness": thickness}).shield)

    assert npr(3.175e-3) == USUAL_NPR
    assert npr(3.175e-3 / 2 * WALL_ROWS / 10) == 10
    assert npr(0.2e-3) == FINEST_NPR
    assert npr(25e-3) == COARSEST_NPR
    assert COARSEST_NPR < npr(15e-3) < USUAL_NPR


def test_a_block_is_narrower_than_a_sheet():
    sheet = shield_case().shield
    block = shield_case(wall={"thickness": "5 mm"}).shield
    assert not is_block(sheet)
    assert is_block(block)
    assert default_radii(block)[-1] < default_radii(sheet)[-1]
    spread = 0.45 * 50.8e-3 + 3 * 3.175e-3
    assert default_radii(sheet) == pytest.approx((4 * 3.175e-3, spread))


def test_a_complete_case_gives_itself():
    case = shield_case(time={"end": "30 us"})
    text = case.to_toml()
    again = case_from_dict(tomllib.loads(text))
    assert again == case
    assert "[[bodies]]" not in text
    assert case_key(again) == case_key(case)


def test_overrides_reach_into_the_shield(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(shield_case().to_toml())
    case = load_case(path, ["shield.wall.thickness=4 mm", "shield.bumpers.0.radius="])
    assert case.bodies[-1].thickness == 4e-3
    changed = {d.partition(":")[0] for d in differences(shield_case(), case)}
    assert "shield.wall.thickness" in changed


def test_a_card_of_ones_own(tmp_path):
    card = tmp_path / "mine.toml"
    card.write_text(CARD)
    data = shield_data(wall={"material": "mine.toml"})
    case = case_from_dict(data, tmp_path)
    assert case.shield.wall.material == "mine"
    again = case_from_dict(tomllib.loads(case.to_toml()))
    assert again.shield == case.shield


@pytest.mark.parametrize(
    ("tables", "key", "words"),
    [
        ({"bumpers": {"radius": "1 mm"}}, "shield.bumpers.0.radius", "radius"),
        ({"wall": {"radius": "1 mm"}}, "shield.wall.radius", "radius"),
        ({"wall": {"material": "kevlar"}}, "shield.wall.material", "card"),
        ({"projectile": {"angle": 45}}, "shield.projectile.angle", "unknown key"),
        ({"projectile": {"velocity": -1.0}}, "shield.projectile.velocity", "more"),
        ({"bodies": []}, "bodies", "leave one of them out"),
    ],
)
def test_what_is_refused_is_named_by_its_key_in_the_shield(tables, key, words):
    found = problems(shield_data(**tables))
    assert next(iter(found)) == key
    assert words in found[key]


def test_a_missing_size_alone_is_said():
    data = shield_data()
    del data["shield"]["wall"]["thickness"]
    assert list(problems(data)) == ["shield.wall.thickness"]


def test_no_bumper_is_no_shield():
    data = shield_data()
    data["shield"]["bumpers"] = []
    assert list(problems(data)) == ["shield.bumpers"]


def test_a_sound_shield_has_no_warning():
    assert find_warnings(shield_case()) == []


@pytest.mark.parametrize(
    ("tables", "words"),
    [
        ({"wall": {"radius": "15 mm"}}, "the rim may matter"),
        ({"wall": {"thickness": "0.4 mm"}}, "too few to bend"),
        ({"bumpers": {"thickness": "4 mm"}}, "nothing may come"),
        ({"bumpers": {"standoff": "2 mm"}}, "no cloud forms"),
    ],
)
def test_a_doubtful_shield_is_warned_of(tables, words):
    texts = [t for t in find_warnings(shield_case(**tables)) if "shield." in t]
    assert len(texts) == 1
    assert words in texts[0]
