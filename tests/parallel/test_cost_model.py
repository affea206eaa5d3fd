"""How many slabs and columns: the census and the model of a step."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, approx

from mpisph.parallel.cost_model import (
    CELLS,
    GHOST_WORK,
    MESSAGE_WORK,
    SWITCH_GAIN,
    choices,
    choose_columns,
    fastest_cut,
    modelled_time,
    take_census,
)
from mpisph.parallel.decomposition import equal_work_cut, owners
from mpisph.parallel.halo import boxes, hull, select
from mpisph.parallel.load_balance import work_of

ALONE = MPI.COMM_SELF


def block(nz, nr, spacing=1e-4):
    """Return r, z, reach and work of a block of equal particles."""
    z, r = (x.ravel() for x in np.mgrid[:nz, :nr] * spacing)
    return r + 0.5 * spacing, z, np.full(z.size, 3.0 * spacing), np.full(z.size, 113.0)


def cluster(seed=1, n=20_000):
    """Return the same of a cloud, denser at the axis, with a few far strays."""
    rng = np.random.default_rng(seed)
    r = np.abs(rng.normal(0.0, 3e-3, n))
    z = rng.normal(0.0, 1e-3, n)
    r[:3], z[:3] = 0.1, (-0.1, 0.05, 0.2)
    work = work_of(rng.integers(60, 120, n).astype(float))
    return r, z, np.full(n, 2e-4), work


def exact_time(particles, slabs, columns):
    """Return the model's time of the slowest part from all particles themselves."""
    r, z, reach, work = particles
    parts = slabs * columns
    owner = owners(equal_work_cut(ALONE, r, z, work, slabs, columns), r, z)
    all_boxes = boxes(r, z, reach, reach)
    rank_boxes = np.array([hull(all_boxes[:, owner == k]) for k in range(parts)])
    start, index = select(all_boxes, rank_boxes)
    times = []
    for k in range(parts):
        theirs = owner[index[start[k] : start[k + 1]]]
        ghosts = theirs[theirs != k]
        messages = np.unique(ghosts).size
        own = work[owner == k].sum()
        times.append(own + GHOST_WORK * ghosts.size + MESSAGE_WORK * messages)
    return max(times)


@pytest.mark.mpi(min_size=1)
def test_census_counts_the_particles_of_all_ranks():
    comm = MPI.COMM_WORLD
    r, z, reach, work = cluster()
    dealt = slice(comm.rank, None, comm.size)
    census = take_census(comm, r[dealt], z[dealt], reach[dealt], work[dealt])
    rows, columns = census.z.size - 1, census.r.size - 1
    assert census.particles.shape == (rows, columns)
    assert 100 < rows <= CELLS
    assert 100 < columns <= CELLS
    want, *_ = np.histogram2d(z, r, [census.z, census.r])
    # A particle on a border may be counted on either side.
    assert np.abs(want - census.particles).sum() <= 4
    assert census.particles.sum() == r.size
    assert census.work.sum() == work.sum()
    assert census.reach.sum() == approx(reach.sum(), rel=1e-12)
    others = comm.allgather([x.tobytes() for x in census])
    agree(comm, [] if all(other == others[0] for other in others) else ["disagree"])


def test_strays_cost_no_resolution_where_the_others_are():
    census = take_census(ALONE, *cluster())
    body = (np.abs(census.z) < 3e-3).sum()
    assert body > 0.5 * census.z.size > 20


@pytest.mark.parametrize("particles", [block(60, 300), block(300, 60), cluster()])
@pytest.mark.parametrize(("slabs", "columns"), [(1, 1), (8, 1), (1, 8), (4, 4), (2, 8)])
def test_modelled_time_is_nearly_that_of_exact_counts(particles, slabs, columns):
    census = take_census(ALONE, *particles)
    got = modelled_time(census, slabs, columns)
    assert got == pytest.approx(exact_time(particles, slabs, columns), rel=0.15)


def test_modelled_time_counts_ghosts_and_messages():
    """Two halves of a block: each has half the work and six layers of ghosts."""
    particles = block(64, 64)
    census = take_census(ALONE, *particles)
    own = 0.5 * particles[3].sum()
    ghosts = 64 * 6
    want = own + GHOST_WORK * ghosts + MESSAGE_WORK
    assert modelled_time(census, 2, 1) == pytest.approx(want, rel=0.01)
    assert modelled_time(census, 1, 2) == pytest.approx(want, rel=0.01)
    assert modelled_time(census, 1, 1) == particles[3].sum()


def test_choices():
    assert choices("auto", 12) == [1, 2, 3, 4, 6, 12]
    assert choices("zr", 12) == [2, 3, 4, 6, 12]
    assert choices("z", 12) == [1]
    assert choices("zr", 7) == [7]
    assert choices("zr", 1) == choices("auto", 1) == choices("z", 1) == [1]


def test_a_rod_gets_slabs_a_thin_plate_columns_and_a_square_both():
    def chosen(mode, *size, parts=16):
        return choose_columns(take_census(ALONE, *block(*size)), mode, parts, 0)

    assert chosen("auto", 2000, 10) == 1
    assert chosen("auto", 10, 2000) == 16
    assert chosen("auto", 140, 140) == 4
    assert chosen("z", 10, 2000) == 1
    assert chosen("zr", 2000, 10) == 2


def test_another_number_of_columns_must_promise_enough():
    """Blocks ever so slightly wider than long: columns win, but by too little."""
    square = take_census(ALONE, *block(100, 120))
    wide = take_census(ALONE, *block(10, 1200))
    times = [modelled_time(square, 2, 1), modelled_time(square, 1, 2)]
    assert (1.0 - SWITCH_GAIN) * times[0] < times[1] < times[0]
    assert choose_columns(square, "auto", 2, current=0) == 2
    assert choose_columns(square, "auto", 2, current=1) == 1
    assert choose_columns(wide, "auto", 2, current=1) == 2
    # What the mode does not allow is not kept.
    assert choose_columns(square, "zr", 2, current=1) == 2


def test_nothing_to_count():
    nothing = np.empty(0)
    census = take_census(ALONE, nothing, nothing, nothing, nothing)
    assert choose_columns(census, "auto", 4, 0) == 1
    one = np.ones(1)
    census = take_census(ALONE, one, one, one, one)
    assert modelled_time(census, 2, 2) == 1.0


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("mode", ["auto", "z", "zr"])
def test_fastest_cut_has_a_part_a_rank_and_is_the_same_on_all(mode):
    comm = MPI.COMM_WORLD
    particles = cluster()
    dealt = [x[comm.rank :: comm.size] for x in particles]
    cut = fastest_cut(comm, *dealt, mode=mode)
    r, z, reach, work = particles
    census = take_census(ALONE, r, z, reach, work)
    columns = choose_columns(census, mode, comm.size, 0)
    want = equal_work_cut(ALONE, r, z, work, comm.size // columns, columns)
    same = all(np.array_equal(a, b) for a, b in zip(cut, want, strict=True))
    agree(comm, [] if same else [cut, want])
