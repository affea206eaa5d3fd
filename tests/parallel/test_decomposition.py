"""Cuts into parts of equal work."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree

from mpisph.parallel.decomposition import (
    BINS,
    Cut,
    equal_shares,
    equal_work_cut,
    extent,
    owners,
    part_work,
)
from mpisph.parallel.load_balance import (
    work_of,
)


def slabs_only(*edges):
    return Cut(np.array(edges), np.empty((len(edges) + 1, 0)))


def test_owners_of_slabs():
    cut = slabs_only(-1.0, 2.0, 2.0)
    z = np.array([-9.0, -1.0, 0.0, 1.9, 2.0, 7.0])
    r = np.linspace(0.0, 1.0, 6)
    assert owners(cut, r, z).tolist() == [0, 1, 1, 1, 3, 3]
    assert owners(slabs_only(), r, z).tolist() == [0] * 6
    assert owners(cut, r[:0], z[:0]).dtype == np.int64
    assert (cut.slabs, cut.columns) == (4, 1)


def test_owners_of_slabs_and_columns():
    """Each slab has columns of its own; a particle on an edge lies above it."""
    cut = Cut(np.array([0.0]), np.array([[1.0, 2.0], [5.0, 5.0]]))
    z = np.array([-1.0, -1.0, -1.0, -1.0, 0.0, 3.0, 3.0])
    r = np.array([0.0, 1.0, 1.9, 2.0, 4.9, 5.0, 9.0])
    assert owners(cut, r, z).tolist() == [0, 1, 1, 2, 3, 5, 5]
    assert (cut.slabs, cut.columns) == (2, 3)


def test_owners_agree_with_brute_force():
    rng = np.random.default_rng(4)
    cut = Cut(np.sort(rng.uniform(0, 1, 3)), np.sort(rng.uniform(0, 1, (4, 4))))
    r, z = rng.uniform(0, 1, (2, 500))
    want = [
        sum(e <= b for e in cut.z_edges) * 5
        + sum(e <= a for e in cut.r_edges[sum(e <= b for e in cut.z_edges)])
        for a, b in zip(r, z, strict=True)
    ]
    got = owners(cut, r, z)
    assert got.tolist() == want
    assert len(set(want)) > 12


def test_equal_shares_lie_at_the_nearer_border_of_a_bin():
    assert equal_shares(np.array([9.0, 20.0, 11.0]), 2).tolist() == [2]
    assert equal_shares(np.array([11.0, 20.0, 9.0]), 2).tolist() == [1]
    assert equal_shares(np.ones(6), 3).tolist() == [2, 4]
    assert equal_shares(np.ones(6), 1).tolist() == []
    assert equal_shares(np.zeros(6), 3).tolist() == [0, 0]


SHAPES = {
    # slabs of as many ranks
    "z": lambda size: (size, 1),
    "r": lambda size: (1, size),
    "zr": lambda size: (3, size),  # more parts than ranks: a cut is data
}


EVERY_SHAPE = pytest.mark.parametrize("shape", SHAPES.values(), ids=list(SHAPES))


def distributions():
    """Return r, z and work of all particles: even, clustered, with far strays."""
    rng = np.random.default_rng(1)
    n = 6000
    even = rng.uniform(-3e-3, 5e-3, n)
    clustered = np.concatenate([rng.normal(0.0, 1e-4, n // 2), rng.uniform(0, 0.1, n)])
    strays = np.concatenate([even, [-0.5, 0.9]])
    for z in (even, clustered, strays):
        # Cells of a size that follows z, so that each slab has columns of its own.
        r = (1.0 + 50.0 * np.abs(z)) * rng.uniform(0.0, 5e-3, z.size)
        yield r, z, work_of(rng.integers(0, 120, z.size).astype(float))


def share(comm, n):
    """Return a mask of this rank's particles; the last of several ranks has none."""
    owner = np.random.default_rng(2).integers(0, max(comm.size - 1, 1), n)
    return owner == comm.rank


def misplaced(x, work, edges, bins):
    """Return what is wrong with edges that should share out the work equally."""
    problems = [] if (np.diff(edges) >= 0.0).all() else [f"not ascending: {edges}"]
    width = np.ptp(x) / (bins - 1)
    for k, edge in enumerate(edges):
        below = work[x < edge].sum()
        target = work.sum() * (k + 1) / (edges.size + 1)
        bin_work = work[np.abs(x - edge) <= width * (1.0 + 1e-9)].sum()
        if abs(below - target) > bin_work:
            problems.append(f"work below {edge}: {below}, meant {target}")
    return problems


@pytest.mark.mpi(min_size=1)
@EVERY_SHAPE
def test_parts_have_equal_work_within_a_bin(shape):
    comm = MPI.COMM_WORLD
    slabs, columns = shape(comm.size)
    problems = []
    for r, z, work in distributions():
        mine = share(comm, z.size)
        cut = equal_work_cut(comm, r[mine], z[mine], work[mine], slabs, columns)
        flat = np.concatenate([cut.z_edges, cut.r_edges.ravel()])
        if not all(np.array_equal(flat, other) for other in comm.allgather(flat)):
            problems.append(f"ranks disagree: {cut}")
        if (cut.slabs, cut.columns) != (slabs, columns):
            problems.append(f"{cut.slabs} x {cut.columns}")
        problems += misplaced(z, work, cut.z_edges, BINS)
        slab = np.searchsorted(cut.z_edges, z, side="right")
        for k, edges in enumerate(cut.r_edges):
            inside = slab == k
            problems += misplaced(r[inside], work[inside], edges, BINS // slabs)
    agree(comm, problems)


@pytest.mark.parametrize("layers", [5, 17, 44, 130])
@pytest.mark.parametrize("spacing", [0.1, 1 / 3, 1.7e-4])
def test_layers_of_a_lattice_are_shared_out_whole(layers, spacing):
    """Rounding must not carry a layer across a border, wherever the borders lie."""
    z = np.repeat(-0.3 + spacing * (0.5 + np.arange(layers)), 10)
    r = np.tile(np.arange(10.0), layers)
    work = np.ones(z.size)
    for cut, owner_at in (
        (equal_work_cut(MPI.COMM_SELF, r, z, work, 4, 1), (r, z)),
        (equal_work_cut(MPI.COMM_SELF, z, r, work, 1, 4), (z, r)),
    ):
        counts = np.bincount(owners(cut, *owner_at), minlength=4)
        # The border nearest to a quarter is at most half a layer from it.
        below = np.abs(np.cumsum(counts)[:3] - z.size * np.arange(1, 4) / 4)
        assert below.max() <= 5.0


@pytest.mark.mpi(min_size=1)
@EVERY_SHAPE
def test_the_cut_does_not_depend_on_who_owns_what(shape):
    comm = MPI.COMM_WORLD
    r, z, work = next(distributions())
    ways = (share(comm, z.size), slice(comm.rank, None, comm.size))
    cuts = [equal_work_cut(comm, r[m], z[m], work[m], *shape(comm.size)) for m in ways]
    same = all(np.array_equal(a, b) for a, b in zip(*cuts, strict=True))
    agree(comm, [] if same else cuts)


@pytest.mark.mpi(min_size=1)
@EVERY_SHAPE
def test_particles_in_one_place_and_none_at_all(shape):
    comm = MPI.COMM_WORLD
    slabs, columns = shape(comm.size)
    place = np.full(5, 0.25)
    cut = equal_work_cut(comm, place, place, np.ones(5), slabs, columns)
    nothing = equal_work_cut(comm, place[:0], place[:0], place[:0], slabs, columns)
    problems = []
    if len(set(owners(cut, place, place).tolist())) != 1:
        problems.append("one place, several owners")
    for found in (cut, nothing):
        sizes = (found.z_edges.size, found.r_edges.shape)
        if sizes != (slabs - 1, (slabs, columns - 1)):
            problems.append(found)
        if not all(np.isfinite(edges).all() for edges in found):
            problems.append(found)
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_extent_of_groups():
    comm = MPI.COMM_WORLD
    x = np.array([3.0, 1.0, 2.0]) + comm.rank
    low, high = extent(comm, x, np.array([0, 0, 2]), 3)
    last = comm.size - 1
    assert low.tolist() == [1.0, 0.0, 2.0]
    assert high.tolist() == [3.0 + last, 0.0, 2.0 + last]


@pytest.mark.mpi(min_size=1)
def test_part_work_is_that_of_all_ranks():
    comm = MPI.COMM_WORLD
    _, z, work = next(distributions())
    owner = np.random.default_rng(3).integers(0, comm.size, z.size)
    mine = share(comm, z.size)
    got = part_work(comm, owner[mine], work[mine])
    want = [work[owner == rank].sum() for rank in range(comm.size)]
    agree(comm, [] if got.tolist() == want else [got, want])
