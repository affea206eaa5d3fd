"""The tables of a run's page, against the numbers of its case and its result."""

import pytest

from mpisph.case import load_case
from mpisph.io.result import Conservation
from mpisph.io.stored_run import read_run
from mpisph.report.page import Link
from mpisph.report.run_tables import (
    bodies_table,
    cloud_table,
    comparison_table,
    conservation_table,
    materials_table,
    provenance_table,
    runs_table,
    setup_table,
    signed,
    small,
    timing_table,
)


@pytest.fixture(scope="module")
def stored(finished):
    return read_run(finished)


def changed(stored, *overrides):
    return stored._replace(case=load_case(stored.folder / "case.toml", overrides))


def values(table):
    return {row[0]: row[1] for row in table.rows}


@pytest.mark.parametrize(
    ("percent", "text"),
    [(None, "–"), (0.04, "+0.0\xa0%"), (-8.06, "−8.1\xa0%"), (120.0, "+120.0\xa0%")],
)
def test_errors_have_a_sign(percent, text):
    assert signed(percent) == text


def test_relative_errors():
    assert (small(0.0), small(-4.3e-5)) == ("0", "−4.3e−05")


def test_bodies_in_mm_and_km_per_s(stored):
    assert bodies_table(stored.case).rows == [
        ("sphere", "sphere, diameter 9.53 mm", "6.68", "al-lee2003", "Mie-Grüneisen"),
        (
            "plate",
            "plate, 4.039 mm thick, diameter 80 mm",
            "0",
            "al-lee2003",
            "Mie-Grüneisen",
        ),
    ]


def test_every_shape_has_its_size(tmp_path):
    shapes = {
        'shape = "cylinder"\nradius = 0.004\nlength = 0.008\ninner_radius = 0.001': (
            "cylinder, diameter 8 mm, 8 mm long, bore 2 mm"
        ),
        'shape = "spherical_shell"\nouter_radius = 0.004\ninner_radius = 0.003': (
            "spherical shell, diameter 8 mm, inside 6 mm"
        ),
        'shape = "plate"\nthickness = 0.002\nradius = 0.03\ninner_radius = 0.005': (
            "plate, 2 mm thick, diameter 60 mm, hole 10 mm"
        ),
    }
    for text, words in shapes.items():
        path = tmp_path / "case.toml"
        path.write_text(
            'title = "t"\ntime = { end = 1e-6 }\nresolution = { spacing = 0.0005 }\n'
            f'[[bodies]]\nname = "b"\nmaterial = "al-lee2003"\n{text}\n'
        )
        assert bodies_table(load_case(path)).rows[0][1] == words


def test_materials(stored):
    table = materials_table(stored.case)
    assert table.columns == ("", "al-lee2003")
    assert [row[1].replace("\u00a0", " ") for row in table.rows][1:] == [
        "2710 kg/m³",
        "Mie-Grüneisen: c0 5350 m/s, slope 1.49, slope2 0, slope3 0, gamma0 1.7, "
        "gamma slope 0",
        "none",
        "none",
        "elastic, perfectly plastic: shear modulus 25 GPa, yield strength 55 MPa",
        "minimum pressure: value 0 Pa, mode clamp",
        "none",
    ]


@pytest.mark.parametrize(
    ("override", "name", "text"),
    [
        (
            "scheme.p_min.value=-inf",
            "failure in tension",
            "minimum pressure: value -inf\u00a0Pa, mode clamp",
        ),
        (
            "scheme.p_min.mode=off",
            "failure in tension",
            "minimum pressure: value 0\u00a0Pa, mode off",
        ),
        ("scheme.strength=none", "strength", "none"),
        ("scheme.eos=linear", "equation of state", "linear: bulk modulus 72\u00a0GPa"),
    ],
)
def test_models_of_materials_are_named(stored, override, name, text):
    found = values(materials_table(changed(stored, override).case))
    assert found[name] == text


def test_set_up(stored):
    found = values(setup_table(stored))
    assert found["particle spacing"] == "NPR 4, along sphere: spacing 1.191 mm"
    assert found["particles"] == "128"
    assert found["smoothing length"].startswith("NPH 2: 2.383 mm at the start")
    assert found["artificial viscosity"] == "α 5, β 5, ε 0.001; derived form"
    assert found["time step"] == "automatic, 0.3 of the stability limits"
    assert found["clock offset"] == "0.35 µs"
    assert found["end of the run"] == "2.00 µs"


@pytest.mark.parametrize(
    ("override", "name", "text"),
    [
        ("scheme.heat.enabled=false", "artificial heat", "off"),
        ("scheme.self_term=false", "kernel", "a ring does not act on itself"),
        ("time.dt=5 ns", "time step", "at most 5 ns"),
        ("scheme.smoothing=classic", "smoothing length", "classic, eq (20)"),
        ("scheme.smoothing=printed", "smoothing length", "eq (21) to the letter"),
        ("scheme.smoothing=fixed", "smoothing length", "fixed"),
        ("scheme.smoothing=axisymmetric", "smoothing length", "corrected"),
        ("scheme.pair_form=lee2003", "pair forces", "as in eqs (5) and (6)"),
        ("scheme.pair_form=consistent", "pair forces", "continuity equation"),
        ("boundary.z_min=-20 mm", "rigid plane", "z = -20 mm"),
    ],
)
def test_switches_are_named(stored, override, name, text):
    assert text in values(setup_table(changed(stored, override)))[name]


def test_a_fixed_step(stored):
    run = changed(stored, "time.step=fixed", "time.dt=1 ns")
    assert values(setup_table(run))["time step"] == "fixed, 1 ns"


def test_the_cloud_at_both_readings_of_the_clock(stored):
    clouds = {cloud.time: cloud for cloud in stored.clouds}
    table = cloud_table(stored)
    reached = table.rows[:2]
    assert [row[0] for row in reached] == ["1 µs, nominal", "1 µs + 0.35 µs, offset"]
    for row, time in zip(reached, (1e-6, 1.35e-6), strict=True):
        cloud = clouds[time]
        want = ["7.0"]
        for size in (cloud.radius, cloud.radius_robust):
            error = 100 * (size / 7e-3 - 1)
            want.append(f"{1e3 * size:.1f} ({error:+.1f}\xa0%)".replace("-", "−"))
        assert list(row[1:4]) == want
        error = 100 * (cloud.length / 2.1e-3 - 1)
        assert row[5] == f"{1e3 * cloud.length:.1f} ({error:+.1f}\xa0%)".replace(
            "-", "−"
        )
    assert [row[1:] for row in table.rows[2:]] == [
        ("37.5", "–", "–", "98.0", "–", "–")
    ] * 2
    assert "99 % of its mass" in table.caption
    assert "with the case's clock offset added" in table.caption


def test_robust_figures_stand_beside_the_outermost(stored):
    changes = {"radius": 6.5e-3, "length": 1.5e-3, "radius_error_percent": -7.1}
    comparisons = tuple(
        c.model_copy(update=changes if c.figure == "robust" else {})
        for c in stored.comparisons
    )
    first = cloud_table(stored._replace(comparisons=comparisons)).rows[0]
    was = cloud_table(stored).rows[0]
    assert first[3] == "6.5 (−7.1\xa0%)"
    assert first[6].startswith("1.5 (")
    assert (*first[:3], *first[4:6]) == (*was[:3], *was[4:6])


def test_without_an_offset_the_caption_says_so(stored):
    nominal = tuple(c for c in stored.comparisons if c.clock == "nominal")
    table = cloud_table(stored._replace(comparisons=nominal))
    assert len(table.rows) == 2
    assert "no clock offset" in table.caption


def test_conservation(stored):
    errors = Conservation(
        mass_error=0.0,
        momentum_z_error=1.5e-16,
        energy_error_final=-2e-5,
        energy_error_max=3e-5,
    )
    update = {"conservation": errors, "lowest_energy": -1.46e7}
    result = stored.result.model_copy(update=update)
    table = conservation_table(stored._replace(result=result))
    assert [row[1] for row in table.rows] == [
        "0",
        "1.5e−16",
        "−2.0e−05",
        "3.0e−05",
        "−14.6 MJ/kg",
    ]


def test_time_by_phase_adds_up(stored):
    timers = {"halo": 1.0, "pair loop": 5.0, "output": 2.0}
    update = {"timers": timers, "wall": 10.0, "ranks": 2}
    timing = stored.result.timing.model_copy(update=update)
    result = stored.result.model_copy(update={"timing": timing})
    table = timing_table(stored._replace(result=result))
    assert table.rows == [
        ("pair loop", "5.00", "50 %"),
        ("snapshots and checkpoints", "2.00", "20 %"),
        ("halo", "1.00", "10 %"),
        ("everything else", "2.00", "20 %"),
        ("whole run", "10.00", "100 %"),
    ]
    assert "2 ranks, of which the slowest counts" in table.caption


def test_provenance(stored):
    found = values(provenance_table(stored))
    assert found["revision of mpisph"] == stored.result.revision
    assert found["numpy"] == stored.result.versions["numpy"]
    assert found["ranks"] == "1"


def test_runs_side_by_side(stored):
    unended = stored._replace(name="other", state="stopped", result=None)
    placed = [(stored, "run-1"), (unended, "run-2")]
    first, second = runs_table(placed).rows
    assert first[0] == Link("finished", "run-1")
    assert first[1:6] == ("completed", "128", "4", "2", "5, 5")
    assert second[:2] == (Link("other", "run-2"), "stopped")
    assert second[-2:] == ("–", "–")
    rows = comparison_table(placed).rows
    assert [(row[0].text, row[1]) for row in rows] == [
        (name, time) for name in ("finished", "other") for time in ("1 µs", "19 µs")
    ]
    nominal, offset = cloud_table(stored).rows[:2]
    # Measured, nominal and offset: the outermost figures of the run's own table.
    assert rows[0][2:] == (*nominal[1:3], offset[2], *nominal[4:6], offset[5])


def test_without_measurements_nothing_is_compared(stored):
    case = stored.case.model_copy(update={"measured": None})
    assert comparison_table([(stored._replace(case=case), "run-1")]) is None
