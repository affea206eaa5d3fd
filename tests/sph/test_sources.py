"""What the pair loop reads: owned and ghosts in one global order."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import (
    ALUMINIUM,
    COPPER,
    agree,
    bits,
    cloud,
    cut_at,
    evaluate,
    sent_fields,
    table_of,
)

from mpisph.core.particles import (
    CORRECTION,
    FIELDS,
    HISTORY,
    INTEGRATED,
    RESPONSE,
    VALUE,
)
from mpisph.parallel.decomposition import owners
from mpisph.parallel.halo import Halo, bounding_box, boxes, exchange_halo, reach
from mpisph.physics.response import OF_VALUES, respond_rows
from mpisph.sph.sources import (
    AHEAD,
    EXCHANGED,
    LAST,
    OF_AHEAD,
    Sources,
    look_ahead,
    name_fields,
    note_changes,
)


def test_the_state_ahead_has_every_field_at_its_time_r11():
    """Labels keep their bits, rates count from now, extrapolations from the last."""
    p = cloud(9, 1)
    p.id[0] = -1  # as a float its bits are a NaN
    rng = np.random.default_rng(2)
    for rates in (p.rates, p.correction_rates, p.ddiv):
        rates[:] = rng.standard_normal(rates.shape)
    for name in (*HISTORY, "melt"):
        getattr(p, name)[:] = rng.uniform(size=9)
    before, last = p.values.copy(), np.empty((len(LAST), 9))
    ahead = np.full((len(AHEAD), 9), np.nan)
    look_ahead(p, 0.25, 0.5, ahead, last)
    before[[VALUE.w_r, VALUE.w_z]] = p.integrated[:2] + 0.25 * p.rates[:2]
    np.testing.assert_array_equal(bits(p.values), bits(before))
    np.testing.assert_array_equal(last, [getattr(p, name) for name in LAST])
    want = {name: getattr(p, name) for name in AHEAD}
    want |= zip(INTEGRATED, p.integrated + 0.25 * p.rates, strict=True)
    want |= zip(CORRECTION, p.correction + 0.5 * p.correction_rates, strict=True)
    want["div"] = p.div + 0.5 * p.ddiv
    for row, name in zip(ahead, AHEAD, strict=True):
        if name in RESPONSE and name != "melt":
            assert np.isnan(row).all(), name
        else:
            np.testing.assert_array_equal(bits(row), bits(want[name]), err_msg=name)


def test_the_response_ahead_is_that_of_the_same_particles_r11():
    p = cloud(40, 5, n_materials=2)
    table = table_of(ALUMINIUM, COPPER)
    ahead = np.empty((len(AHEAD), p.n))
    look_ahead(p, 0.0, 0.0, ahead, np.empty((len(LAST), p.n)))
    before = bits(p.values)
    respond_rows(p.id, p.material, ahead, OF_AHEAD, table, 0.01, 1e-9)
    np.testing.assert_array_equal(bits(p.values), before)
    respond_rows(p.id, p.material, p.values, OF_VALUES, table, 0.01, 1e-9)
    for name in (*RESPONSE, *HISTORY, *INTEGRATED):
        np.testing.assert_array_equal(ahead[AHEAD.index(name)], getattr(p, name), name)
    assert p.plastic_strain.any()


def test_changes_are_noted_as_rates_r11():
    p = cloud(9, 1)
    rng = np.random.default_rng(4)
    last = rng.standard_normal((len(LAST), p.n))
    others = p.values.copy()
    note_changes(p.values, last, 0.5)
    np.testing.assert_array_equal(p.ddiv, (p.div - last[0]) / 0.5)
    np.testing.assert_array_equal(p.correction_rates, (p.correction - last[1:]) / 0.5)
    changed = (bits(p.values) != bits(others)).any(axis=1)
    assert changed.sum() == len(LAST)


def test_sources_name_what_is_exchanged():
    assert Sources._fields == EXCHANGED
    assert EXCHANGED == tuple(f.name for f in FIELDS if f.exchanged)


def test_name_fields():
    p = cloud(40, 3, n_materials=2)
    p.id[:] += 2**53 + 1  # beyond what a float could count
    fields = np.empty((len(AHEAD), p.n))
    look_ahead(p, 0.0, 0.0, fields, np.empty((len(LAST), p.n)))
    s = name_fields(fields[: len(EXCHANGED)])
    for name in set(EXCHANGED) - {"P", "c"}:
        want = getattr(p, name)
        np.testing.assert_array_equal(getattr(s, name), want)
        assert getattr(s, name).dtype == want.dtype
    fields[[AHEAD.index("P"), AHEAD.index("c")]] = [[1.0], [2.0]]
    assert (s.P[0], s.c[0]) == (1.0, 2.0)


def rates_by_id(p):
    written = np.vstack([p.rates, p.div, p.neighbours])
    return dict(zip(p.id.tolist(), bits(written.T).tolist(), strict=True))


def with_parts(owner, comm, rank):
    """Return the rates of one rank's particles, with ghosts from the others."""
    whole = cloud(400, 4, h_spread=3.0)
    mine = whole.take(owner == rank)
    if comm is None:
        rest = whole.take(owner != rank)
        ghosts, _ = sent_fields(rest)
    else:
        rank_boxes = np.array(comm.allgather(bounding_box(mine.values, 3.0, 0.0)))
        fields, _ = sent_fields(mine)
        half = reach(mine.h, 3.0)
        these = boxes(mine.r, mine.z, half, half)
        ghosts = exchange_halo(comm, fields, these, rank_boxes, Halo())
    return rates_by_id(evaluate(mine, ghosts=ghosts))


def test_rates_have_the_same_bits_however_particles_are_owned():
    want = rates_by_id(evaluate(cloud(400, 4, h_spread=3.0)))
    for parts in (2, 5):
        owner = np.random.default_rng(parts).integers(0, parts, 400)
        got = {}
        for rank in range(parts):
            got |= with_parts(owner, None, rank)
        assert got == want


@pytest.mark.mpi(min_size=1)
def test_rates_have_the_same_bits_on_any_number_of_ranks():
    """Slabs with their halo give what one rank with all particles does."""
    comm = MPI.COMM_WORLD
    whole = cloud(400, 4, h_spread=3.0)
    edges = np.linspace(-4e-3, 5e-3, comm.size + 1)[1:-1]
    cut = cut_at(*edges)
    want = rates_by_id(evaluate(cloud(400, 4, h_spread=3.0)))
    got = with_parts(owners(cut, whole.r, whole.z), comm, comm.rank)
    wrong = [a for a, rates in got.items() if rates != want[a]]
    total = comm.allreduce(len(got))
    agree(comm, wrong)
    assert total == 400
