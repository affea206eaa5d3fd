"""Matter that has left the game: same bits on any ranks, conserved, free of cost."""

import numpy as np
import pytest
from mpi4py import MPI
from oracles import agree, bits
from shields import shield_case

from mpisph.core.particles import Particles
from mpisph.diagnostics.stability import STABLE
from mpisph.parallel.redistribution import gather_all
from mpisph.solver.start import restore, start
from mpisph.solver.step import RETIRE_EVERY, advance, rebalance, reduce_state
from mpisph.sph.timestep import allowed_step


def shield(**tables):
    """A shield whose bumper is passed within some sixty steps."""
    given = {
        "projectile": {"velocity": "6 km/s"},
        "bumpers": {"standoff": "6 mm", "radius": "12 mm"},
        "wall": {"thickness": "1.6 mm", "radius": "7 mm"},
        "resolution": {"npr": 4},
        "time": {"end": "12 us"},
        "parallel": {"imbalance_threshold": 0.02},
    }
    return shield_case(**{**given, **tables})


def steps(sim, count, balance_every=3):
    """Make steps, exchanging owners often."""
    for _ in range(count):
        found = reduce_state(sim)
        advance(sim, allowed_step(sim.rule, found.limit), found.rank_boxes)
        if sim.step % balance_every == 0:
            rebalance(sim, found.work)


def until_some_have_left(sim):
    """Make steps up to the first in which matter has left."""
    while sim.comm.allreduce(sim.retired.n) == 0:
        steps(sim, 1)
        assert sim.step < 400


def totals(sim):
    """Return mass, axial momentum and energy of a run."""
    found = reduce_state(sim).series
    energy = found["kinetic_energy"] + found["internal_energy"]
    return np.array([found["mass"], found["momentum_z"], energy])


def differences(sim, alone):
    """Say on rank 0 what differs between a run and one on one rank; collective."""
    mine, found, single = sim.everything, reduce_state(sim), reduce_state(alone)
    everything, reference = (
        gather_all(run.comm, p) for run, p in ((sim, mine), (alone, alone.everything))
    )
    problems = []
    if found.series != single.series or found.limited_by != single.limited_by:
        problems.append(f"reduction at step {sim.step}")
    if everything and not np.array_equal(
        bits(everything.pack()), bits(reference.pack())
    ):
        problems.append(f"particles at step {sim.step}")
    return problems


@pytest.fixture(scope="module")
def left():
    """A run on one rank in which matter has just left; not to be changed."""
    sim = start(shield(), MPI.COMM_SELF)
    until_some_have_left(sim)
    return sim


def copy_of(sim):
    """Return a run that goes on as this one would, on one rank."""
    p = sim.everything
    other = restore(sim.case, sim.comm, p.take(np.arange(p.n)), p.n, sim.scales)
    other.time, other.step = sim.time, sim.step
    return other


def test_a_part_of_the_bumper_and_nothing_of_the_wall_has_left(left):
    body = left.retired.body
    assert left.step > RETIRE_EVERY
    assert 40 < np.sum(body == 1) < np.sum(left.everything.body == 1)
    assert not np.any(body == 2)
    assert left.retired.n + left.particles.n == left.everything.n == left.n_total
    assert np.array_equal(np.sort(left.everything.id), np.arange(left.n_total))
    assert np.all(left.retired.retired == 1.0)
    assert np.all(left.particles.retired == 0.0)


def test_mass_momentum_and_energy_are_what_they_were(left):
    mass, momentum, energy = totals(start(left.case, MPI.COMM_SELF))
    sim = copy_of(left)
    steps(sim, 2 * RETIRE_EVERY)
    for now in (totals(left), totals(sim)):
        assert now[0] == mass
        assert now[1] == pytest.approx(momentum, rel=1e-13)
        assert now[2] == pytest.approx(energy, rel=1e-13)


def test_the_sums_are_those_of_all_particles(left):
    sim = copy_of(left)
    steps(sim, 5)
    p = sim.everything
    energy = p.E + 0.5 * (p.u_r**2 + p.u_z**2)
    found = [p.m.sum(), (p.m * p.u_z).sum(), (p.m * energy).sum()]
    assert totals(sim) == pytest.approx(found, rel=1e-12)


def test_it_flies_straight_and_keeps_all_else(left):
    sim = copy_of(left)
    n, time = sim.retired.n, sim.time
    before = sim.retired.take(np.arange(n))
    steps(sim, 15)
    after, spent = sim.retired.take(np.arange(n)), sim.time - time
    np.testing.assert_allclose(after.z, before.z + spent * before.u_z, rtol=1e-12)
    r = np.abs(before.r + spent * before.u_r)
    np.testing.assert_allclose(after.r, r, rtol=0.0, atol=1e-15)
    for name in (
        "u_z",
        "rho",
        "E",
        "S_rr",
        "S_zz",
        "h",
        "P",
        "T",
        "damage",
        "crowding",
    ):
        assert np.array_equal(getattr(after, name), getattr(before, name)), name
    assert np.array_equal(np.abs(after.u_r), np.abs(before.u_r))


def test_nothing_that_stays_feels_it(left):
    """Whatever its state, the rest has the same bits, steps and faults."""
    one, other = copy_of(left), copy_of(left)
    x = other.retired
    x.h[:], x.E[:], x.rho[:], x.du_z[:], x.c[:] = 1.0, 1e30, 1e-9, 1e30, 1e30
    x.z[:] = other.particles.z.mean()
    for sim in (one, other):
        steps(sim, 10)
    assert one.time == other.time
    assert np.array_equal(bits(one.particles.pack()), bits(other.particles.pack()))
    assert reduce_state(other).fault == STABLE


def test_it_costs_no_pairs_and_no_work(left):
    """Against a run that goes on with all of its matter."""
    one, whole = copy_of(left), copy_of(left)
    whole.particles, whole.retirement = whole.everything, None
    whole.retired = whole.retired.take(np.arange(0))
    whole.retired_parts = None
    work = []
    for sim in (one, whole):
        sim.interactions = 0
        steps(sim, 10)
        work.append(float(reduce_state(sim).work.sum()))
    stays = one.particles.neighbours.sum()
    assert one.interactions < 0.9 * whole.interactions
    assert one.interactions == pytest.approx(10 * stays, rel=0.2)
    assert work[0] < 0.9 * work[1]
    assert not one.retired.neighbours.any()


def test_a_run_in_two_parts_has_the_same_bits(left):
    """A checkpoint holds what has left, and what leaves later."""
    whole = start(left.case, MPI.COMM_SELF)
    steps(whole, left.step + 4 * RETIRE_EVERY + 3)
    for pause in (5, 3 * RETIRE_EVERY - 1, 3 * RETIRE_EVERY):
        parts = copy_of(left)
        steps(parts, pause)
        parts = copy_of(parts)
        steps(parts, whole.step - parts.step)
        assert differences(parts, whole) == []
    assert whole.retired.n > left.retired.n


def test_what_has_left_stays_away_in_a_longer_run(left):
    later = shield(time={"end": "24 us"})
    p = left.everything
    sim = restore(later, MPI.COMM_SELF, p, p.n, left.scales)
    sim.time, sim.step = left.time, left.step
    here = copy_of(left)
    for run in (sim, here):
        steps(run, RETIRE_EVERY)
    assert np.array_equal(np.sort(sim.retired.id), np.sort(here.retired.id))
    assert differences(sim, here) == []


def test_from_a_plane_matter_may_come_back():
    sim = start(shield(boundary={"z_min": "-8 mm"}), MPI.COMM_SELF)
    assert sim.retirement is None


@pytest.mark.mpi(min_size=1)
@pytest.mark.parametrize("cut", ["z", "r"])
def test_any_number_of_ranks_gives_the_same_bits(cut):
    """Through migrations and a restart, on ranks that hold matter of any part."""
    comm = MPI.COMM_WORLD
    case = shield(parallel={"imbalance_threshold": 0.02, "cut": cut})
    sim, alone = start(case, comm), start(case, MPI.COMM_SELF)
    for run in (sim, alone):
        until_some_have_left(run)
    problems = differences(sim, alone)
    share = gather_all(comm, sim.everything) or Particles.zeros(0)  # all on rank 0
    again = restore(case, comm, share, sim.n_total, sim.scales)
    again.time, again.step = sim.time, sim.step
    for run in (sim, again, alone):
        steps(run, RETIRE_EVERY + 5)
    problems += differences(sim, alone) + differences(again, alone)
    agree(comm, problems)
