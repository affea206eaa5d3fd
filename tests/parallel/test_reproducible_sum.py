"""Sums whose bits depend on no number of ranks."""

import math
import os
import subprocess
import sys
from fractions import Fraction

import numpy as np
import pytest
from launch import TOP
from mpi4py import MPI

from mpisph.parallel.reproducible_sum import CHUNKS, fixed_point_chunks, from_chunks

SELF = MPI.COMM_SELF


def magnitude_bounds(comm, rows):
    """Return the largest magnitude of each row, infinite where there is a NaN."""
    bounds = np.abs(rows).max(axis=1, initial=0.0)
    bounds[np.isnan(bounds)] = np.inf
    comm.Allreduce(MPI.IN_PLACE, bounds, MPI.MAX)
    return bounds


def reproducible_sum(comm, rows, bounds):
    """Add up the chunks of all ranks."""
    total = fixed_point_chunks(rows, bounds)
    comm.Allreduce(MPI.IN_PLACE, total, MPI.SUM)
    return from_chunks(total, bounds)


def wide_rows(n=5000, seed=1):
    """Values of both signs over twelve decades, with heavy cancellation."""
    rng = np.random.default_rng(seed)
    rows = rng.standard_normal((3, n)) * 10.0 ** rng.uniform(-6, 6, (3, n))
    rows[2, : n // 2] = -rows[2, n // 2 :][::-1] * (1 + 1e-15)
    return rows


def fsums(rows):
    return np.array([math.fsum(row) for row in rows])


def shuffled_share(comm, n, seed):
    """Return this rank's share of 0..n-1, dealt at random; rank 0 gets none."""
    rng = np.random.default_rng(seed)
    owner = rng.integers(min(1, comm.size - 1), comm.size, n)
    ids = rng.permutation(n)
    return ids[owner[ids] == comm.rank]


def same_bits(one, other):
    return np.array_equal(
        np.asarray(one).view(np.int64), np.asarray(other).view(np.int64)
    )


def test_sum_is_correctly_rounded():
    rows = wide_rows()
    total = reproducible_sum(SELF, rows, magnitude_bounds(SELF, rows))
    assert same_bits(total, fsums(rows))
    # The plain sum is not: the test would not see a rounding otherwise.
    assert not same_bits(rows.sum(axis=1), fsums(rows))


def test_loose_bounds_change_nothing_that_they_may_not():
    rows = np.random.default_rng(2).uniform(0.5, 1.0, (1, 1000))
    for bound in (1.0, 3.0, 1000.0, 2.0**40):
        assert same_bits(reproducible_sum(SELF, rows, np.array([bound])), fsums(rows))


def test_error_stays_within_the_stated_bound():
    rng = np.random.default_rng(3)
    rows = rng.uniform(-1, 1, (1, 4000)) * 10.0 ** rng.uniform(-40, 0, (1, 4000))
    exact = sum(Fraction(x) for x in rows[0])
    high, middle, low, bad = (int(c) for c in fixed_point_chunks(rows, np.ones(1))[0])
    # 1.0 is below 2^1, so the last chunk counts 2^(1 - 3 * 34).
    got = Fraction(high * 2**68 + middle * 2**34 + low) * Fraction(2) ** (1 - 102)
    assert bad == 0
    assert 0 < abs(got - exact) <= rows.size * Fraction(2) ** (1 - 102)


def test_chunks_of_any_partition_add_up_to_the_same():
    rows = wide_rows()
    bounds = np.abs(rows).max(axis=1) * 1.7
    whole = fixed_point_chunks(rows, bounds)
    rng = np.random.default_rng(4)
    for parts in (2, 3, 17):
        owner = rng.integers(0, parts, rows.shape[1])
        order = rng.permutation(rows.shape[1])
        pieces = [rows[:, order[owner == k]] for k in range(parts)]
        total = sum(fixed_point_chunks(p, bounds) for p in pieces)
        np.testing.assert_array_equal(total, whole)


def test_many_largest_values_do_not_overflow():
    """2^29 - 1 values, each just below the power of two above the bound."""
    value = np.nextafter(1.0, 0.0)
    n = 2**29 - 1
    total = fixed_point_chunks(np.array([[value]]), np.array([value]))
    assert total[0, 0] * n < 2**63  # numpy would wrap round to a negative number
    assert from_chunks(total * n, np.array([value]))[0] == float(Fraction(value) * n)


@pytest.mark.parametrize("scale", [1e-250, 1e300])
def test_extreme_magnitudes(scale):
    rows = np.array([[1.0, 3.0, -2.0]]) * scale
    total = reproducible_sum(SELF, rows, np.abs(rows).max(axis=1))
    assert same_bits(total, fsums(rows))


def test_magnitudes_below_the_smallest_scale_count_as_zero():
    rows = np.full((1, 3), 5e-324)
    assert reproducible_sum(SELF, rows, np.array([5e-324]))[0] == 0.0


def test_zero_bound_and_no_values():
    assert reproducible_sum(SELF, np.zeros((1, 5)), np.zeros(1))[0] == 0.0
    assert reproducible_sum(SELF, np.zeros((2, 0)), np.ones(2)).tolist() == [0.0, 0.0]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1.5])
def test_a_value_beyond_its_bound_gives_nan_in_its_row_only(bad):
    rows = np.array([[0.5, bad], [0.5, 0.25]])
    total = reproducible_sum(SELF, rows, np.ones(2))
    assert math.isnan(total[0])
    assert total[1] == 0.75


def test_bounds_of_rows_with_nan_are_infinite_and_their_sum_is_nan():
    rows = np.array([[1.0, np.nan], [-3.0, 2.0]])
    bounds = magnitude_bounds(SELF, rows)
    assert bounds.tolist() == [np.inf, 3.0]
    assert np.isnan(reproducible_sum(SELF, rows, bounds)).tolist() == [True, False]


def test_chunks_have_the_documented_shape():
    assert fixed_point_chunks(np.ones((2, 3)), np.ones(2)).shape == (2, CHUNKS)


def test_jitted_part_equals_its_python_form():
    """The cut towards zero must be the same compiled and interpreted."""
    code = (
        "import numpy as np\n"
        "from mpisph.parallel.reproducible_sum import fixed_point_chunks\n"
        "rng = np.random.default_rng(6)\n"
        "rows = rng.standard_normal((2, 300)) * 10.0 ** rng.uniform(-30, 3, (2, 300))\n"
        "print(fixed_point_chunks(rows, np.abs(rows).max(axis=1)).tolist())\n"
    )
    outputs = [
        subprocess.run(
            [sys.executable, "-c", code],
            check=True,
            capture_output=True,
            text=True,
            cwd=TOP,
            env=clean_environment() | {"NUMBA_DISABLE_JIT": disable},
        ).stdout
        for disable in "01"
    ]
    assert outputs[0] == outputs[1]


def clean_environment():
    """Without what mpirun leaves: a child would think itself one of its ranks."""
    start = ("OMPI_", "PMIX_", "ORTE_", "PMI_")
    return {k: v for k, v in os.environ.items() if not k.startswith(start)}


@pytest.mark.mpi(min_size=1)
def test_sums_have_the_same_bits_on_all_partitions():
    comm = MPI.COMM_WORLD
    rows = wide_rows()
    for seed in range(5):
        mine = rows[:, shuffled_share(comm, rows.shape[1], seed)]
        bounds = magnitude_bounds(comm, mine)
        assert same_bits(bounds, np.abs(rows).max(axis=1))
        assert same_bits(reproducible_sum(comm, mine, bounds), fsums(rows))


@pytest.mark.mpi(min_size=2)
def test_a_nan_on_one_rank_is_seen_by_all():
    comm = MPI.COMM_WORLD
    rows = np.ones((1, 3))
    if comm.rank == comm.size - 1:
        rows[0, 1] = np.nan
    assert np.isnan(reproducible_sum(comm, rows, np.ones(1))[0])
    assert magnitude_bounds(comm, rows)[0] == np.inf


def whole_numbers(rng, bits):
    """Whole numbers of either sign and of up to so many bits, with many ties."""
    size = int(rng.integers(0, bits + 1))
    number = int.from_bytes(rng.bytes(16)) % 2**size if size else 0
    keep = int(rng.integers(0, bits))
    return int(rng.choice([-1, 1])) * ((number >> keep) << keep)


def test_chunks_are_rounded_as_python_rounds_whole_numbers():
    """`float()` of a Python integer is correctly rounded, ties to even."""
    rng = np.random.default_rng(7)
    chunks = [[whole_numbers(rng, b) for b in (62, 62, 62)] for _ in range(3000)]
    chunks += [[0, 0, 2**53 + 1], [0, 1 << 33, 1], [-1, 0, 1], [0, -1, 0], [0, 0, 0]]
    total = np.array([[*each, 0] for each in chunks])
    found = from_chunks(total, np.ones(len(chunks)))
    exponent = 1 - 102  # of the bound 1, and of three chunks of 34 bits
    want = [
        math.ldexp(float((high << 68) + (middle << 34) + low), exponent)
        for high, middle, low in chunks
    ]
    assert found.tolist() == want
