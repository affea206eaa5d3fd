"""Ghosts: every true neighbour arrives, and nothing that cannot be one."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, approx, bits, cloud, predicted_fields

from mpisph.core.particles import INTEGRATED, Particles
from mpisph.parallel.decomposition import equal_work_cut, owners
from mpisph.parallel.halo import (
    NOTHING,
    Halo,
    bounding_box,
    boxes,
    exchange_halo,
    partners_of,
    reach,
    select,
)
from mpisph.sph.integrator import drift, kick

KAPPA = 3.0


def by_slabs(comm, r, z):
    edges = np.linspace(-6e-3, 6e-3, comm.size + 1)[1:-1]
    return np.searchsorted(edges, z)


def by_thin_slabs(comm, r, z):
    """All slabs but the first within 1 mm, a small part of the reach."""
    return np.searchsorted(np.linspace(0.0, 1e-3, comm.size)[: comm.size - 1], z)


def by_columns(comm, r, z):
    return np.searchsorted(np.linspace(0.0, 12e-3, comm.size + 1)[1:-1], r)


def by_halves(comm, r, z):
    """As a run would cut them."""
    reach = np.full(z.size, 1e-3)
    return owners(equal_work_cut(comm, r, z, reach, np.ones(z.size), comm.size), r, z)


def by_chance(comm, r, z):
    return np.random.default_rng(5).integers(0, comm.size, z.size)


def on_two_ranks_only(comm, r, z):
    return np.where(z < 0.0, 0, comm.size - 1)


OWNERS = {
    "slabs": by_slabs,
    "thin slabs": by_thin_slabs,
    "columns": by_columns,
    "halves": by_halves,
    "by chance": by_chance,
    "empty ranks": on_two_ranks_only,
}
EVERY_WAY = pytest.mark.parametrize("way", OWNERS.values(), ids=list(OWNERS))


def check_ghosts(comm, everyone, owner, ghosts, loose):
    """Return what is wrong with the ghosts of this rank.

    Parameters
    ----------
    everyone : dict of ndarray
        id, z, r, h and a mark of all particles.
    ghosts : ndarray, shape (2, n)
        Bits of the ids, and the marks.
    loose : bool
        Whether more than what the boxes say may have come: they were for a step.
    """
    r, z, h = everyone["r"], everyone["z"], everyone["h"]
    mine = owner == comm.rank
    apart = np.hypot(r[:, None] - r, z[:, None] - z)
    reach = KAPPA * 0.5 * (h[:, None] + h)
    needed = set(everyone["id"][((apart < reach) & mine).any(1) & ~mine].tolist())
    ids = ghosts[0].view(np.int64).tolist()
    problems = []
    if len(set(ids)) != len(ids):
        problems.append("a ghost came twice")
    if set(ids) & set(everyone["id"][mine].tolist()):
        problems.append("an own particle came back")
    if needed - set(ids):
        problems.append(f"missing: {sorted(needed - set(ids))[:5]}")
    marks = dict(zip(everyone["id"].tolist(), everyone["mark"], strict=True))
    if any(marks[a] != mark for a, mark in zip(ids, ghosts[1], strict=True)):
        problems.append("a ghost has the fields of another")
    half = 0.5 * KAPPA * h
    if mine.any() and not loose:
        may = np.ones(z.size, bool)
        for x in (z, r):
            low, high = (x - half)[mine].min(), (x + half)[mine].max()
            may &= (x - half < high + 1e-9) & (x + half > low - 1e-9)
        extra = set(ids) - set(everyone["id"][may].tolist())
        problems += [f"out of reach: {sorted(extra)[:5]}"] if extra else []
    if not mine.any() and ids:
        problems.append("ghosts for a rank without particles")
    return problems


def boxes_of(p, h):
    half = reach(h, KAPPA)
    return boxes(p.r, p.z, half, half)


def exchanged(comm, p, h, rank_boxes):
    mark = np.sin(p.id + 1.0)
    fields = np.array([p.id.view(np.float64), mark])
    return exchange_halo(comm, fields, boxes_of(p, h), rank_boxes, Halo())


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("seed", range(3))
@EVERY_WAY
def test_ghosts_hold_all_neighbours_and_no_more_than_the_claims(way, seed):
    comm = MPI.COMM_WORLD
    p = cloud(600, seed, h=2e-4, h_spread=10.0)
    owner = way(comm, p.r, p.z)
    mine = p.take(owner == comm.rank)
    rank_boxes = np.array(comm.allgather(bounding_box(mine.values, KAPPA, 0.0)))
    ghosts = exchanged(comm, mine, mine.h, rank_boxes)
    everyone = {name: getattr(p, name) for name in ("id", "r", "z", "h")}
    everyone["mark"] = np.sin(p.id + 1.0)
    agree(comm, check_ghosts(comm, everyone, owner, ghosts, loose=False))


@pytest.mark.mpi(min_size=1)
@EVERY_WAY
def test_ghosts_hold_all_neighbours_after_a_step(way):
    """Claims made before a step must cover positions and h at its end."""
    comm = MPI.COMM_WORLD
    p = cloud(600, 4, h=2e-4, h_spread=10.0)
    rng = np.random.default_rng(6)
    p.rates[:] = 0.0
    p.du_z[:], p.du_r[:] = rng.uniform(-1.0, 1.0, (2, p.n)) * 5e10
    p.dh[:] = rng.uniform(-1.0, 1.0, p.n) * 1e3
    owner = way(comm, p.r, p.z)
    mine = p.take(owner == comm.rank)
    dt = 1e-7
    rank_boxes = np.array(comm.allgather(bounding_box(mine.values, KAPPA, dt)))

    def step(particles):
        kick(particles, 0.5 * dt)
        drift(particles, dt)
        return predicted_fields(particles, 0.5 * dt)[INTEGRATED.index("h")]

    h = step(mine)
    ghosts = exchanged(comm, mine, h, rank_boxes)
    before_z, before_r, inward = p.z.copy(), p.r.copy(), p.u_r < 0.0
    everyone = {"h": step(p), "id": p.id, "r": p.r, "z": p.z}
    everyone["mark"] = np.sin(p.id + 1.0)
    # As far as the smallest h and more, and some of them through the axis.
    assert np.abs(p.z - before_z).max() > 3e-4
    assert np.abs(p.r - before_r).max() > 3e-4
    assert (inward & (p.u_r > 0.0)).sum() > 1
    agree(comm, check_ghosts(comm, everyone, owner, ghosts, loose=True))


APPROACH = {
    # By velocity, by acceleration, by growing h: the gap that each alone closes.
    "u": ({"u": 1e3}, 2.0 * 1e3 * 1e-7),
    "du": ({"du": 2e10}, 2.0 * 0.5 * 2e10 * 1e-14),
    "dh": ({"dh": 1e3}, KAPPA * 1e3 * 1e-7),
}


@pytest.mark.mpi(min_size=2)
@pytest.mark.parametrize("axis", ["z", "r"])
@pytest.mark.parametrize("what", APPROACH)
def test_two_particles_that_come_within_reach_during_a_step(what, axis):
    """They end a thousandth of the gap within reach: no share of it may be missing."""
    comm = MPI.COMM_WORLD
    rates, gap = APPROACH[what]
    dt, h = 1e-7, 1e-3
    first, last = comm.rank == 0, comm.rank == comm.size - 1
    p = Particles.zeros(int(first or last))
    p.id[:] = comm.rank
    p.r[:], p.h[:] = 5e-3, h
    side = -1.0 if first else 1.0
    getattr(p, axis)[:] += side * 0.5 * (KAPPA * h + 0.999 * gap)
    for name, rate in rates.items():
        field = name if name == "dh" else f"{name}_{axis}"
        getattr(p, field)[:] = rate if name == "dh" else -side * rate
    rank_boxes = np.array(comm.allgather(bounding_box(p.values, KAPPA, dt)))
    kick(p, 0.5 * dt)
    drift(p, dt)
    h = predicted_fields(p, 0.5 * dt)[INTEGRATED.index("h")]
    apart = comm.allgather((getattr(p, axis).tolist(), h.tolist()))
    (x_0, h_0), (x_1, h_1) = apart[0], apart[-1]
    within = abs(x_1[0] - x_0[0]) < 0.5 * KAPPA * (h_0[0] + h_1[0])
    ghosts = exchanged(comm, p, h, rank_boxes)
    want = [comm.size - 1] if first else [0] if last else []
    got = ghosts[0].view(np.int64).tolist()
    agree(comm, ([] if within else ["apart"]) + ([] if got == want else [got]))


@pytest.mark.mpi(min_size=2)
def test_a_particle_put_back_at_the_axis_meets_one_further_out():
    """It starts at the axis and ends, reflected, just within reach of the other."""
    comm = MPI.COMM_WORLD
    dt, h, moved = 1e-7, 1e-3, 4e-4
    first, last = comm.rank == 0, comm.rank == comm.size - 1
    p = Particles.zeros(int(first or last))
    p.id[:], p.h[:] = comm.rank, h
    p.r[:] = 1e-6 if first else moved + 0.999 * KAPPA * h
    p.u_r[:] = -(moved + 1e-6) / dt if first else 0.0
    rank_boxes = np.array(comm.allgather(bounding_box(p.values, KAPPA, dt)))
    drift(p, dt)
    reflected = comm.allgather(bool((p.u_r > 0.0).any()))[0]
    ghosts = exchanged(comm, p, p.h, rank_boxes)
    want = [comm.size - 1] if first else [0] if last else []
    got = ghosts[0].view(np.int64).tolist()
    agree(comm, ([] if reflected else ["passed"]) + ([] if got == want else [got]))


@pytest.mark.mpi(min_size=2)
@pytest.mark.parametrize("axis", ["z", "r"])
def test_ranks_out_of_reach_send_nothing(axis):
    comm = MPI.COMM_WORLD
    p = cloud(50, 7)
    getattr(p, axis)[:] += comm.rank * 1.0
    rank_boxes = np.array(comm.allgather(bounding_box(p.values, KAPPA, 0.0)))
    ghosts = exchanged(comm, p, p.h, rank_boxes)
    agree(comm, [] if ghosts.shape == (2, 0) else [ghosts.shape])


@pytest.mark.mpi(min_size=2)
def test_repeated_exchanges_do_not_mix():
    """Ranks may be a whole exchange apart; what they send has other sizes."""
    comm = MPI.COMM_WORLD
    problems = []
    halo = Halo()
    for k in range(20):
        p = cloud(20 + 13 * k, 100 * comm.rank + k)
        rank_boxes = np.array(comm.allgather(bounding_box(p.values, KAPPA, 0.0)))
        fields = np.array([np.full(p.n, 1000.0 * k + comm.rank), p.z])
        ghosts = exchange_halo(comm, fields, boxes_of(p, p.h), rank_boxes, halo)
        label = ghosts[0] - 1000.0 * k
        if not set(label.tolist()) <= set(range(comm.size)) - {comm.rank}:
            problems.append(f"exchange {k} got {set(ghosts[0].tolist())}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=2)
def test_ghosts_keep_every_bit():
    comm = MPI.COMM_WORLD
    p = cloud(30, 8)
    fields = np.full((3, 30), np.nan)
    fields[0] = (-1 - p.id).view(np.float64)
    fields[1] = -0.0
    fields[2] = np.full(30, 0x7FF0000000000001).view(np.float64)
    rank_boxes = np.array(comm.allgather(bounding_box(p.values, KAPPA, 0.0)))
    ghosts = exchange_halo(comm, fields, boxes_of(p, p.h), rank_boxes, Halo())
    want = np.tile(bits(fields), comm.size - 1)
    agree(comm, [] if np.array_equal(bits(ghosts), want) else ["bits differ"])


def test_one_rank_has_no_ghosts():
    p = cloud(20, 9)
    rank_boxes = np.array([bounding_box(p.values, KAPPA, 0.0)])
    ghosts = exchanged(MPI.COMM_SELF, p, p.h, rank_boxes)
    assert ghosts.shape == (2, 0)


@pytest.mark.mpi(min_size=1)
@EVERY_WAY
def test_traffic_counts_what_is_sent(way):
    comm = MPI.COMM_WORLD
    p = cloud(300, 3, h=2e-4)
    mine = p.take(way(comm, p.r, p.z) == comm.rank)
    rank_boxes = np.array(comm.allgather(bounding_box(mine.values, KAPPA, 0.0)))
    fields = np.array([mine.r, mine.z, mine.h])
    halo = Halo()
    received = [
        exchange_halo(comm, fields, boxes_of(mine, mine.h), rank_boxes, halo).shape[1]
        for _ in range(2)
    ]
    traffic = halo.traffic
    problems = []
    if traffic.messages != 2 * partners_of(comm.rank, rank_boxes).size:
        problems.append(f"{traffic.messages} messages")
    if traffic.bytes != 8 * 3 * traffic.ghosts:
        problems.append(f"{traffic.bytes} bytes")
    if comm.allreduce(traffic.ghosts) != comm.allreduce(sum(received)):
        problems.append(f"{traffic.ghosts} ghosts")
    agree(comm, problems)


def test_select_agrees_with_brute_force():
    rng = np.random.default_rng(1)
    corners = rng.uniform(-1.0, 1.0, (4, 80))
    some = boxes(corners[0], corners[1], corners[2] ** 2, corners[3] ** 2)
    rank_boxes = np.vstack([some[:, :6].T, NOTHING])
    start, index = select(some, rank_boxes)
    for k, (z_low, z_high, r_low, r_high) in enumerate(rank_boxes):
        want = [
            i
            for i, box in enumerate(some.T)
            if box[0] < z_high and box[1] > z_low and box[2] < r_high and box[3] > r_low
        ]
        assert index[start[k] : start[k + 1]].tolist() == want
    assert index.size > 8
    assert start[-1] == start[-2]


def test_partners_meet_along_both_axes():
    rank_boxes = np.array(
        [
            [0.0, 1.0, 0.0, 1.0],
            [0.5, 2.0, 0.5, 2.0],
            [0.5, 2.0, 1.0, 2.0],  # touches the first along r, which is not enough
            [1.5, 3.0, 0.0, 1.0],
            NOTHING,
        ]
    )
    partners = [partners_of(rank, rank_boxes).tolist() for rank in range(5)]
    assert partners == [[1], [0, 2, 3], [1], [1], []]


def test_claim_is_the_hull_of_the_boxes():
    p = Particles.zeros(3)
    p.z[:] = 0.0, 1.0, -0.5
    p.r[:] = 1.0, 4.0, 0.5
    p.h[:] = 2.0, 0.2, 0.2
    # z: 0 +- 3, 1 +- 0.3, -0.5 +- 0.3; r: 1 +- 3, 4 +- 0.3, 0.5 +- 0.3; all widened
    # by a relative 1e-9 of the reach.
    found = bounding_box(p.values, KAPPA, 0.0)
    assert found == approx(np.array([-3.0, 3.0, -2.0, 4.3]), rel=1e-8)
    assert (np.array([-1, 1, -1, 1]) * (found - [-3.0, 3.0, -2.0, 4.3]) >= 0.0).all()


def test_claim_covers_a_step():
    p = Particles.zeros(1)
    p.h[:], p.dh[:], p.r[:] = 1.0, -0.5, 10.0
    p.u_z[:], p.du_z[:], p.u_r[:], p.du_r[:] = -2.0, 3.0, 4.0, -1.0
    # Reach 1.5 (1 + 0.05), drift 0.1 (2 + 0.15) and 0.1 (4 + 0.05).
    along_z, along_r = 1.575 + 0.215, 1.575 + 0.405
    want = np.array([-along_z, along_z, 10.0 - along_r, 10.0 + along_r])
    assert bounding_box(p.values, KAPPA, 0.1) == approx(want, rel=1e-8)
    # With the whole kick before the drift, 0.1 (2 + 0.3) and 0.1 (4 + 0.1).
    along_z, along_r = 1.575 + 0.23, 1.575 + 0.41
    want = np.array([-along_z, along_z, 10.0 - along_r, 10.0 + along_r])
    assert bounding_box(p.values, KAPPA, 0.1, 1.0) == approx(want, rel=1e-8)


def test_claim_of_nothing_meets_nothing():
    assert (
        bounding_box(Particles.zeros(0).values, KAPPA, np.inf).tolist()
        == NOTHING.tolist()
    )
