"""The modelled scaling: counts against brute force, times against the formula."""

import math

import numpy as np
import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree, approx, cut_at

from mpisph.bench.scaling import (
    GHOST_BYTES,
    Costs,
    PartCounts,
    count_parts,
    initial_layout,
    predict_scaling,
    scaling_table,
    step_times,
)
from mpisph.case import load_case
from mpisph.parallel.decomposition import equal_work_cut, owners
from mpisph.parallel.halo import reach
from mpisph.parallel.load_balance import work_of
from mpisph.solver.start import start
from mpisph.sph.sources import EXCHANGED

SHOT = CASES / "piekutowski-4-1353.toml"
COARSE = load_case(SHOT, ("resolution.npr=6",))


def brute_force(layout, cut):
    """Count by comparing every particle with the union of every part's boxes."""
    r, z, half, _ = layout
    owner = owners(cut, r, z)
    parts = owner.max() + 1
    hulls = []
    for part in range(parts):
        sides = []
        for x in (z, r):
            mine = owner == part
            sides += [(x - half)[mine].min(), (x + half)[mine].max()]
        hulls.append(sides)
    ghosts, messages = np.zeros((2, parts), np.int64)
    for part, (z_low, z_high, r_low, r_high) in enumerate(hulls):
        meets = (z - half < z_high) & (z + half > z_low)
        meets &= (r - half < r_high) & (r + half > r_low)
        ghosts[part] = (meets & (owner != part)).sum()
        messages[part] = sum(
            a < z_high and b > z_low and c < r_high and d > r_low
            for other, (a, b, c, d) in enumerate(hulls)
            if other != part
        )
    return owner, ghosts, messages


@pytest.mark.parametrize(
    ("parts", "mode"), [(1, "auto"), (5, "z"), (4, "r"), (6, "auto")]
)
def test_counts_agree_with_brute_force(parts, mode):
    layout = initial_layout(COARSE)
    layout.neighbours[:] = np.arange(layout.r.size) % 7
    work = work_of(layout.neighbours)
    r, z, half, _ = layout
    cut = equal_work_cut(MPI.COMM_SELF, r, z, half, work, parts, mode)
    counts = count_parts(layout, cut, parts)
    owner, ghosts, messages = brute_force(layout, cut)
    assert counts.own.tolist() == [(owner == k).sum() for k in range(parts)]
    pairs = [layout.neighbours[owner == k].sum() for k in range(parts)]
    assert counts.interactions.tolist() == pairs
    assert counts.ghosts.tolist() == ghosts.tolist()
    assert counts.messages.tolist() == messages.tolist()
    assert counts.bytes.tolist() == (8 * len(EXCHANGED) * ghosts).tolist()
    assert parts == 1 or ghosts.min() > 0


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("cut", ["z", "r", "auto"])
def test_counts_are_those_of_a_run(cut):
    """Ghosts and messages of the two exchanges that a simulation starts with."""
    comm = MPI.COMM_WORLD
    settings = ("resolution.npr=6", f"parallel.cut={cut}")
    sim = start(load_case(SHOT, settings), comm)
    first = initial_layout(COARSE)
    # The first cut shares out particles, all taken as equal.
    r, z, half, _ = first
    work = work_of(first.neighbours)
    shares = equal_work_cut(MPI.COMM_SELF, r, z, half, work, comm.size, cut)
    counts = count_parts(first, shares, comm.size)
    sent = comm.allreduce(sim.halo.traffic.ghosts)
    problems = [] if sent == 2 * counts.ghosts.sum() else [sent, counts.ghosts]
    if sim.halo.traffic.messages != 2 * counts.messages[comm.rank]:
        problems.append(f"{sim.halo.traffic.messages} messages")
    agree(comm, problems)


def test_empty_parts_exchange_nothing():
    layout = initial_layout(COARSE)
    flat = layout._replace(z=np.zeros_like(layout.z))
    cut = cut_at(-1.0, 1.0)
    counts = count_parts(flat, cut, 3)
    assert sorted(counts.own.tolist()) == [0, 0, layout.r.size]
    assert counts.ghosts.sum() == counts.messages.sum() == 0


def test_step_times():
    counts = PartCounts(
        own=np.array([10, 0]),
        interactions=np.array([1000.0, 0.0]),
        ghosts=np.array([7, 3]),
        messages=np.array([1, 2]),
    )
    costs = Costs(1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e9, 1e-4)
    times = step_times(counts, costs)
    wire = GHOST_BYTES / 1e9
    assert times.tolist() == [
        approx(1e-6 + 1e-7 + 7e-7 + 1e-6 + 7 * wire + 1e-5 + 1e-4),
        approx(3e-7 + 2e-6 + 3 * wire + 1e-5 + 1e-4),
    ]


@pytest.mark.parametrize("mode", ["z", "auto"])
def test_efficiency_is_that_of_the_slowest_part(mode):
    layout = initial_layout(COARSE)
    found = predict_scaling(layout, 4, mode)
    alone = predict_scaling(layout, 1, mode)
    costs = Costs()
    pairs = costs.interaction * layout.neighbours.sum()
    serial = pairs + costs.particle * 306 + costs.step
    assert layout.r.size == 306
    slowest = step_times(found.counts, costs).max()
    assert found.efficiency == approx(serial / (4 * slowest), rel=1e-12)
    assert alone.efficiency == approx(1.0, rel=1e-12)


def test_initial_layout_is_that_of_the_case():
    layout = initial_layout(COARSE)
    inside = round(math.pi * (3.0 * 2.0) ** 2)
    assert set(layout.neighbours.tolist()) == {float(inside)}
    want = reach(np.array([COARSE.smoothing_length]), COARSE.scheme.kappa)
    assert set(layout.reach.tolist()) == set(want.tolist())
    at_rest = np.where(layout.z > 0.0, 0.0, 5.0)
    assert initial_layout(COARSE, at_rest).neighbours is at_rest


def test_particles_at_rest_weigh_less():
    layout = initial_layout(COARSE)
    resting = layout._replace(neighbours=np.where(layout.z > 0.0, 0.0, 113.0))
    before, after = (predict_scaling(x, 2, "z").counts for x in (layout, resting))
    assert np.ptp(before.own) < 0.1 * layout.r.size
    # The first slab ends within the sphere, and the second holds more particles.
    assert after.own[0] < (layout.z <= 0.0).sum() < after.own[1]


def test_scaling_table_has_a_row_a_cut():
    lines = scaling_table(initial_layout(COARSE), (2, 4))
    assert len({line.count("|") for line in lines}) == 1
    starts = [line.split("|")[1:3] for line in lines[2:]]
    ways = [" along z ", " along z or r "]
    assert starts == [[f" {parts} ", way] for parts in (2, 4) for way in ways]


def test_parts_in_both_directions_receive_fewer_ghosts():
    layout = initial_layout(load_case(SHOT, ("resolution.npr=50",)))
    found = {mode: predict_scaling(layout, 16, mode) for mode in ("z", "r", "auto")}
    most = {mode: each.counts.ghosts.max() for mode, each in found.items()}
    assert most["auto"] < 0.6 * min(most["z"], most["r"])
    assert found["auto"].efficiency > max(found[m].efficiency for m in ("z", "r"))
