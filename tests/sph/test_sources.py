"""What the pair loop reads: owned and ghosts in one global order."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, bits, cloud, evaluate, sent_fields

from mpisph.core.particles import FIELDS, INTEGRATED
from mpisph.parallel.decomposition import Cut, owners
from mpisph.parallel.halo import Halo, bounding_box, boxes, exchange_halo, reach
from mpisph.sph.sources import EXCHANGED, Sources, exchanged_fields, name_fields


def test_exchanged_fields_are_those_of_the_table():
    p = cloud(9, 1)
    p.id[0] = -1  # as a float its bits are a NaN
    integrated = np.random.default_rng(2).standard_normal(p.integrated.shape)
    div = np.random.default_rng(3).standard_normal(9)
    ahead = {**dict(zip(INTEGRATED, integrated, strict=True)), "div": div}
    packed = exchanged_fields(p, ahead)
    names = [f.name for f in FIELDS if f.exchanged]
    assert names == list(EXCHANGED)
    assert packed.shape == (len(names), 9)
    for row, name in zip(packed, names, strict=True):
        if name in INTEGRATED:
            want = integrated[INTEGRATED.index(name)]
        elif name == "div":
            want = div
        else:
            want = getattr(p, name)
        np.testing.assert_array_equal(bits(row), bits(want), err_msg=name)


def test_sources_name_what_is_exchanged():
    assert Sources._fields == EXCHANGED


def test_name_fields():
    p = cloud(40, 3, n_materials=2)
    p.id[:] += 2**53 + 1  # beyond what a float could count
    s = name_fields(exchanged_fields(p, {}))
    for name in EXCHANGED:
        want = getattr(p, name)
        np.testing.assert_array_equal(getattr(s, name), want)
        assert getattr(s, name).dtype == want.dtype


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
        rank_boxes = np.array(comm.allgather(bounding_box(mine, 3.0, 0.0)))
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
    cut = Cut(edges, np.empty((comm.size, 0)))
    want = rates_by_id(evaluate(cloud(400, 4, h_spread=3.0)))
    got = with_parts(owners(cut, whole.r, whole.z), comm, comm.rank)
    wrong = [a for a, rates in got.items() if rates != want[a]]
    total = comm.allreduce(len(got))
    agree(comm, wrong)
    assert total == 400
