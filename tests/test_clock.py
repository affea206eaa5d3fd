"""The fit of the experiment's clock."""

import numpy as np
import pytest
from launch import CASES

from mpisph.case import load_case
from mpisph.clock import fit_clock

OFFSET = 0.83e-6


def history(case, end, error=0.0):
    """A cloud that passes through all measured sizes at the offset times."""
    time = np.linspace(0.0, end, 4001)
    rows = np.zeros(
        time.size, [(n, "f8") for n in ("time", "cloud_radius", "cloud_length")]
    )
    first, last = case.measured.exposures
    rows["time"] = time
    for column, a, b in (
        ("cloud_radius", first.radius, last.radius),
        ("cloud_length", first.length, last.length),
    ):
        speed = (b - a) / (last.time - first.time)
        rows[column] = a + speed * (time - OFFSET - first.time)
    rows["cloud_radius"] *= 1.0 + error
    return rows


@pytest.fixture(scope="module")
def case():
    return load_case(CASES / "piekutowski-4-1353.toml")


def test_the_offset_that_was_put_in_is_found(case):
    fit = fit_clock(history(case, 22e-6), case)
    assert fit.offset == pytest.approx(OFFSET, abs=2e-9)
    assert fit.errors == pytest.approx(np.zeros(4), abs=1e-3)
    assert fit.separate == pytest.approx([OFFSET] * 4, abs=2e-9)
    assert fit.names[:2] == ("R_b at 6 us", "L_b at 6 us")


def test_a_figure_that_disagrees_shows_in_its_own_offset(case):
    fit = fit_clock(history(case, 23e-6, error=0.05), case)
    assert fit.separate[[1, 3]] == pytest.approx([OFFSET] * 2, abs=2e-9)
    assert (fit.separate[[0, 2]] < OFFSET - 0.3e-6).all()
    assert OFFSET - 0.3e-6 < fit.offset < OFFSET


def test_what_cannot_be_fitted_is_refused(case):
    with pytest.raises(ValueError, match="let it run past"):
        fit_clock(history(case, 19.5e-6), case)
    with pytest.raises(ValueError, match="ends before"):
        fit_clock(history(case, 12e-6), case)
    bare = case.model_copy(update={"measured": None})
    with pytest.raises(ValueError, match="no measured exposure"):
        fit_clock(history(case, 22e-6), bare)
