"""Counting the arithmetic of an interaction, and the peak of a core."""

import numpy as np
import pytest
from bench_records import measurement, record

from mpisph.bench import flops
from mpisph.bench.flops import Counting, measure_arithmetic
from mpisph.bench.record import Arithmetic, Spread
from mpisph.bench.tables import tables
from mpisph.core.errors import MpisphError


@pytest.mark.parametrize(
    ("formula", "operations"),
    [
        (lambda x: x * x + 3.0 / x - 1.0, 4),
        (lambda x: 2.0 * (1.0 - x) + (x + np.float64(2.0)), 4),
        (lambda x: np.float64(2.0) * x / (np.float64(1.0) - x), 3),
        (lambda x: -abs(x) if x > 0.5 else x * x, 0),
    ],
)
def test_each_addition_multiplication_and_division_counts_once(formula, operations):
    Counting.done = 0
    found = formula(Counting(1.25))
    assert Counting.done == operations
    assert found == formula(1.25)


def test_an_interaction_takes_some_hundred_operations_and_a_core_some_1e9():
    """Kernel and exponential alone take 50; 15 sums, each with a product, 30."""
    found = measure_arithmetic()
    assert 150.0 < found.flops < 400.0
    assert found.flops == int(found.flops), "each neighbour takes as many"
    assert found.bytes == 3 * 16 * 8
    assert 5e8 < found.peak < 1e12


def test_what_cannot_be_counted_is_an_error(monkeypatch):
    monkeypatch.setattr(flops, "__name__", "mpisph.nothing_of_this_name")
    with pytest.raises(MpisphError, match="nothing_of_this_name"):
        measure_arithmetic()


def test_the_table_sets_the_pair_loop_beside_the_peak():
    one = measurement("block", 1.0).model_copy(
        update={"timers": {"pair loop": Spread.of([10.0])}}
    )
    known = Arithmetic(flops=250.0, bytes=400.0, peak=50e9)
    found = record().model_copy(update={"measurements": (one,), "arithmetic": known})
    (table,) = [t for t in tables(found) if "Arithmetic" in str(t.title)]
    cells = [next(iter(column.cells)) for column in table.columns]
    assert cells == ["block", "1", "25.0", "50%", "40.0"]
