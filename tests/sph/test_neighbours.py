"""The neighbour search, against comparing every pair."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import approx

from mpisph.sph.neighbours import (
    CELLS_PER_REACH,
    MAX_LEVEL,
    candidate_runs,
    find_neighbours,
    level_of,
    make_lattice,
    sort_into_cells,
)

H0 = 2e-3


def cloud(n, seed, h_spread=10.0, extent=20e-3, near_axis=False):
    """Return ids, r, z, h of particles at random places."""
    rng = np.random.default_rng(seed)
    r = rng.uniform(0.0, extent, n) * (1e-3 if near_axis else 1.0)
    z = rng.uniform(-extent, extent, n)
    h = H0 * h_spread ** rng.uniform(-0.5, 0.5, n)
    return rng.permutation(n), r, z, h


def all_pairs(ids, r, z, h, kappa, self_term):
    """Return the set of ids within reach of each id."""
    lists = {}
    for a in range(len(ids)):
        apart = np.hypot(r - r[a], z - z[a])
        near = apart < kappa * 0.5 * (h + h[a])
        near[a] &= self_term
        lists[int(ids[a])] = set(ids[near].tolist())
    return lists


def search(ids, r, z, h, kappa=3.0, self_term=True, owned=None, h0=H0):
    """Return the list of ids that each owned id has, and the arrays behind it."""
    ids, r, z, h = (np.asarray(x) for x in (ids, r, z, h))
    owned = np.ones(len(ids), bool) if owned is None else owned
    cells = sort_into_cells(ids, r, z, h, make_lattice(h0, kappa))
    records = np.stack([r, z, 0.5 * h], axis=1)[cells.order]
    names = ids[cells.order]
    runs = np.empty((len(cells.columns), 2), np.int64)
    lists = {}
    for i in np.flatnonzero(owned[cells.order]):
        r_a, z_a, half = records[i]
        n_runs, candidates = candidate_runs(cells, r_a, z_a, 2.0 * half, kappa, runs)
        assert candidates == (runs[:n_runs, 1] - runs[:n_runs, 0]).sum()
        index = np.empty(candidates, np.int64)
        n = find_neighbours(records, runs, n_runs, i, kappa, self_term, index)
        assert (np.diff(index[:n]) > 0).all()
        lists[int(names[i])] = names[index[:n]].tolist()
    return lists, (cells, names)


def check(particles, **options):
    lists, _ = search(*particles, **options)
    kappa = options.get("kappa", 3.0)
    want = all_pairs(*particles, kappa, options.get("self_term", True))
    assert {a: set(near) for a, near in lists.items()} == want
    assert all(len(set(near)) == len(near) for near in lists.values())
    return want


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("h_spread", [1.0, 3.0, 10.0, 100.0])
@pytest.mark.parametrize("kappa", [1.1, 3.0, 4.0])
def test_lists_of_random_clouds(seed, h_spread, kappa):
    particles = cloud(400, seed, h_spread)
    want = check(particles, kappa=kappa)
    sizes = [len(near) for near in want.values()]
    assert max(sizes) > min(sizes)


@pytest.mark.parametrize("seed", range(3))
def test_lists_without_the_particle_itself(seed):
    check(cloud(200, seed), self_term=False)


def test_lists_beside_the_axis():
    check(cloud(300, 1, near_axis=True))
    ids, r, z, h = cloud(300, 2)
    r[::3] = 0.0
    check((ids, r, z, h))


def test_lists_far_from_the_origin_and_below_it():
    for shift in (-3.0, 5.0):
        ids, r, z, h = cloud(300, 3)
        check((ids, r + abs(shift), z + shift, h))


@given(
    st.lists(
        st.tuples(st.floats(0.0, 0.02), st.floats(-0.02, 0.02), st.floats(1e-4, 1e-2)),
        max_size=40,
    ),
    st.booleans(),
)
def test_lists_of_any_particles(places, self_term):
    r, z, h = np.array(places).reshape(-1, 3).T
    ids = np.arange(len(r))[::-1].copy()
    check((ids, np.ascontiguousarray(r), z.copy(), h.copy()), self_term=self_term)


@given(st.integers(0, 12), st.integers(0, 12), st.integers(-2, 2))
def test_a_particle_on_the_edges_of_cells(i, k, level):
    """Distances of exactly kappa h and places exactly on cell edges."""
    h = H0 / 1.5 * 2.0**level
    size = 3.0 * h / CELLS_PER_REACH
    r, z = np.meshgrid(np.arange(13) * size, np.arange(-6, 7) * size)
    r, z = r.ravel(), z.ravel()
    r[0], z[0] = i * size, (k - 6) * size
    check((np.arange(r.size), r, z, np.full(r.size, h)))


def test_coincident_particles():
    n = 50
    particles = (np.arange(n)[::-1].copy(), np.full(n, 1e-3), np.zeros(n))
    lists, _ = search(*particles, np.full(n, H0))
    assert all(near == list(range(n)) for near in lists.values())


def test_no_and_single_particles():
    nothing = np.empty(0)
    assert search(np.empty(0, np.int64), nothing, nothing, nothing)[0] == {}
    one = ([7], [0.01], [-0.3], [H0])
    assert search(*one)[0] == {7: [7]}
    assert search(*one, self_term=False)[0] == {7: []}


def test_ghosts_have_no_list_but_are_found():
    particles = cloud(300, 4)
    owned = np.random.default_rng(0).random(300) < 0.4
    lists, _ = search(*particles, owned=owned)
    want = all_pairs(*particles, 3.0, True)
    assert set(lists) == set(particles[0][owned].tolist())
    assert all(set(near) == want[a] for a, near in lists.items())
    assert search(*particles, owned=np.zeros(300, bool))[0] == {}


@pytest.mark.parametrize("seed", range(5))
def test_lists_do_not_depend_on_the_order_of_the_input(seed):
    particles = cloud(400, 7)
    want = search(*particles)[0]
    order = np.random.default_rng(seed).permutation(400)
    assert search(*(x[order] for x in particles))[0] == want


def test_lists_do_not_depend_on_particles_out_of_reach():
    """Another rank holds other ghosts: the order of those in reach must be the same."""
    particles = cloud(400, 8, h_spread=4.0)
    want = search(*particles)[0]
    keep = particles[2] < 8e-3
    fewer = search(*(x[keep] for x in particles))[0]
    # The largest reach is 3 h with h = 2 mm x 2.
    inside = particles[0][particles[2] < 8e-3 - 12e-3]
    assert inside.size > 50
    assert all(fewer[a] == want[a] for a in inside.tolist())


def test_order_is_by_level_cell_and_id():
    ids, r, z, h = cloud(500, 9)
    cells, _ = search(ids, r, z, h)[1]
    level = np.floor(np.log2(h / (H0 / 1.5)))
    size = 3.0 * (H0 / 1.5) / CELLS_PER_REACH * 2.0**level
    want = np.lexsort((ids, np.floor(r / size), np.floor(z / size), level))
    np.testing.assert_array_equal(cells.order, want)
    assert len(cells.levels) == len(np.unique(level)) > 3


def test_level_edges_are_powers_of_two():
    ref = 1.3e-3
    for k in range(-MAX_LEVEL, MAX_LEVEL + 1):
        edge = ref * 2.0**k
        assert level_of(edge, ref) == k
        assert level_of(np.nextafter(edge, 0.0), ref) == max(k - 1, -MAX_LEVEL)
    assert level_of(1e300, ref) == MAX_LEVEL
    assert level_of(1e-300, ref) == -MAX_LEVEL


def test_the_initial_h_stands_inside_its_level():
    lattice = make_lattice(H0, 3.0)
    for change in (0.7, 1.0, 1.3):
        assert level_of(change * H0, lattice.h_ref) == 0
    assert lattice.size == approx(3.0 * H0 / 1.5 / CELLS_PER_REACH)
    assert lattice.kappa == 3.0


def test_stray_particles_are_found():
    """Far ones, very fine ones, and one beyond the largest level."""
    ids, r, z, h = cloud(60, 10)
    r[0], z[0] = 5.0, -8.0
    r[1], z[1] = 5.0, -8.0 + h[0]
    h[2:20] = H0 * 1e-3
    want = check((ids, r, z, h))
    assert {ids[0], ids[1]} == want[ids[0]]
    h[30] = H0 * 2.0**40
    want = check((ids, r, z, h))
    assert all(ids[30] in near for near in want.values())


def test_cost_stays_with_the_neighbours_where_one_particle_is_coarse():
    """A coarse particle must not widen the cells of the fine ones."""
    ids, r, z, h = cloud(2000, 11, h_spread=1.0)
    h[0] = 50.0 * H0
    cells, _ = search(ids, r, z, h)[1]
    fine = cells.levels[0, 0]
    assert fine == approx(3.0 * H0 / 1.5 / CELLS_PER_REACH)
    assert math.isclose(cells.levels[0, 1], H0)
