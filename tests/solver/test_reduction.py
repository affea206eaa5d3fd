"""What all ranks agree on before a step."""

import math

import numpy as np
import pytest
from mpi4py import MPI
from oracles import ALUMINIUM, COPPER, SCHEME, agree, bits, cloud, table_of

from mpisph.core.particles import Particles
from mpisph.diagnostics.cloud import CloudDefinition
from mpisph.diagnostics.stability import DENSITY, ENERGY, NON_FINITE, STABLE, Bounds
from mpisph.parallel.halo import bounding_box
from mpisph.parallel.load_balance import PARTICLE_WORK
from mpisph.solver.reduction import global_reduction
from mpisph.sph.timestep import StepRule

TABLE = table_of(ALUMINIUM, COPPER)
BOUNDS = Bounds(
    density_min=0.01, density_max=5.0, energy_min=-2e7, energy_max=1e8,
    crowding_max=10.0, h_min=1e-6, h_max=1e3,
)  # fmt: skip
CLOUD = CloudDefinition(1e-3, min_velocity=500.0, quantile=0.99)
CONSERVED = ("mass", "momentum_z", "kinetic_energy", "internal_energy")
AUTOMATIC = StepRule(fixed=False, longest=math.inf, courant=0.3)


def everyone():
    p = cloud(500, 1, n_materials=2)
    rng = np.random.default_rng(2)
    p.c[:] = rng.uniform(3e3, 9e3, p.n)
    p.rates[:] = rng.uniform(-1.0, 1.0, p.rates.shape)
    p.du_r[:] *= 1e11
    p.du_z[:] *= 1e11
    p.neighbours[:] = rng.integers(0, 100, p.n)
    p.G[:] = rng.uniform(0.0, 30e9, p.n)
    p.damping[:] = rng.uniform(0.0, 2e4, p.n)
    return p


def terms(p):
    """Mass, axial momentum, kinetic and internal energy of each particle."""
    return np.array(
        [p.m, p.m * p.u_z, 0.5 * p.m * (p.u_r * p.u_r + p.u_z * p.u_z), p.m * p.E]
    )


BOUND = 3.0 * np.abs(terms(everyone())).max(axis=1)
SUM_BOUNDS = np.append(BOUND, BOUND[0])  # of the mass of the cloud too


def owner_of(comm, n, seed=3):
    """Return who owns what; the first of several ranks has nothing."""
    return np.random.default_rng(seed).integers(min(1, comm.size - 1), comm.size, n)


def reduce_state(comm, p, rule=AUTOMATIC):
    return global_reduction(comm, p, TABLE, SCHEME, rule, BOUNDS, SUM_BOUNDS, CLOUD)


def flat(found):
    parts = [*found[:-1], list(found.series.values())]
    return bits(np.concatenate([np.ravel(x).astype(float) for x in parts]))


def conserved(found):
    return np.array([found.series[name] for name in CONSERVED])


def limits(p):
    """Of waves, forces and strain; there is no heat, and h changes slowly."""
    speed = np.sqrt(p.c**2 + 4.0 / 3.0 * p.G / p.rho) + 0.6 * p.damping
    force = np.sqrt(p.h / np.hypot(p.du_r, p.du_z))
    return np.minimum(np.minimum(p.h / speed, force), 0.3 / np.abs(p.div))


@pytest.mark.mpi(min_size=1)
def test_all_ranks_find_the_same():
    comm = MPI.COMM_WORLD
    p = everyone()
    found = reduce_state(comm, p.take(owner_of(comm, p.n) == comm.rank))
    others = comm.allgather(flat(found))
    agree(comm, [] if all(np.array_equal(others[0], x) for x in others) else [found])


@pytest.mark.mpi(min_size=1)
def test_the_largest_request_of_a_rank_counts():
    comm = MPI.COMM_WORLD
    p = everyone().take(np.arange(0))
    found = [
        global_reduction(
            comm, p, TABLE, SCHEME, AUTOMATIC, BOUNDS, SUM_BOUNDS, CLOUD,
            stop_request=stop_request if comm.rank == who else comm.rank,
        ).stop_request
        for who, stop_request in ((0, 115), (comm.size - 1, 103))
    ]  # fmt: skip
    agree(comm, [] if found == [115, 103] else found)


@pytest.mark.mpi(min_size=1)
def test_the_limit_is_the_smallest_of_all_and_names_its_particle():
    comm = MPI.COMM_WORLD
    p = everyone()
    problems = []
    for seed in range(5):
        mine = p.take(owner_of(comm, p.n, seed) == comm.rank)
        found = reduce_state(comm, mine)
        alone = reduce_state(MPI.COMM_SELF, p)
        if found.limit != alone.limit:
            problems.append(f"limit {found.limit} here, {alone.limit} on one rank")
        if not math.isclose(found.limit, limits(p).min(), rel_tol=1e-15):
            problems.append(f"limit {found.limit}, meant {limits(p).min()}")
        if found.limited_by != p.id[np.argmin(limits(p))]:
            problems.append(f"limited by {found.limited_by}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_of_particles_with_the_same_limit_the_smallest_id_is_named():
    """A lattice at rest has the same limit everywhere, in whatever order it stands."""
    comm = MPI.COMM_WORLD
    p = everyone()
    p.h[:], p.c[:], p.div[:], p.du_r[:], p.du_z[:] = 2e-3, 5e3, 0.0, 0.0, 0.0
    p.G[:], p.damping[:] = 0.0, 0.0
    problems = []
    for seed in range(4):
        q = p.take(np.random.default_rng(seed).permutation(p.n))
        mine = q.take(owner_of(comm, q.n, seed) == comm.rank)
        found = reduce_state(comm, mine)
        if found.limited_by != 0:
            problems.append(f"limited by {found.limited_by}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_sums_have_the_bits_of_the_exact_sum_on_any_ranks():
    comm = MPI.COMM_WORLD
    p = everyone()
    want = np.array([math.fsum(row) for row in terms(p)])
    problems = []
    for seed in range(3):
        mine = p.take(owner_of(comm, p.n, seed) == comm.rank)
        got = conserved(reduce_state(comm, mine))
        if not np.array_equal(bits(got), bits(want)):
            problems.append(f"{got - want}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_the_extent_is_that_of_the_whole_cloud_r12():
    comm = MPI.COMM_WORLD
    p = everyone()
    cloud = (p.z > CLOUD.rear) & (p.u_z > CLOUD.min_velocity)
    want = [p.r[cloud].max(), p.z[cloud].max() - CLOUD.rear]
    found = reduce_state(comm, p.take(owner_of(comm, p.n) == comm.rank))
    want.append(math.fsum(p.m[cloud]))
    names = ("cloud_radius", "cloud_length", "cloud_mass")
    got = [found.series[name] for name in names]
    problems = [] if got == want else [got]
    p.u_z[:] = 0.0
    none = reduce_state(comm, p.take(owner_of(comm, p.n) == comm.rank))
    got = [none.series[name] for name in names]
    problems += [] if got == [0.0, 0.0, 0.0] else [got]
    agree(comm, problems)


RULES = {
    # The step that the bounding boxes must cover, from a rank's own smallest limit.
    "automatic": (AUTOMATIC, lambda own: 0.3 * own),
    "capped": (
        AUTOMATIC._replace(longest=1e-9),
        lambda own: np.minimum(0.3 * own, 1e-9),
    ),
    "fixed": (StepRule(True, 5e-6, 0.3), lambda own: 5e-6),
    "none": (StepRule(True, 0.0, 0.3), lambda own: 0.0),
}


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("name", RULES)
def test_boxes_and_work_are_those_of_each_rank(name):
    comm = MPI.COMM_WORLD
    rule, step = RULES[name]
    p = everyone()
    owner = owner_of(comm, p.n)
    problems = []
    found = reduce_state(comm, p.take(owner == comm.rank), rule)
    for rank in range(comm.size):
        theirs = p.take(owner == rank)
        work = (theirs.neighbours + PARTICLE_WORK).sum()
        want = bounding_box(
            theirs.values, SCHEME.kappa, step(limits(theirs).min(initial=math.inf))
        )
        close = np.allclose(found.rank_boxes[rank], want, rtol=1e-14, atol=0.0)
        if found.work[rank] != work or not close:
            problems.append(f"rank {rank}: {found.rank_boxes[rank]}, meant {want}")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_faults_on_any_rank_are_seen_by_all_and_the_smallest_id_is_named():
    comm = MPI.COMM_WORLD
    problems = []
    faults = [(41, "rho", -1.0, DENSITY), (300, "E", 1e9, ENERGY)]
    faults += [(41, "u_r", np.nan, NON_FINITE)]
    for first in faults:
        p = everyone()
        place = {int(number): k for k, number in enumerate(p.id)}
        for number, name, value, _ in ((499, "E", 1e9, None), first):
            getattr(p, name)[place[number]] = value
        owner = owner_of(comm, p.n)
        with np.errstate(invalid="ignore"):
            found = reduce_state(comm, p.take(owner == comm.rank))
        if (found.fault, found.fault_id) != (first[3], first[0]):
            problems.append(f"{found.fault} of {found.fault_id}, meant {first}")
    sound = reduce_state(comm, everyone())
    if (sound.fault, sound.fault_id) != (STABLE, -1):
        problems.append(f"{sound.fault} of {sound.fault_id} in a sound state")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_a_sum_that_is_not_finite_or_beyond_its_bound_is_nan():
    comm = MPI.COMM_WORLD
    p = everyone()
    p.E[p.id == 7] = np.nan
    with np.errstate(invalid="ignore"):
        found = reduce_state(comm, p.take(owner_of(comm, p.n) == comm.rank))
    nan = np.isnan(conserved(found)).tolist()
    problems = [] if nan == [False] * 3 + [True] else [found]
    p = everyone()
    p.u_z[p.id == 7] = 1e9
    found = reduce_state(comm, p.take(owner_of(comm, p.n) == comm.rank))
    if np.isnan(conserved(found)).tolist() != [False, True, True, False]:
        problems.append(found.series)
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_no_particles_anywhere():
    found = reduce_state(MPI.COMM_WORLD, Particles.zeros(0))
    assert found.limit == math.inf
    assert found.limited_by == -1
    assert found.fault == STABLE
    assert set(found.series.values()) == {0.0}
    assert found.work.tolist() == [0.0] * MPI.COMM_WORLD.size


def test_the_reduction_uses_one_collective():
    class Counting:
        rank, size = 0, 1
        calls = 0

        def Allgather(self, record, records):  # noqa: N802 (mpi4py's name)
            Counting.calls += 1
            MPI.COMM_SELF.Allgather(record, records)

    found = reduce_state(Counting(), everyone())
    assert Counting.calls == 1
    assert np.array_equal(flat(found), flat(reduce_state(MPI.COMM_SELF, everyone())))
