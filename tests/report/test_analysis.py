"""What a page says of the debris, against the analyses themselves."""

import numpy as np
import pytest
from launch import CASES

from mpisph.analysis.fragments import find_fragments
from mpisph.analysis.hole import Hole
from mpisph.case import load_case
from mpisph.diagnostics.cloud import cloud_definition
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import read_run
from mpisph.report import analysis
from mpisph.report.analysis import (
    ANALYSES,
    analysis_tables,
    fragments_table,
    has_debris,
    hole_table,
)


@pytest.fixture(scope="module")
def case(finished):
    return read_run(finished).case


@pytest.fixture(scope="module")
def snapshot(finished):
    return read_snapshot(read_run(finished).snapshots[-1][0])


def test_debris_is_what_has_gone_through_a_plate(finished, case, snapshot):
    assert has_debris(snapshot.arrays, case)
    first = read_snapshot(read_run(finished).snapshots[0][0])
    assert not has_debris(first.arrays, case)
    plates = load_case(CASES / "plate-impact.toml")
    assert not has_debris(snapshot.arrays, plates)


def test_the_heaviest_fragments(case, snapshot, monkeypatch):
    found = find_fragments(snapshot.arrays, cloud_definition(case))
    table = fragments_table(snapshot, case)
    assert table.title == f"The heaviest fragments, of {len(found.mass)}"
    assert len(table.rows) == min(len(found.mass), 10)
    first = dict(zip(table.columns, table.rows[0], strict=True))
    members = found.fragment_of == 0
    m = snapshot.arrays["m"][members]
    assert float(first["mass [mg]"]) == pytest.approx(1e6 * m.sum(), rel=5e-3)
    assert int(first["particles"]) == members.sum()
    mean = {n: (m * snapshot.arrays[n][members]).sum() / m.sum() for n in ("u_z", "r")}
    assert float(first["u_z [km/s]"]) == pytest.approx(mean["u_z"] / 1e3, abs=5.1e-3)
    assert float(first["r [mm]"]) == pytest.approx(1e3 * mean["r"], abs=0.051)
    bodies = snapshot.arrays["body"][members]
    share = [m[bodies == k].sum() for k in range(2)]
    assert first["mostly"] == ("sphere", "plate")[int(np.argmax(share))]
    assert float(first["share [%]"]) == pytest.approx(
        100 * m.sum() / found.mass.sum(), abs=0.051
    )
    monkeypatch.setattr(analysis, "HEAVIEST", 1)
    assert fragments_table(snapshot, case).rows == table.rows[:1]


def test_large_masses_have_no_exponent(case, snapshot):
    heavy = {**snapshot.arrays, "m": 1e3 * snapshot.arrays["m"]}
    rows = fragments_table(snapshot._replace(arrays=heavy), case).rows
    assert "e" not in rows[0][1]
    assert float(rows[0][1]) > 1000


def test_the_hole_beside_the_bands_of_the_fits(case, snapshot):
    found = dict(hole_table(snapshot, case).rows)
    assert 5.0 < float(found["computed, between the faces"]) < 40.0
    assert float(found["grain of the measure"]) == pytest.approx(4.765 / 4, abs=0.05)
    # D/d = 2.4 (V/c)(t/d)^(2/3) + 0.9 and 0.88 V^0.5 (t/d)^0.45 + 1, by hand.
    d, t, v, c = 9.53, 4.039, 6.68, 5.35
    maiden = d * (2.4 * v / c * (t / d) ** (2 / 3) + 0.9)
    nysmith = d * (0.88 * v**0.5 * (t / d) ** 0.45 + 1)
    assert found["Maiden’s fit"] == f"{0.9 * maiden:.1f} – {1.1 * maiden:.1f}"
    assert found["Nysmith’s fit"] == f"{0.9 * nysmith:.1f} – {1.1 * nysmith:.1f}"
    caption = hole_table(snapshot, case).caption
    assert "band of ±10 %" in caption
    assert "not a target" in caption
    assert "no error bar" in caption


def test_other_projectiles_have_no_fit(case, snapshot):
    shell = case.bodies[0].model_copy(update={"name": "other"})
    several = case.model_copy(update={"bodies": (*case.bodies, shell)})
    sphere, plate = case.bodies
    fast = sphere.model_copy(update={"velocity": 11e3})
    small = sphere.model_copy(update={"radius": 2e-3})
    steel = {"al-lee2003": case.materials["al-lee2003"].model_copy(
        update={"composition": {"Fe": 1.0}})}  # fmt: skip
    for other in (
        several,
        case.model_copy(update={"bodies": (fast, plate)}),
        case.model_copy(update={"bodies": (small, plate)}),
        case.model_copy(update={"materials": steel}),
    ):
        table = hole_table(snapshot, other)
        assert not [row for row in table.rows if "fit" in row[0]]
        assert "Fits" not in table.caption


def test_a_wall_behind_the_bumper_leaves_the_fits(case, snapshot):
    wall = case.bodies[1].model_copy(update={"name": "wall", "position": 0.1})
    double = case.model_copy(update={"bodies": (*case.bodies, wall)})
    assert hole_table(snapshot, double).rows == hole_table(snapshot, case).rows


def test_both_measures_of_the_hole(case, snapshot, monkeypatch):
    hole = Hole(12.34e-3, 11.1e-3, 0.5e-3)
    monkeypatch.setattr(analysis, "measure_hole", lambda *_: hole)
    rows = hole_table(snapshot, case).rows
    assert rows[0] == ("computed, between the faces", "12.3")
    assert rows[1] == ("computed, through the lips", "11.1")
    assert rows[2] == ("grain of the measure", "0.5")


def test_without_a_plate_or_a_cloud_there_are_no_tables(finished, case, snapshot):
    sphere = case.model_copy(update={"bodies": case.bodies[:1], "measured": None})
    still = {**snapshot.arrays, "u_z": 0.0 * snapshot.arrays["u_z"]}
    assert analysis_tables(snapshot._replace(arrays=still), sphere) == []


@pytest.mark.parametrize("figure", ANALYSES, ids=lambda figure: figure.title)
def test_every_figure_can_be_drawn(case, snapshot, tmp_path, figure):
    figure.draw(snapshot, case, tmp_path / "new" / "figure.png")
    assert (tmp_path / "new" / "figure.png").stat().st_size > 10_000
    assert figure.caption


def test_what_is_broken_stands_below_the_fragments(case, snapshot):
    damage = (snapshot.arrays["id"] % 2).astype(float)
    arrays = {**snapshot.arrays, "damage": damage}
    found = find_fragments(arrays, cloud_definition(case))
    rows = fragments_table(snapshot._replace(arrays=arrays), case).rows
    share = 100 * found.broken / (found.broken + found.mass.sum())
    assert rows[-1][0] == "broken, in none"
    assert rows[-1][2:4] == (f"{share:.1f}", "–")
    assert sum(float(row[2]) for row in rows) <= 100.5
    arrays["damage"] = np.ones(damage.size)
    table = fragments_table(snapshot._replace(arrays=arrays), case)
    assert (table.title, len(table.rows)) == ("Fragments", 1)
