"""Studies of own designs: rows of a file, columns without measurements, figures."""

import csv

import matplotlib.image
import numpy as np
import pytest
from documents import example_case
from mpi4py import MPI
from rich.console import Console

import mpisph
from mpisph.case import case_from_dict
from mpisph.core.errors import CaseError
from mpisph.io.history import read_history
from mpisph.io.snapshot import read_series
from mpisph.report.study_tables import cases_table, setup_tables
from mpisph.study.columns import column_label
from mpisph.study.designs import read_designs
from mpisph.study.model import load_study
from mpisph.study.plots.convergence import convergence_panels
from mpisph.study.plots.draw import draw_study
from mpisph.study.plots.lines import lines_figure
from mpisph.study.plots.map import map_figure
from mpisph.study.runner import run_study
from mpisph.study.store import case_folder, study_folder
from mpisph.study.table import collect, write_table

ROWS = """\ufeff# two thicknesses, two velocities
bodies.plate.thickness [mm],bodies.rod.velocity,resolution.nph

2.0,4 km/s,2.0
1.0,4000.0,
2.0,4.5 km/s,1.5
"""

STUDY = """
title = "designs"
base = "rod.toml"
rows = "designs.csv"
times = ["0.1 us"]

[set]
"resolution.npr" = 3
"resolution.nph" = 2.0
"bodies.plate.radius" = "8 mm"
"time.end" = "0.2 us"
"output.every" = "0.1 us"
"output.figures" = false

[figure]
kind = "lines"
x = "thickness"
lines = "velocity"
"""


def write_study(folder, rows=ROWS, text=STUDY):
    (folder / "rod.toml").write_text(case_from_dict(example_case()).to_toml())
    (folder / "designs.csv").write_text(rows, encoding="utf-8")
    path = folder / "designs.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    root = tmp_path_factory.mktemp("designs")
    study = load_study(write_study(root))
    run_study(study, MPI.COMM_SELF, root / "runs", Console(quiet=True))
    return study, root / "runs"


def test_each_row_is_a_case(made):
    study, _ = made
    cases = [case.case for case in study.cases]
    plates = [case.bodies[1].thickness for case in cases]
    assert plates == pytest.approx([2e-3, 1e-3, 2e-3])
    assert [case.bodies[0].velocity for case in cases] == [4e3, 4e3, 4.5e3]
    # An empty cell leaves what the base has.
    assert [case.resolution.nph for case in cases] == [2.0, 2.0, 1.5]
    assert [list(case.settings) for case in study.cases] == [
        ["thickness", "velocity", "nph"]
    ] * 3


def test_names_are_the_ends_of_keys_that_differ(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("bodies.plate.radius;bodies.rod.radius;time.end\n1;2;3\n")
    names = [column.name for column in read_designs(path).columns]
    assert names == ["plate_radius", "rod_radius", "time_end"]
    path.write_text("bodies.0.velocity\tbodies.1.velocity\n1\t2\n")
    names = [column.name for column in read_designs(path).columns]
    assert names == ["bodies_0_velocity", "bodies_1_velocity"]


def test_rows_cross_with_parameters_and_variants(tmp_path):
    more = """
[[parameters]]
name = "alpha"
key = "scheme.viscosity.alpha"
values = [1.0, 2.0]
[[variants]]
name = "a"
[[variants]]
name = "b"
"""
    text = STUDY.partition("[figure]")[0] + more
    study = load_study(write_study(tmp_path, text=text))
    assert len(study.cases) == study.file.count == 12
    assert len({tuple(c.settings.items()) for c in study.cases}) == 6


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("", "designs.csv: expected a line of keys and rows"),
        ("time.end\n", "designs.csv: expected a line of keys and rows"),
        ("time.end,time.cfl\n1\n", "designs.csv:2: expected 2 cells"),
        ("time.end,,\n1,2,3\n", 'designs.csv:1: "": expected a key of the case'),
        ("time.end [us\n1\n", "designs.csv:1: "),
        ("time.end,time.end\n1,2\n", "this key has two columns"),
        ("#x\n\nbodies.plate.thickness\n1 mm\n1 km/s\n", "designs.csv:5: "),
        ("bodies.plate.thickxess\n1 mm\n", "did you mean thickness"),
        ("time.end\n" + "1" * 200_000, "designs.csv:2: field larger than"),
        ("bodies.wall.velocity\n1\n", "designs.csv:2: "),
    ],
)
def test_mistakes_have_a_file_and_a_line(tmp_path, rows, message):
    text = STUDY.partition("[figure]")[0]
    with pytest.raises(CaseError) as raised:
        load_study(write_study(tmp_path, rows, text))
    assert message in str(raised.value)


def test_a_file_of_rows_that_cannot_be_read_is_named(tmp_path):
    path = write_study(tmp_path)
    (tmp_path / "designs.csv").write_bytes(b"time.end\n\xff\n")
    with pytest.raises(CaseError, match=r"designs\.csv: cannot be read: it is no"):
        load_study(path)
    (tmp_path / "designs.csv").unlink()
    with pytest.raises(CaseError, match=r"designs\.csv: no such file"):
        load_study(path)
    (tmp_path / "designs.csv").mkdir()
    with pytest.raises(CaseError, match=r"designs\.csv: is no file"):
        load_study(path)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[figure]", '[[parameters]]\nname="a"\nkey="time.cfl"\nvalues=[1]\n'
         "joined=true\n[figure]", "parameters.0.joined = true: unknown key"),
        ('lines = "velocity"', "", "no axis tells them apart"),
        ('["0.1 us"]', '["0.15 us"]', "has no snapshot at 0.15 us"),
        ('"lines"', '"shots"', "no case has a measured exposure"),
        ('"lines"', '"lines"\ny = "hole"', "did you mean hole_mm?"),
        ('"lines"', '"map"\ny = ["hole_mm", "R_b_mm"]', "shows one column"),
        ('"lines"', '"shots"\ny = "hole_mm"', "a figure of kind shots has no y"),
    ],
)  # fmt: skip
def test_mistakes_of_the_study_are_named(tmp_path, old, new, message):
    assert old in STUDY
    with pytest.raises(CaseError) as raised:
        load_study(write_study(tmp_path, text=STUDY.replace(old, new)))
    assert message in str(raised.value)


def test_without_measurements_there_are_columns_at_the_end_and_at_times(made):
    study, root = made
    row = collect(study, root)[0]
    run = mpisph.open(case_folder(root, study.cases[0]))
    for where, time in (("", 0.2e-6), ("_0.1us", 0.1e-6)):
        snapshot = run.at(time)
        cloud, rod = snapshot.cloud(), snapshot.body("rod")
        m, u_z, u_r = (snapshot[name][rod] for name in ("m", "u_z", "u_r"))
        assert row[f"R_b{where}_mm"] == pytest.approx(1e3 * cloud.radius)
        assert row[f"L_b{where}_robust_mm"] == pytest.approx(1e3 * cloud.length_robust)
        assert row[f"cloud_mass{where}_g"] == pytest.approx(1e3 * cloud.mass)
        front = row[f"front_velocity{where}_km_per_s"]
        assert front == pytest.approx(1e-3 * cloud.front_velocity)
        assert row[f"hole{where}_mm"] == pytest.approx(1e3 * snapshot.hole().diameter)
        momentum = row[f"momentum_z_rod{where}_kg_m_per_s"]
        assert momentum == pytest.approx((m * u_z).sum())
        kinetic = row[f"kinetic_energy_rod{where}_J"]
        assert kinetic == pytest.approx(0.5 * (m * (u_z**2 + u_r**2)).sum())
    assert "total_error_percent" not in row


def test_the_bodies_together_have_what_the_history_says(made):
    study, root = made
    row = collect(study, root)[2]
    last = read_history(case_folder(root, study.cases[2]) / "history.csv")[-1]
    for name, unit in (
        ("momentum_z", "kg_m_per_s"),
        ("kinetic_energy", "J"),
        ("internal_energy", "J"),
    ):
        total = sum(row[f"{name}_{body}_{unit}"] for body in ("rod", "plate"))
        assert total == pytest.approx(last[name], rel=1e-9)


def test_a_snapshot_that_was_moved_away_takes_its_columns_alone(made, monkeypatch):
    study, root = made
    whole = collect(study, root)[0]
    monkeypatch.setattr(
        "mpisph.study.table.read_series",
        lambda folder: [(path / "gone", t) for path, t in read_series(folder)],
    )
    row = collect(study, root)[0]
    assert row["R_b_mm"] == whole["R_b_mm"]
    assert {"hole_mm", "kinetic_energy_rod_J"} <= whole.keys() - row.keys()


def test_the_columns_of_a_study_are_those_it_fills(made):
    study, root = made
    row = collect(study, root)[0]
    numbers = {k for k, v in row.items() if isinstance(v, int | float)}
    assert numbers - {"case", *study.cases[0].settings} == set(study.columns())


def test_the_clouds_over_time_are_a_table_too(made):
    study, root = made
    rows = collect(study, root)
    write_table(study, root, rows, parquet=False)
    with (study_folder(root, study) / "times.csv").open(newline="") as file:
        lines = list(csv.DictReader(file))
    assert [float(line["time_us"]) for line in lines] == pytest.approx([0.1, 0.2] * 3)
    for line, row in zip(lines[1::2], rows, strict=True):
        assert float(line["R_b_mm"]) == row["R_b_mm"]
        assert line["thickness"] == str(row["thickness"])


def drawn(study, **figure):
    """The study with another figure."""
    spec = study.file.figure.model_copy(update=figure)
    return study._replace(file=study.file.model_copy(update={"figure": spec})), spec


def test_lines_show_any_column(made, tmp_path):
    study, root = made
    rows = collect(study, root)
    study, spec = drawn(study, y=("hole_mm", "kinetic_energy_rod_0.1us_J"))
    data = lines_figure(study, spec, rows)
    labels = ["hole [mm]", "kinetic energy rod at 0.1 µs [J]"]
    assert [row.label for row in data.rows] == labels
    (band,) = data.bands
    (panel,) = band.panels
    assert data.x.values == (1.0, 2.0)
    assert data.x.title == "thickness [mm]"
    hole = [row["hole_mm"] for row in rows]
    wanted = [[np.nan, hole[0]], [hole[1], np.nan], [np.nan, hole[2]]]
    np.testing.assert_array_equal(panel.values[0], wanted)
    assert matplotlib.image.imread(draw_study(study, rows, tmp_path)).size


def test_by_default_a_figure_shows_the_sizes_at_the_end(made, tmp_path):
    study, root = made
    rows = collect(study, root)
    data = lines_figure(study, study.file.figure, rows)
    assert [row.label for row in data.rows] == ["$R_b$ [mm]", "$L_b$ [mm]"]
    assert draw_study(study, rows, tmp_path).exists()


def test_a_map_shows_a_column(made, tmp_path):
    study, root = made
    rows = collect(study, root)
    study, spec = drawn(study, kind="map", y=("cloud_mass_g",))
    data = map_figure(study, spec, rows)
    assert (data.label, data.limit) == ("cloud mass [g]", None)
    ((panel,),) = [band.panels for band in data.bands]
    values = panel.values[np.isfinite(panel.values)]
    assert sorted(values) == sorted(row["cloud_mass_g"] for row in rows)
    assert draw_study(study, rows, tmp_path).exists()


def test_columns_have_words():
    for name, words in (
        ("R_b_mm", "$R_b$ [mm]"),
        ("L_b_6us_offset_robust_mm", "$L_b$ at 6 µs offset robust [mm]"),
        ("front_velocity_1.5us_km_per_s", "front velocity at 1.5 µs [km/s]"),
        ("momentum_z_plate_kg_m_per_s", "momentum z plate [kg m/s]"),
        ("steps", "steps"),
    ):
        assert column_label(name) == words


def test_a_convergence_figure_shows_columns_without_measurements(made):
    study, root = made
    study, spec = drawn(
        study, kind="convergence", x="thickness", y=("R_b_mm", "hole_mm")
    )
    panels = convergence_panels(study, spec, collect(study, root))
    assert [(p.quantity, p.unit) for p in panels] == [("$R_b$", "mm"), ("hole", "mm")]


def test_the_page_of_a_study_shows_the_results_without_measurements(made):
    study, root = made
    rows = collect(study, root)
    table = cases_table(study, rows)
    shown = dict(zip(table.columns, table.rows[0], strict=True))
    assert float(shown["hole [mm]"]) == pytest.approx(rows[0]["hole_mm"], rel=1e-2)
    assert float(shown["thickness [mm]"]) == 2.0
    parameters = setup_tables(study)[0].rows
    assert ("thickness [mm]", "bodies.plate.thickness", "2.0, 1.0") in parameters
