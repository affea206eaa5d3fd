"""The best set of parameters: hand-made histories whose sizes are straight lines."""

import csv
import io

import pytest
from launch import CASES

from mpisph.core.errors import MpisphError
from mpisph.io.history import HEADER
from mpisph.study.model import load_study
from mpisph.study.paper.best import best_sets, write_best
from mpisph.study.store import case_folder

TEXT = f"""
title = "small"
clock_from = "twice"

[[variants]]
name = "once"
base = "{CASES / "piekutowski-4-1352.toml"}"

[[variants]]
name = "twice"
base = "{CASES / "piekutowski-4-1353.toml"}"

[[parameters]]
name = "alpha"
key = "scheme.viscosity.alpha"
values = [1.0, 2.5, 5.0]
"""

# Shot 4-1352: R_b 17.7 mm, L_b 36.4 mm at 6 us. Shot 4-1353: 15.3, 31.7 mm at 6 us and
# 37.5, 98.0 mm at 19 us.
OFFSET = 1e-6


@pytest.fixture
def study(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(TEXT)
    return load_study(path)


def history(end, sizes):
    """Lines whose R_b and L_b [m] pass through `sizes` at times [s]."""
    lines = [",".join(HEADER)]
    for time, radius, length in [*sizes, (end, *sizes[-1][1:])]:
        row = dict.fromkeys(HEADER, 0.0) | {
            "step": 0,
            "time_s": time,
            "cloud_radius_m": radius,
            "cloud_length_m": length,
        }
        lines.append(",".join(map(repr, row.values())))
    return "\n".join(lines) + "\n"


def write(root, case, end, sizes):
    folder = case_folder(root, case)
    folder.mkdir(parents=True)
    (folder / "history.csv").write_text(history(end, sizes))


def runs(study, root, offset=OFFSET, end=9e-6, excess=1.0):
    """Runs that grow linearly and are `excess` times what was measured."""
    rows = []
    for case in study.cases:
        r, l = {"once": (17.7e-3, 36.4e-3), "twice": (15.3e-3, 31.7e-3)}[case.variant]
        factor = excess * case.settings["alpha"]
        at = [
            (5e-6 + offset, factor * r - 1e-3, factor * l - 2e-3),
            (7e-6 + offset, factor * r + 1e-3, factor * l + 2e-3),
        ]
        row = {"variant": case.variant, **case.settings, "status": "completed"}
        if case.variant == "twice":
            at += [(19e-6 + offset, 37.5e-3, 2 * 98.0e-3)]
            row["fitted_offset_us"] = 1e6 * offset
        write(root, case, 22e-6 if case.variant == "twice" else end, at)
        rows.append(row)
    return rows


def test_sizes_are_interpolated_at_the_fitted_time(study, tmp_path):
    rows = runs(study, tmp_path, offset=1.37e-6)
    best = best_sets(study, rows, tmp_path)[0]
    assert best.settings == {"alpha": 1.0}
    assert (best.offset_us, best.fitted) == (pytest.approx(1.37), True)
    wanted = {
        "once_R_b_6us_error_percent": 0.0,
        "once_L_b_6us_error_percent": 0.0,
        "twice_R_b_6us_error_percent": 0.0,
        "twice_L_b_6us_error_percent": 0.0,
        "twice_R_b_19us_error_percent": 0.0,
        "twice_L_b_19us_error_percent": 100.0,
    }
    assert best.errors == pytest.approx(wanted, abs=1e-9)


def test_the_best_comes_first_by_the_largest_error_at_common_exposures(study, tmp_path):
    rows = runs(study, tmp_path, excess=0.4)
    sets = best_sets(study, rows, tmp_path)
    # Factors 1.0, 0.4 and 2.0.
    assert [s.settings["alpha"] for s in sets] == [2.5, 1.0, 5.0]
    assert [s.max_percent for s in sets] == pytest.approx([0.0, 60.0, 100.0], abs=1e-9)
    assert [s.mean_percent for s in sets] == pytest.approx([0.0, 60.0, 100.0], abs=1e-9)


def test_largest_and_mean_are_of_absolute_errors(study, tmp_path):
    rows = runs(study, tmp_path)
    case = study.cases[0]
    path = case_folder(tmp_path, case) / "history.csv"
    sizes = [(0.0, 0.0, 0.0), (7e-6, 0.9 * 17.7e-3, 1.02 * 36.4e-3)]
    path.write_text(history(9e-6, sizes))
    best = best_sets(study, rows, tmp_path)[0]
    assert best.errors["once_R_b_6us_error_percent"] == pytest.approx(-10.0)
    assert best.max_percent == pytest.approx(10.0)
    assert best.mean_percent == pytest.approx((10.0 + 2.0) / 4)


def test_every_set_is_judged_by_the_stated_offsets_too(study, tmp_path):
    rows = runs(study, tmp_path, offset=1.37e-6)
    file = study.file.model_copy(update={"clock_offsets": (0.87e-6,)})
    sets = best_sets(study._replace(file=file), rows, tmp_path)
    assert len(sets) == 6
    one = [s for s in sets if s.settings == {"alpha": 1.0}]
    assert [s.fitted for s in one] == [True, False]
    assert [s.offset_us for s in one] == pytest.approx([1.37, 0.87])
    # Half a microsecond earlier, where R_b grows by 1 mm/us and L_b by 2.
    wanted = {"R_b": -0.5 / 17.7, "L_b": -1.0 / 36.4}
    for name, error in wanted.items():
        found = one[1].errors[f"once_{name}_6us_error_percent"]
        assert found == pytest.approx(100.0 * error)


def test_without_a_fit_the_cases_own_offset_serves(study, tmp_path):
    rows = runs(study, tmp_path, offset=0.89e-6)
    for row in rows:
        row.pop("fitted_offset_us", None)
    best = best_sets(study, rows, tmp_path)[0]
    assert (best.offset_us, best.fitted) == (pytest.approx(0.89), False)
    assert best.max_percent == pytest.approx(0.0, abs=1e-9)


def test_a_run_that_ends_too_early_has_no_error(study, tmp_path):
    rows = runs(study, tmp_path)
    path = case_folder(tmp_path, study.cases[0]) / "history.csv"
    path.write_text(history(6.9e-6, [(0.0, 0.0, 0.0), (6e-6, 17.7e-3, 36.4e-3)]))
    last = best_sets(study, rows, tmp_path)[-1]
    assert last.settings == {"alpha": 1.0}
    assert last.errors["once_R_b_6us_error_percent"] is None
    assert last.errors["twice_R_b_6us_error_percent"] == pytest.approx(0.0, abs=1e-9)
    assert (last.max_percent, last.mean_percent) == (None, None)


def test_an_unstable_run_has_no_error(study, tmp_path):
    rows = runs(study, tmp_path)
    rows[0]["status"] = "unstable"
    assert best_sets(study, rows, tmp_path)[-1].settings == {"alpha": 1.0}


def test_the_table_begins_with_the_best(study, tmp_path):
    path = write_best(study, tmp_path, runs(study, tmp_path, excess=0.4))
    lines = list(csv.DictReader(io.StringIO(path.read_text())))
    assert [x["alpha"] for x in lines] == ["2.5", "1.0", "5.0"]
    assert float(lines[1]["max_percent"]) == pytest.approx(60.0)
    assert float(lines[1]["once_L_b_6us_error_percent"]) == pytest.approx(-60.0)
    assert lines[0]["fitted"] == "True"


def test_without_clock_from_there_is_no_table(study, tmp_path):
    bare = study._replace(file=study.file.model_copy(update={"clock_from": None}))
    assert write_best(bare, tmp_path, runs(study, tmp_path)) is None


def test_what_is_no_history_is_reported(study, tmp_path):
    rows = runs(study, tmp_path)
    path = case_folder(tmp_path, study.cases[0]) / "history.csv"
    path.write_text("nonsense\n")
    with pytest.raises(MpisphError, match="not a history"):
        best_sets(study, rows, tmp_path)
