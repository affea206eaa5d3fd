"""The rule by which a wall holds, at both sides of each of its limits."""

import pytest
from shields import shield_case

from mpisph.analysis.verdict import damage_ratio, judge, judge_wall, rest_time
from mpisph.io.verdict import WallRecord

SOUND = WallRecord(
    time=38e-6,
    shear=0.02,
    ligament=1.0,
    sound_share=1.0,
    hole=0.0,
    detached=0.0,
    detached_velocity=0.0,
    detached_momentum=0.0,
    bulge=1e-3,
    crater_depth=0.0,
    crater_diameter=0.0,
    velocity=3.0,
)
ELONGATION = 0.12


def wall(**changes):
    return SOUND.model_copy(update=changes)


@pytest.fixture(scope="module")
def sheet():
    return shield_case()


@pytest.fixture(scope="module")
def block():
    return shield_case(wall={"thickness": "5 mm"})


def test_a_sheet_tears_at_its_elongation(sheet):
    assert sheet.materials["al-6061-t6"].elongation == ELONGATION
    assert judge_wall(sheet, wall(shear=0.97 * ELONGATION))[0] == "holds"
    assert judge_wall(sheet, wall(shear=1.03 * ELONGATION))[0] == "perforated"
    assert damage_ratio(sheet, wall(shear=0.06)) == pytest.approx(0.5)


@pytest.mark.parametrize("factor", [0.99, 1.0, 1.01])
def test_too_near_to_tell(sheet, factor):
    assert judge_wall(sheet, wall(shear=factor * ELONGATION))[0] == "undecided"


def test_a_block_is_judged_by_what_is_sound_not_by_its_tilt(block):
    # A crater of depth P perforates what is thinner than 1.8 P.
    assert judge_wall(block, wall(ligament=0.46, shear=0.5))[0] == "holds"
    assert judge_wall(block, wall(ligament=0.42))[0] == "perforated"
    assert damage_ratio(block, wall(ligament=1 - 1 / 1.8)) == pytest.approx(1.0)


def test_a_hole_perforates_either(sheet, block):
    for case in (sheet, block):
        outcome, reason = judge_wall(case, wall(hole=1e-3))
        assert outcome == "perforated"
        assert "hole of 1 mm" in reason
        assert damage_ratio(case, wall(hole=1e-3)) > 1.0


def test_more_than_a_grain_is_spall(sheet):
    grain = 0.1 * sheet.bodies[-1].thickness ** 3 * 2703.0
    assert judge_wall(sheet, wall(detached=0.95 * grain))[0] == "holds"
    assert judge_wall(sheet, wall(detached=1.05 * grain))[0] == "detached spall"
    assert damage_ratio(sheet, wall(detached=8 * grain)) == pytest.approx(2.0, rel=0.01)


def test_without_elongation_nothing_is_decided_but_a_hole():
    case = shield_case(wall={"material": "al-lee2003"})
    assert case.materials["al-lee2003"].elongation is None
    outcome, reason = judge_wall(case, SOUND)
    assert outcome == "undecided"
    assert "materials.al-lee2003.elongation" in reason
    assert judge_wall(case, wall(hole=1e-3))[0] == "perforated"


def test_a_verdict_that_changes_late_is_undecided(sheet):
    early = wall(time=sheet.verdict_time, shear=0.05)
    late = wall(time=sheet.end_time, shear=0.2)
    verdict = judge(sheet, [early, late], None)
    assert (verdict.earlier, verdict.outcome) == ("holds", "undecided")
    assert "time.end" in verdict.reason
    kept = judge(sheet, [early.model_copy(update={"shear": 0.2}), late], None)
    assert (kept.earlier, kept.outcome) == ("perforated", "perforated")


def test_two_ways_to_fail_agree(sheet):
    early = wall(time=sheet.verdict_time, detached=1.0)
    late = wall(time=sheet.end_time, hole=1e-3)
    assert judge(sheet, [early, late], None).outcome == "perforated"


def test_a_run_that_broke_down_is_undecided(sheet):
    verdict = judge(sheet, [wall(shear=0.5)], "energy_drift")
    assert verdict.outcome == "undecided"
    assert "energy_drift" in verdict.reason
    assert judge(sheet, [], "energy_drift").wall is None


def test_rest_is_from_when_the_bulge_stays(sheet):
    t = sheet.shield.wall.thickness
    bulges = [0.0, 0.5 * t, 0.6 * t, 0.61 * t, 0.605 * t]
    walls = [wall(time=float(k), bulge=b) for k, b in enumerate(bulges)]
    assert rest_time(sheet, walls) == 2.0
    assert rest_time(sheet, walls[:3]) is None
