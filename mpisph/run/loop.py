"""The loop over the steps of a run, from one output time to the next."""

from mpisph.core.errors import UnstableError
from mpisph.diagnostics.stability import REASONS, STABLE
from mpisph.parallel.load_balance import imbalance
from mpisph.run.checkpointing import CheckpointPolicy
from mpisph.run.output import RunOutput
from mpisph.solver.reduction import Reduction
from mpisph.solver.setup import step_rule
from mpisph.solver.state import Simulation
from mpisph.solver.step import advance, rebalance, reduce_state
from mpisph.sph.timestep import allowed_step, step_to

URGENT = 0.1
"""Imbalance that calls for a look at the load at once: in the first steps, when matter
is set in motion fastest."""


def step_to_end(sim: Simulation, output: RunOutput, policy: CheckpointPolicy) -> None:
    """Advance a simulation through all output times of its case that are to come.

    Parameters
    ----------
    sim : Simulation
    output : RunOutput
    policy : CheckpointPolicy

    Raises
    ------
    UnstableError
        On all ranks, at the step at which the run broke down.
    StopRequested
        On all ranks, before the step at which the run was stopped.
    """
    rule = step_rule(sim.case)
    targets = [0.0, *sim.case.output_times][len(output.snapshots) :]
    while True:
        found = reduce_state(sim, stop_request=policy.request(sim))
        policy.carry_out(sim, found.stop_request)
        if sim.time >= targets[-1]:
            policy.save_end(sim)
        output.add_step(sim, found)
        check_stable(sim, found, output.errors.energy)
        if sim.time >= targets[0]:
            output.save_snapshot(sim)
            del targets[0]
            if not targets:
                return
        allowed = allowed_step(rule, found.limit)
        sim.first_dt = sim.first_dt or allowed
        _check_step(sim, found, allowed)
        dt = step_to(targets[0] - sim.time, allowed)
        last = dt == targets[0] - sim.time
        make_step(sim, found, dt)
        if last:
            sim.time = targets[0]


def make_step(sim: Simulation, found: Reduction, dt: float) -> None:
    """Advance by a step; every few steps, divide the particles among the ranks again.

    Parameters
    ----------
    sim : Simulation
    found : Reduction
        Taken before the step.
    dt : float
        Length of the step [s].
    """
    advance(sim, dt, found.rank_boxes)
    urgent = imbalance(found.work) > URGENT
    if urgent or sim.step % sim.case.parallel.rebalance_every == 0:
        rebalance(sim, found.work)


def check_stable(sim: Simulation, found: Reduction, energy_error: float) -> None:
    """Raise where a particle is out of bounds or the energy drifts.

    Raises
    ------
    UnstableError
        On all ranks.
    """
    if found.fault != STABLE:
        name, text = REASONS[found.fault]
        where = describe_particle(sim, found.fault_id)
        raise UnstableError(
            name, sim.step, sim.time, found.fault_id, f"{text}: {where}"
        )
    limit = sim.case.limits.energy_drift
    if not abs(energy_error) <= limit:
        text = f"the total energy changed by {energy_error:.3g}, the limit is {limit:g}"
        raise UnstableError("energy_drift", sim.step, sim.time, None, text)


def _check_step(sim: Simulation, found: Reduction, dt: float) -> None:
    """Raise where the step has collapsed."""
    ratio = sim.case.limits.step_ratio_min
    if dt < ratio * sim.first_dt:
        where = describe_particle(sim, found.limited_by)
        text = (
            f"the step has fallen to {1e9 * dt:.3g} ns, below {ratio:g} of the first: "
            f"{where}"
        )
        raise UnstableError("step_collapse", sim.step, sim.time, found.limited_by, text)


def describe_particle(sim: Simulation, who: int) -> str:
    """Return in words where a particle is and in what state; collective."""
    p = sim.particles
    mine = None
    for i in (p.id == who).nonzero()[0]:
        body = sim.case.bodies[int(p.body[i])].name
        mine = (
            f"particle {who} of {body} at r = {1e3 * p.r[i]:.4g} mm, "
            f"z = {1e3 * p.z[i]:.4g} mm, with u_r = {1e-3 * p.u_r[i]:.4g} km/s, "
            f"u_z = {1e-3 * p.u_z[i]:.4g} km/s, density {p.rho[i]:.4g} kg/m³, "
            f"internal energy {1e-6 * p.E[i]:.4g} MJ/kg, h = {1e3 * p.h[i]:.4g} mm"
        )
    found = [text for text in sim.comm.allgather(mine) if text is not None]
    return found[0] if found else f"particle {who}"
