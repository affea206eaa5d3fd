"""Cuts into parts of equal work."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, cut_at

from mpisph.parallel.decomposition import (
    BINS,
    FEWEST_BINS,
    SWITCH_GAIN,
    Level,
    equal_work_cut,
    extent,
    nearest_border,
    owners,
    part_work,
)
from mpisph.parallel.load_balance import work_of

ALONE = MPI.COMM_SELF


def test_owners_of_slabs_and_of_columns():
    """A particle on an edge lies above it; a part may be empty."""
    x = np.array([-9.0, -1.0, 0.0, 1.9, 2.0, 7.0])
    other = np.linspace(0.0, 1.0, 6)
    edges = (-1.0, 2.0, 2.0)
    assert owners(cut_at(*edges), other, x).tolist() == [0, 1, 1, 1, 3, 3]
    assert owners(cut_at(*edges, along_r=True), x, other).tolist() == [0, 1, 1, 1, 3, 3]
    assert owners((), other, x).tolist() == [0] * 6
    assert owners(cut_at(*edges), other[:0], x[:0]).dtype == np.int64


def test_owners_of_halves_in_both_directions():
    """Three parts: below z = 0 one, above it two that meet at r = 5."""
    cut = (
        Level(np.array([False]), np.array([0.0]), np.array([0])),
        Level(np.array([False, True]), np.array([np.nan, 5.0]), np.array([0, 1])),
    )
    r, z = np.array([[0.0, 9.0, 4.9, 5.0, 9.0], [-1.0, -1e9, 0.0, 3.0, 3.0]])
    assert owners(cut, r, z).tolist() == [0, 0, 1, 2, 2]


def test_the_border_is_that_nearest_to_the_share():
    work = np.array([[9.0, 20.0, 11.0], [11.0, 20.0, 9.0], [1.0, 1.0, 1.0]])
    border, missed = nearest_border(work, np.array([0.5, 0.5, 1 / 3]))
    assert border.tolist() == [2, 1, 1]
    assert missed.tolist() == [9.0, 9.0, 0.0]
    border, missed = nearest_border(np.zeros((2, 3)), np.array([0.5, 0.0]))
    assert border.tolist() == [0, 0]
    assert missed.tolist() == [0.0, 0.0]


EVERY_MODE = pytest.mark.parametrize("mode", ["auto", "z", "r"])


def distributions():
    """Return r, z, reach, work of all particles: even, clustered, with far strays."""
    rng = np.random.default_rng(1)
    n = 6000
    even = rng.uniform(-3e-3, 5e-3, n)
    clustered = np.concatenate([rng.normal(0.0, 1e-4, n // 2), rng.uniform(0, 0.1, n)])
    strays = np.concatenate([even, [-0.5, 0.9]])
    for z in (even, clustered, strays):
        # Of a size that follows z, so that halves differ.
        r = (1.0 + 50.0 * np.abs(z)) * rng.uniform(0.0, 5e-3, z.size)
        work = work_of(rng.integers(0, 120, z.size).astype(float))
        yield r, z, np.full(z.size, 1e-4), work


def share(comm, n):
    """Return a mask of this rank's particles; the last of several ranks has none."""
    owner = np.random.default_rng(2).integers(0, max(comm.size - 1, 1), n)
    return owner == comm.rank


def cut_of(comm, particles, mine, parts, mode="auto", current=()):
    return equal_work_cut(comm, *(x[mine] for x in particles), parts, mode, current)


def misplaced(cut, parts, r, z, work):
    """Return what is wrong with cuts that should halve the parts and their work."""
    problems, sizes = [], [parts]
    for number, level in enumerate(cut):
        group, bins = owners(cut[:number], r, z), max(BINS // len(sizes), FEWEST_BINS)
        for k, size in enumerate(sizes):
            edge, inside = level.edges[k], group == k
            if size == 1:
                problems += [] if np.isnan(edge) else [f"a part is cut at {edge}"]
                continue
            x, w = (r if level.along_r[k] else z)[inside], work[inside]
            below, target = w[x < edge].sum(), w.sum() * (size // 2) / size
            width = np.ptp(x) / (bins - 1)
            bin_work = w[np.abs(x - edge) <= width * (1.0 + 1e-9)].sum()
            if abs(below - target) > bin_work:
                problems.append(f"work below {edge}: {below}, meant {target}")
        halves = [half for n in sizes for half in (n // 2, n - n // 2)]
        sizes = [half for half in halves if half > 0]
    return problems if sizes == [1] * parts else [*problems, f"parts {sizes}"]


@pytest.mark.mpi(min_size=1)
@EVERY_MODE
@pytest.mark.parametrize("parts", [1, 2, 3, 7, 16])
def test_halves_share_the_work_within_a_bin(mode, parts):
    """The same on all ranks, whoever owns what; more parts than ranks are no matter."""
    comm = MPI.COMM_WORLD
    problems = []
    for particles in distributions():
        r, z, _, work = particles
        ways = (share(comm, z.size), slice(comm.rank, None, comm.size))
        cut, again = (cut_of(comm, particles, mine, parts, mode) for mine in ways)
        bytes_of = [[x.tobytes() for level in c for x in level] for c in (cut, again)]
        if bytes_of[0] != bytes_of[1] or len(set(map(str, comm.allgather(cut)))) > 1:
            problems.append(f"ranks disagree: {cut}")
        problems += misplaced(cut, parts, r, z, work)
        along = [bool(x) for level in cut for x in level.along_r]
        if mode != "auto" and set(along) - {mode == "r"}:
            problems.append(f"cuts along r: {along}")
    agree(comm, problems)


def test_a_rod_gets_slabs_a_thin_plate_columns_and_a_square_both():
    def directions(nz, nr):
        z, r = (1e-4 * (x.ravel() + 0.5) for x in np.mgrid[:nz, :nr])
        reach, work = np.full(z.size, 3e-4), np.full(z.size, 100.0)
        cut = equal_work_cut(ALONE, r, z, reach, work, 16)
        counts = np.bincount(owners(cut, r, z), minlength=16)
        assert np.ptp(counts) <= 8  # a layer of the rod or of the plate
        return {bool(x) for level in cut for x in level.along_r}

    assert directions(1000, 8) == {False}
    assert directions(8, 1000) == {True}
    assert directions(140, 140) == {False, True}


def test_a_cut_costs_ghosts_and_work_that_is_not_shared_out():
    """A slice of one layer cannot be cut across it, though fewer would be ghosts."""
    r = np.arange(40) * 1e-4
    particles = r, np.zeros(40), np.full(40, 1.0), np.full(40, 100.0)
    (level,) = cut_of(ALONE, particles, slice(None), 2)
    assert level.along_r.tolist() == [True]
    assert np.bincount(owners((level,), *particles[:2])).tolist() == [20, 20]


def test_a_direction_is_kept_unless_the_other_saves_enough():
    def square(nz, nr):
        z, r = (1e-4 * (x.ravel() + 0.5) for x in np.mgrid[:nz, :nr])
        return r, z, np.full(z.size, 2e-4), np.full(z.size, 100.0)

    def chosen(particles, current=()):
        (level,) = cut_of(ALONE, particles, slice(None), 2, current=current)
        return "r" if level.along_r[0] else "z"

    along_z, along_r = cut_at(0.0), cut_at(0.0, along_r=True)
    wide, long = square(100, 110), square(110, 100)
    assert (chosen(wide), chosen(long)) == ("r", "z")
    assert (chosen(wide, along_z), chosen(long, along_r)) == ("z", "r")
    nothing = tuple(x[:0] for x in wide)
    assert (chosen(nothing, along_z), chosen(nothing, along_r)) == ("z", "r")
    much = 2 * round(50 / (1.0 - SWITCH_GAIN)) + 10
    assert chosen(square(100, much), along_z) == "r"
    assert chosen(square(much, 100), along_r) == "z"


@pytest.mark.parametrize("layers", [5, 17, 44, 130])
@pytest.mark.parametrize("spacing", [0.1, 1 / 3, 1.7e-4])
def test_layers_of_a_lattice_are_shared_out_whole(layers, spacing):
    """Rounding must not carry a layer across a border, wherever the borders lie."""
    z = np.repeat(-0.3 + spacing * (0.5 + np.arange(layers)), 10)
    r = np.tile(np.arange(10.0), layers)
    reach = work = np.ones(z.size)
    for mode, place in (("z", (r, z)), ("r", (z, r))):
        cut = equal_work_cut(ALONE, *place, reach, work, 4, mode)
        counts = np.bincount(owners(cut, *place), minlength=4)
        # Half a layer from the nearest border at each of two levels.
        assert np.abs(np.cumsum(counts)[1] - z.size / 2) <= 5.0
        assert np.abs(counts - z.size / 4).max() <= 10.0
        assert (counts % 10 == 0).all()


@pytest.mark.mpi(min_size=1)
@EVERY_MODE
def test_particles_in_one_place_and_none_at_all(mode):
    comm = MPI.COMM_WORLD
    place = np.full(5, 0.25)
    problems = []
    for some in (place, place[:0]):
        cut = equal_work_cut(comm, some, some, some, np.ones(some.size), 5, mode)
        if len(set(owners(cut, some, some).tolist())) > 1:
            problems.append("one place, several owners")
        if [level.edges.size for level in cut] != [1, 2, 4]:
            problems.append(cut)
        if [int(np.isnan(level.edges).sum()) for level in cut] != [0, 0, 3]:
            problems.append(cut)
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
    _, z, _, work = next(distributions())
    owner = np.random.default_rng(3).integers(0, comm.size, z.size)
    mine = share(comm, z.size)
    got = part_work(comm, owner[mine], work[mine])
    want = [work[owner == rank].sum() for rank in range(comm.size)]
    agree(comm, [] if got.tolist() == want else [got, want])
