"""What a run's constants are, as they follow from its case."""

import math

import numpy as np
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.discretise import InitialParticles
from mpisph.case.shield import flights_of
from mpisph.core.particles import Particles
from mpisph.diagnostics.cloud import cloud_definition
from mpisph.diagnostics.series import Scales, bounds_of
from mpisph.diagnostics.stability import Bounds
from mpisph.parallel.decomposition import Cut
from mpisph.physics.artificial_stress import artificial_stress
from mpisph.physics.response import material_table
from mpisph.physics.scheme import SchemeConstants
from mpisph.physics.smoothing import MODES
from mpisph.solver.state import Simulation
from mpisph.sph.neighbours import make_lattice
from mpisph.sph.planes import Planes
from mpisph.sph.retirement import Retirement
from mpisph.sph.timestep import StepRule


def make_scheme(case: Case) -> SchemeConstants:
    """Return the scheme's parameters as the jitted functions take them."""
    s = case.scheme
    return SchemeConstants(
        lee2003=s.pair_form == "lee2003",
        alpha=s.viscosity.alpha,
        beta=s.viscosity.beta,
        epsilon=s.viscosity.epsilon,
        printed=s.viscosity.form == "printed",
        g1=s.heat.g1 if s.heat.enabled else 0.0,
        g2=s.heat.g2 if s.heat.enabled else 0.0,
        kappa=s.kappa,
        self_term=s.self_term,
        smoothing=MODES[s.smoothing],
        sound_speed_floor=s.sound_speed_floor,
        artificial_stress=artificial_stress(
            s.artificial_stress, case.resolution.nph, s.kappa
        ),
    )


def neighbours_inside(case: Case) -> int:
    """Return how many neighbours a particle inside a body has at the start."""
    reach = case.scheme.kappa * case.smoothing_length / case.spacing
    return round(math.pi * reach**2)


def make_simulation(
    case: Case,
    comm: MPI.Intracomm,
    particles: Particles,
    n_total: int,
    cut: Cut,
    scales: Scales,
) -> Simulation:
    """Return the simulation of a case with these particles."""
    scheme = make_scheme(case)
    return Simulation(
        case=case,
        comm=comm,
        particles=particles,
        n_total=n_total,
        scheme=scheme,
        table=material_table(case.material_table),
        lattice=make_lattice(case.smoothing_length, scheme.kappa),
        bounds=_bounds(case, scales.energy),
        scales=scales,
        sum_bounds=bounds_of(scales),
        cloud=cloud_definition(case),
        rule=step_rule(case),
        cut=cut,
        planes=Planes(*case.boundary.planes),
        retirement=_retirement(case),
    )


def _retirement(case: Case) -> Retirement | None:
    """Return when matter of a case leaves the game; None where it never does.

    From a plane of the boundary it would come back.
    """
    if case.shield is None or case.boundary.exists:
        return None
    flights = flights_of(case.shield)
    reach, after = np.array([(f.reach, f.after) for f in flights]).T
    return Retirement(reach.copy(), after.copy(), case.horizon)


def initial_scales(case: Case, comm: MPI.Intracomm, share: InitialParticles) -> Scales:
    """Return the magnitudes of a run, from a share of its particles on each rank."""
    speeds = [share.u_z]
    if share.u_r is not None:
        speeds.append(share.u_r)
    if share.E is not None:
        speeds.append(np.sqrt(2.0 * np.abs(share.E)))
    fastest = max(np.abs(speed).max(initial=0.0) for speed in speeds)
    largest = np.array([fastest, share.m.max(initial=0.0)])
    comm.Allreduce(MPI.IN_PLACE, largest, MPI.MAX)
    fastest, mass = largest.tolist()
    slow = 0.01 * max(entry.bulk_sound_speed for entry in case.material_table)
    return Scales(mass, max(fastest, slow))


def step_rule(case: Case) -> StepRule:
    """Return how the case's steps follow from the limits."""
    longest = math.inf if case.time.dt is None else case.time.dt
    kick = 0.5 if case.time.order == 2 else 1.0
    return StepRule(case.time.step == "fixed", longest, case.time.cfl, kick)


def _bounds(case: Case, energy: float) -> Bounds:
    limits = case.limits
    return Bounds(
        density_min=limits.density_ratio_min,
        density_max=limits.density_ratio_max,
        energy_min=-limits.energy_ratio_min * energy,
        energy_max=limits.energy_ratio_max * energy,
        crowding_max=limits.kernel_ratio_max,
        h_min=case.smoothing_length / limits.smoothing_ratio_max,
        h_max=case.smoothing_length * limits.smoothing_ratio_max,
    )
