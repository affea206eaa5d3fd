import io
import json
import math

import pytest
from launch import CASES
from rich.console import Console

from mpisph.case import load_case
from mpisph.diagnostics.cloud import CloudMeasure
from mpisph.diagnostics.condition import Condition
from mpisph.io.result import (
    CloudRecord,
    Conservation,
    Result,
    Timing,
    bodies_table,
    body_records,
    comparison_table,
    make_comparisons,
    read_result,
    write_result,
)


@pytest.fixture(scope="module")
def case():
    """Shot 4-1353: 15.3 and 31.7 mm at 6 us, 37.5 and 98.0 at 19, offset 0.89."""
    return load_case(CASES / "piekutowski-4-1353.toml")


def cloud(time, radius, length):
    measure = CloudMeasure(radius, length, 0.9 * radius, 0.9 * length, 5100.0, 1e-3)
    return CloudRecord.of(time, measure, load_case(CASES / "piekutowski-4-1353.toml"))


def result(case, clouds):
    return Result(
        title=case.title,
        status="unstable",
        reason="energy_drift",
        step=7,
        time=8e-6,
        particle=3,
        particles=100,
        clouds=clouds,
        comparisons=make_comparisons(case, clouds),
        conservation=Conservation(
            mass_error=0.0,
            momentum_z_error=1e-16,
            energy_error_final=math.nan,
            energy_error_max=math.inf,
        ),
        timing=Timing(
            ranks=2,
            steps=7,
            wall=1.0,
            step_ms=1.0,
            interaction_ns=20.0,
            timers={"pair loop": 0.5},
        ),
        versions={"numpy": "2"},
        revision="unknown",
    )


@pytest.fixture
def clouds():
    # The second time as additions make it.
    return [cloud(6e-6, 16.065e-3, 26e-3), cloud(6e-6 + 0.89e-6, 15.9e-3, 31.7e-3)]


def test_each_exposure_is_compared_by_both_clocks(case, clouds):
    everything = make_comparisons(case, clouds)
    found = [c for c in everything if c.figure == "outermost"]
    assert [(c.clock, c.nominal_time, c.outcome) for c in found] == [
        ("nominal", 6e-6, "compared"),
        ("offset", 6e-6, "compared"),
        ("nominal", 19e-6, "not reached"),
        ("offset", 19e-6, "not reached"),
    ]
    assert [c.time for c in found] == pytest.approx([6e-6, 6.89e-6, 19e-6, 19.89e-6])
    first, second, late, _ = found
    assert (first.measured_radius, first.measured_length) == (15.3e-3, 31.7e-3)
    assert (first.radius, first.length) == (16.065e-3, 26e-3)
    assert first.radius_error_percent == pytest.approx(5.0)
    assert first.length_error_percent == pytest.approx(100 * (26 - 31.7) / 31.7)
    assert second.length_error_percent == pytest.approx(0.0, abs=1e-9)
    assert (late.radius, late.length_error_percent) == (None, None)
    assert late.measured_length == 98e-3
    robust = everything[1]
    assert (robust.figure, robust.time) == ("robust", 6e-6)
    assert robust.radius == clouds[0].radius_robust
    want = 100 * (clouds[0].length_robust / 31.7e-3 - 1)
    assert robust.length_error_percent == pytest.approx(want)


def test_without_an_offset_there_is_one_comparison(case, clouds):
    measured = case.measured.model_copy(update={"clock_offset": 0.0})
    case = case.model_copy(update={"measured": measured})
    assert [c.clock for c in make_comparisons(case, clouds)] == ["nominal"] * 4


def test_without_measurements_there_is_no_comparison(clouds):
    assert make_comparisons(load_case(CASES / "plate-impact.toml"), clouds) == ()


def test_a_missing_measurement_gives_no_error(case, clouds):
    exposure = case.measured.exposures[0].model_copy(update={"radius": None})
    measured = case.measured.model_copy(update={"exposures": (exposure,)})
    found = make_comparisons(case.model_copy(update={"measured": measured}), clouds)
    assert found[0].radius == 16.065e-3
    assert found[0].radius_error_percent is None
    assert found[0].length_error_percent is not None


def test_a_result_comes_back(tmp_path, case, clouds):
    want = result(case, clouds)
    got = read_result(write_result(tmp_path, want))
    assert math.isnan(got.conservation.energy_error_final)
    assert got.conservation.energy_error_max == math.inf
    assert got.model_dump_json() == want.model_dump_json()
    assert got.clouds[0].measure.length_robust == 0.9 * 26e-3
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]


def test_the_file_is_strict_json(tmp_path, case, clouds):
    def refuse(text):
        raise AssertionError(text)

    text = write_result(tmp_path, result(case, clouds)).read_text()
    data = json.loads(text, parse_constant=refuse)
    assert data["status"] == "unstable"
    assert data["comparisons"][0]["radius_error_percent"] == pytest.approx(5.0)


def test_the_table_is_in_mm_and_percent(case, clouds):
    console = Console(file=io.StringIO(), width=120)
    console.print(comparison_table(result(case, clouds)))
    text = console.file.getvalue()
    rows = [line.split("│") for line in text.splitlines() if "µs" in line]
    cells = [[cell.strip() for cell in row[1:-1]] for row in rows]
    assert cells[0] == [
        *("6 µs", "6.00 µs (nominal)"),
        *("15.3", "16.1", "+5.0 %"),
        *("31.7", "26.0", "-18.0 %"),
    ]
    assert cells[3] == [
        *("19 µs", "19.89 µs (offset)"),
        *("37.5", "not reached", "-"),
        *("98.0", "not reached", "-"),
    ]
    assert "outermost" in text


def melting_plate(case):
    """The case with a plate that melts, and does not break."""
    changes = ["bodies.plate.material=al-6061-t6"]
    changes.append("materials.al-6061-t6.thermal=heat-capacity")
    changes += [f"materials.al-6061-t6.{kind}=none" for kind in ("failure", "ductile")]
    return load_case(CASES / "piekutowski-4-1353.toml", changes)


def test_bodies_are_recorded_as_far_as_their_models_go(tmp_path, case, clouds):
    motion = (1.5, 2500.0, 125.0)
    found = [Condition(1e-3, 0.0, 0.0, *motion), Condition(5e-2, 0.254, 0.0, *motion)]
    assert body_records(case, found) == ()
    sphere, plate = body_records(melting_plate(case), found)
    assert (sphere.name, sphere.mass) == ("sphere", 1e-3)
    assert (sphere.molten, sphere.broken) == (None, None)
    assert (plate.name, plate.molten, plate.broken) == ("plate", 0.254, None)
    assert (plate.momentum_z, plate.kinetic_energy, plate.internal_energy) == motion
    ended = result(case, clouds).model_copy(update={"bodies": (sphere, plate)})
    assert read_result(write_result(tmp_path, ended)).bodies == (sphere, plate)
    console = Console(file=io.StringIO(), width=120)
    console.print(bodies_table(ended))
    assert "mass in g" in console.file.getvalue()
    rows = [x.split("│") for x in console.file.getvalue().splitlines() if "│" in x]
    cells = [[cell.strip() for cell in row[1:-1]] for row in rows]
    sums = ["1.5", "2500", "125"]
    assert cells == [
        ["sphere", "1", "-", "-", *sums],
        ["plate", "50", "25.4 %", "-", *sums],
    ]
