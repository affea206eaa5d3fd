"""The particles' storage and the table of their fields."""

import numpy as np
import pytest
from oracles import bits

from mpisph.core.particles import (
    FIELDS,
    INTEGRATED,
    LABELS,
    RATE,
    VALUES,
    Particles,
)

RATES = ("du_r", "du_z", "drho", "dE", "dS_rr", "dS_zz", "dS_rz", "dh")


def filled(n=6):
    p = Particles.zeros(n)
    rng = np.random.default_rng(1)
    p.labels[:] = rng.integers(-(2**62), 2**62, p.labels.shape)
    p.values[:] = rng.standard_normal(p.values.shape)
    return p


def test_every_field_is_one_line_of_the_table():
    names = tuple(f.name for f in FIELDS)
    assert len(set(names)) == len(names)
    assert LABELS + VALUES == names
    p = Particles.zeros(2)
    assert [getattr(p, name).shape for name in names] == [(2,)] * len(names)


def test_rates_have_rows_by_name_beside_what_they_change():
    assert RATE._fields == tuple(f"d{name}" for name in INTEGRATED)
    p = Particles.zeros(2)
    for name in RATE._fields:
        p.rates[getattr(RATE, name)] = 3.0
        assert getattr(p, name).tolist() == [3.0, 3.0]


def test_every_field_is_its_own_row_of_the_arrays():
    p = Particles.zeros(3)
    for k, name in enumerate(LABELS + VALUES):
        getattr(p, name)[:] = k
    np.testing.assert_array_equal(p.labels[:, 0], np.arange(3))
    np.testing.assert_array_equal(p.values[:, 2], np.arange(3, 3 + len(VALUES)))
    assert p.values.dtype == np.float64
    assert p.labels.dtype == np.int64


@pytest.mark.parametrize(
    ("view", "names"),
    [
        ("integrated", INTEGRATED),
        ("rates", RATES),
        ("stress", ("S_rr", "S_zz", "S_rz")),
    ],
)
def test_views_write_through_in_the_order_of_their_names(view, names):
    p = Particles.zeros(4)
    for k, name in enumerate(names):
        getattr(p, name)[:] = k + 1.0
    rows = getattr(p, view)
    assert rows.shape == (len(names), 4)
    np.testing.assert_array_equal(rows[:, 3], np.arange(len(names)) + 1.0)
    rows[:] = 7.0
    assert all((getattr(p, name) == 7.0).all() for name in names)
    assert (p.values == 7.0).sum() == 4 * len(names)


def test_rates_stand_in_the_order_of_what_they_change():
    roles = {f.name: f.role for f in FIELDS}
    units = {f.name: f.unit for f in FIELDS}
    assert tuple("d" + name for name in INTEGRATED) == RATES
    for name, rate in zip(INTEGRATED, RATES, strict=True):
        assert roles[name] == "state"
        assert roles[rate] == "rate"
        known = {"m/s2": "m/s", "kg/m3/s": "kg/m3", "W/kg": "J/kg", "m/s": "m"}
        known["Pa/s"] = "Pa"
        assert known[units[rate]] == units[name]


@pytest.mark.parametrize(
    "index", [[4, 0, 0], [], [True, False, True, False, False, True]]
)
def test_take_copies(index):
    p = filled()
    kind = bool if len(index) == 6 else np.intp
    taken = p.take(np.array(index, kind))
    want = np.arange(6)[np.array(index, kind)]
    np.testing.assert_array_equal(taken.labels, p.labels[:, want])
    np.testing.assert_array_equal(taken.values, p.values[:, want])
    assert taken.n == len(want)
    before = p.values.copy()
    taken.values[:] = 0.0
    np.testing.assert_array_equal(p.values, before)
    assert taken.values.flags.c_contiguous


@pytest.mark.parametrize("n", [0, 1, 6])
def test_packing_keeps_every_bit(n):
    p = filled(n)
    if n:
        p.id[0] = -1  # as a float its bits are a NaN
        p.body[-1] = 0x7FF0000000000001  # and these a signalling one
        p.u_r[0] = -0.0
        p.u_z[-1] = np.nan
    packed = p.pack()
    assert packed.shape == (len(FIELDS), n)
    again = Particles.unpack([packed[:, : n // 2], packed[:, n // 2 :]])
    np.testing.assert_array_equal(again.labels, p.labels)
    np.testing.assert_array_equal(bits(again.values), bits(p.values))
    assert again.n == n


def test_reorder_is_take_in_place():
    p = Particles.zeros(7)
    p.id[:] = np.arange(7)
    p.values[:] = np.random.default_rng(1).normal(size=p.values.shape)
    order = np.array([3, 0, 6, 1, 5, 2, 4])
    want, h = p.take(order), p.h
    p.reorder(order)
    np.testing.assert_array_equal(p.labels, want.labels)
    np.testing.assert_array_equal(p.values, want.values)
    assert h is p.h, "who holds a field sees the new order"


def test_zeros():
    p = Particles.zeros(5)
    assert p.n == 5
    assert not p.labels.any()
    assert not p.values.any()
