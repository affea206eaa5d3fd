"""The step: the same bits on any number of ranks, conservation, second order."""

from itertools import pairwise

import numpy as np
import pytest
from launch import CASES
from mpi4py import MPI
from oracles import agree, cut_at
from plates import plate_impact, states_at
from small_runs import MODELS

from mpisph.case import case_from_dict, load_case
from mpisph.case.discretise import InitialParticles, discretise
from mpisph.case.initial import complete_particles
from mpisph.parallel.load_balance import PairCost, imbalance, relative_pair_costs
from mpisph.parallel.redistribution import gather_all
from mpisph.solver.setup import step_rule
from mpisph.solver.start import start, start_from
from mpisph.solver.step import SORT_EVERY, advance, rebalance, reduce_state
from mpisph.sph.neighbours import cell_keys
from mpisph.sph.timestep import allowed_step
from mpisph.verify.solids import ring_body, round_section, solid_case

SHOT = CASES / "piekutowski-4-1353.toml"


def steps(sim, count, balance_every=3):
    """Make steps, exchanging owners often; return what the balance did."""
    moved_edges = moved_particles = 0
    for _ in range(count):
        found = reduce_state(sim)
        advance(sim, allowed_step(step_rule(sim.case), found.limit), found.rank_boxes)
        if sim.step % balance_every == 0:
            cut, owned = sim.cut, set(sim.particles.id.tolist())
            rebalance(sim, found.work)
            moved_edges += sim.cut is not cut
            moved_particles += len(set(sim.particles.id.tolist()) - owned)
    return moved_edges, moved_particles


def assert_equal_on_root(comm, mine, reference):
    """Compare all fields of all particles, bit by bit."""
    everything = gather_all(comm, mine)
    equal = True
    if comm.rank == 0:
        alone = gather_all(MPI.COMM_SELF, reference)
        equal = np.array_equal(
            everything.pack().view(np.int64), alone.pack().view(np.int64)
        )
    assert comm.bcast(equal)


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize(
    "overrides",
    [
        ("parallel.cut=auto",),
        ("parallel.cut=z",),
        ("parallel.cut=r",),
        ("scheme.self_term=false", "scheme.viscosity.form=printed"),
        # Far beyond the stable step: particles move a spacing and more within one.
        ("time.step=fixed", "time.dt=60 ns"),
        ("time.order=1",),
        (
            "scheme.eos=tillotson",
            "scheme.smoothing=classic",
            "scheme.p_min.mode=zero",
            "scheme.porosity=p-alpha",
            "materials.al-lee2003.p-alpha.initial_distension=1.4",
            "materials.al-lee2003.p-alpha.elastic_pressure=0.1 GPa",
            "materials.al-lee2003.p-alpha.solid_pressure=1 GPa",
        ),
        MODELS,
    ],
    ids=["auto", "z", "r", "printed", "fixed", "first-order", "porous", "models"],
)
def test_any_number_of_ranks_gives_the_same_bits(overrides):
    comm = MPI.COMM_WORLD
    settings = ("resolution.npr=5", "parallel.imbalance_threshold=0.02", *overrides)
    case = load_case(SHOT, settings)
    sim = start(case, comm)
    moved = np.array(steps(sim, 150))
    comm.Allreduce(MPI.IN_PLACE, moved)
    along_r = {"z": {False}, "r": {True}}.get(case.parallel.cut, {False, True})
    assert {bool(x) for level in sim.cut for x in level.along_r} <= along_r
    # What is compared has gone through migrations and moves of the edges.
    assert comm.size == 1 or moved.min() > 0
    alone = start(case, MPI.COMM_SELF)
    steps(alone, 150)
    assert_equal_on_root(comm, sim.particles, alone.particles)
    if overrides is MODELS:
        # Some particles of each body have broken, and not all.
        broken = alone.particles.damage >= 1.0
        for body in (0, 1):
            share = np.mean(broken[alone.particles.body == body])
            assert 0.02 < share < 0.98
    mine, single = reduce_state(sim), reduce_state(alone)
    assert mine.series == single.series
    assert (mine.limit, mine.limited_by) == (single.limit, single.limited_by)


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("eos", ["mie-grueneisen", "tillotson", "linear"])
def test_skipping_matter_at_rest_changes_no_bit(eos):
    """Every field but the work counted, which is zero where nothing was evaluated."""
    comm = MPI.COMM_WORLD
    # Wide enough that its rim rests to the end.
    wide = ("resolution.npr=5", "bodies.plate.radius=150 mm", f"scheme.eos={eos}")
    case = load_case(SHOT, wide)
    quick, thorough = start(case, comm), start(case, comm)
    thorough.skip_quiescent = False
    for sim in (quick, thorough):
        steps(sim, 30)
    assert comm.allreduce(int((quick.particles.neighbours == 0.0).sum())) > 100
    assert thorough.particles.neighbours.min(initial=1.0) > 0.0
    quick.particles.neighbours[:] = thorough.particles.neighbours[:] = 0.0
    everything = gather_all(comm, thorough.particles)
    assert_equal_on_root(comm, quick.particles, everything)


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("cut", ["z", "r"])
def test_each_rank_makes_its_own_share_of_the_particles(monkeypatch, cut):
    comm = MPI.COMM_WORLD
    made = []

    def counted(*args):
        share = discretise(*args)
        made.append(share.id.size)
        return share

    monkeypatch.setattr("mpisph.solver.start.discretise", counted)
    case = load_case(SHOT, ("resolution.npr=11", f"parallel.cut={cut}"))
    sim = start(case, comm)
    problems = []
    if sum(made) > -(-sim.n_total // comm.size):
        problems.append(f"{made} of {sim.n_total} particles made")
    if not sum(comm.allgather(sum(made))) == sim.n_total == discretise(case).id.size:
        problems.append("some are missing, or were made twice")
    agree(comm, problems)


@pytest.mark.mpi(min_size=1)
def test_the_first_state_is_the_same_whoever_made_the_particles():
    """In blocks of ids, dealt round, and all of them on the last rank."""
    comm = MPI.COMM_WORLD
    case = load_case(SHOT, ("resolution.npr=5",))
    everything = discretise(case)
    last = comm.rank == comm.size - 1
    alone = start(case, MPI.COMM_SELF)
    for mine in (
        slice(comm.rank, None, comm.size),
        slice(None) if last else slice(0),
    ):
        fields = everything.fields().items()
        share = InitialParticles.of({name: a[mine] for name, a in fields})
        sim = start_from(case, comm, share, 0.0)
        assert sim.n_total == alone.n_total
        assert sim.scales == alone.scales
        assert_equal_on_root(comm, sim.particles, alone.particles)


@pytest.mark.mpi(min_size=2)
@pytest.mark.parametrize("cut", ["z", "r"])
def test_ranks_without_particles_change_nothing(cut):
    comm = MPI.COMM_WORLD
    case = load_case(SHOT, ("resolution.npr=4", f"parallel.cut={cut}"))
    sim = start(case, comm)
    # All particles go to the last rank, and stay with it.
    sim.cut = cut_at(*[-1.0] * (comm.size - 1), along_r=cut == "r")
    sim.next_migration = 0
    quiet = np.ones(comm.size)
    rebalance(sim, quiet)
    owned = comm.allgather(sim.particles.n)
    assert owned == [0] * (comm.size - 1) + [sim.n_total]
    for _ in range(5):
        found = reduce_state(sim)
        advance(sim, allowed_step(step_rule(sim.case), found.limit), found.rank_boxes)
    alone = start(case, MPI.COMM_SELF)
    steps(alone, 5, balance_every=10)
    assert_equal_on_root(comm, sim.particles, alone.particles)
    # The next look at the load gives all ranks something to do.
    rebalance(sim, reduce_state(sim).work)
    assert min(comm.allgather(sim.particles.n)) > 0


@pytest.mark.mpi(min_size=2)
@pytest.mark.parametrize("cut", ["auto", "z", "r"])
def test_work_is_shared_equally_from_the_start(cut):
    comm = MPI.COMM_WORLD
    case = load_case(SHOT, ("resolution.npr=16", f"parallel.cut={cut}"))
    sim = start(case, comm)
    # The plate is 14 layers thick and a layer goes to one rank.
    assert imbalance(reduce_state(sim).work) < 0.15


@pytest.mark.mpi(min_size=2)
def test_the_cut_moves_where_that_saves_work_and_not_otherwise():
    comm = MPI.COMM_WORLD
    settings = ("resolution.npr=16", "parallel.cut=z", "parallel.imbalance_threshold=0")
    sim = start(load_case(SHOT, settings), comm)
    sim.particles.neighbours[:] = 100.0
    rebalance(sim, reduce_state(sim).work)
    cut = sim.cut
    # Layers cannot be divided: looking again finds imbalance, but nothing better.
    rebalance(sim, reduce_state(sim).work)
    assert imbalance(reduce_state(sim).work) > 0.0
    assert sim.cut is cut
    # All work but that of the sphere ceases: the edges follow it.
    sim.particles.neighbours[sim.particles.body == 1] = 0.0
    before = reduce_state(sim).work
    rebalance(sim, before)
    after = reduce_state(sim).work
    assert sim.cut is not cut
    assert after.max() < 0.9 * before.max()


@pytest.mark.mpi(min_size=2)
def test_the_cut_stays_below_the_threshold():
    comm = MPI.COMM_WORLD
    settings = ("resolution.npr=16", "parallel.imbalance_threshold=0.05")
    sim = start(load_case(SHOT, settings), comm)
    cut = sim.cut
    sim.particles.neighbours[sim.particles.body == 1] = 0.0
    work = np.ones(comm.size)
    work[0] += 0.04
    rebalance(sim, work)
    assert sim.cut is cut


@pytest.mark.mpi(min_size=1)
def test_particles_come_into_cell_order_again():
    comm = MPI.COMM_WORLD
    sim = start(load_case(SHOT, ("resolution.npr=6",)), comm)
    shuffled = np.random.default_rng(comm.rank).permutation(sim.particles.n)
    sim.particles = sim.particles.take(shuffled)
    sim.next_sort = 0
    rebalance(sim, np.ones(comm.size))
    p = sim.particles
    keys = cell_keys(p.r, p.z, p.h, sim.lattice)
    later = sim.next_sort == sim.step + SORT_EVERY
    agree(comm, [] if (np.diff(keys) >= 0).all() and later else ["not in order"])


@pytest.mark.mpi(min_size=1)
def test_the_cost_of_a_pair_is_measured():
    comm = MPI.COMM_WORLD
    sim = start(load_case(SHOT, ("resolution.npr=6",)), comm)
    problems = [] if sim.pair_cost == PairCost() else ["the start was measured"]
    before = sim.interactions
    steps(sim, 1, balance_every=2)
    if sim.pair_cost.pairs != sim.interactions - before or sim.pair_cost.seconds <= 0.0:
        problems.append(sim.pair_cost)
    pair_costs = np.array(comm.allgather(sim.pair_cost.value))
    found = reduce_state(sim)
    if not np.array_equal(found.pair_costs, relative_pair_costs(pair_costs)):
        problems.append(pair_costs)
    if sim.relative_pair_cost != found.pair_costs[comm.rank]:
        problems.append("another rank's cost")
    agree(comm, problems)


@pytest.mark.mpi(min_size=2)
def test_traffic_is_counted():
    comm = MPI.COMM_WORLD
    case = load_case(SHOT, ("resolution.npr=5",))
    sim = start(case, comm)
    steps(sim, 3)
    # One exchange at the start and one a step, with at least one other rank.
    assert sim.halo.traffic.messages >= 4
    assert sim.halo.traffic.bytes > sim.halo.traffic.ghosts > 0


def test_mass_momentum_and_energy_are_conserved():
    case = load_case(SHOT, ("resolution.npr=6",))
    sim = start(case, MPI.COMM_SELF)
    first = reduce_state(sim).series
    steps(sim, 200)
    last = reduce_state(sim).series
    kinetic, internal = (last[f"{kind}_energy"] for kind in ("kinetic", "internal"))
    assert last["mass"] == first["mass"]
    assert abs(last["momentum_z"] / first["momentum_z"] - 1.0) < 1e-13
    assert internal > 0.1 * first["kinetic_energy"], "much has become heat"
    assert abs((kinetic + internal) / first["kinetic_energy"] - 1.0) < 2e-4


def energy_error(case, time):
    """Relative change of the total energy at `time`."""
    (sim,) = states_at(case, (time,))
    sums = reduce_state(sim).series
    velocity = case.bodies[0].velocity
    flyer = sim.particles.m[sim.particles.body == 0].sum()
    return (sums["kinetic_energy"] + sums["internal_energy"]) / (
        0.5 * flyer * velocity**2
    ) - 1.0


@pytest.mark.parametrize("time", [{"cfl": 0.5}, {"cfl": 0.2}, {"order": 1}])
@pytest.mark.parametrize("pair_form", ["consistent", "lee2003"])
def test_energy_r11_is_conserved_to_rounding(pair_form, time):
    """With any step, of either order."""
    case = plate_impact(3e3, 2e-3, 3e-3, 2e-4)
    case = case.model_copy(
        update={
            "time": case.time.model_copy(update=time),
            "scheme": case.scheme.model_copy(update={"pair_form": pair_form}),
        }
    )
    assert abs(energy_error(case, 2e-7)) < 1e-13


def shot_without_switches():
    """A shot without strength and tensile limit, whose switches lower the order."""
    overrides = ("resolution.npr=4", "scheme.strength=none", "scheme.p_min.mode=off")
    case = load_case(SHOT, overrides)
    return case, discretise(case)


def spinning_ring():
    """An elastic ring whose section turns: its surface leans on the correction (R3)."""
    ring, section, spacing = 0.1, 0.01, 0.0025
    body = ring_body(ring, section)
    case = case_from_dict(solid_case("ring", body, spacing, [1e-3]))
    particles = round_section(ring, section, spacing)
    particles["u_r"] = -3e4 * particles["z"]
    particles["u_z"] = 3e4 * (particles["r"] - ring)
    return case, complete_particles(case, particles, "particles")


@pytest.mark.parametrize(
    ("make", "step"), [(shot_without_switches, 2e-9), (spinning_ring, 5e-8)]
)
def test_second_order_r11_every_field_converges_with_the_step(make, step):
    """The differences of runs with a step, half and a quarter of it fall by four."""
    case, particles = make()
    results = []
    for parts in (1, 2, 4):
        sim = start_from(case, MPI.COMM_SELF, particles, 0.0)
        for _ in range(50 * parts):
            found = reduce_state(sim)
            advance(sim, step / parts, found.rank_boxes)
        results.append(gather_all(MPI.COMM_SELF, sim.particles))
    for name in ("r", "z", "u_r", "u_z", "rho", "E", "h"):
        coarse, fine = (
            np.linalg.norm(getattr(a, name) - getattr(b, name))
            for a, b in pairwise(results)
        )
        assert coarse / fine == pytest.approx(4.0, rel=0.1), name
