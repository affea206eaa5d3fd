"""Symmetric plate impacts, and the wave that they send into the target."""

import numpy as np
from mpi4py import MPI

from mpisph.case import case_from_dict
from mpisph.solver.setup import step_rule
from mpisph.solver.start import start
from mpisph.solver.step import advance, reduce_state
from mpisph.sph.timestep import allowed_step, step_to


def plate_impact(velocity, thickness, radius, spacing, **scheme):
    """A flyer of 6061-T6 hits a target of the same at z = 0."""
    plate = {
        "shape": "plate",
        "material": "al-6061-t6",
        "thickness": thickness,
        "radius": radius,
    }
    return case_from_dict(
        {
            "title": "symmetric plate impact",
            "bodies": [
                {
                    **plate,
                    "name": "flyer",
                    "position": -thickness,
                    "velocity": velocity,
                },
                {**plate, "name": "target", "position": 0.0},
            ],
            "resolution": {"spacing": spacing, "nph": 1.5},
            "scheme": scheme,
            "time": {"end": 1e-5},
        }
    )


def states_at(case, times, comm=MPI.COMM_SELF):
    """Run a case and yield its simulation at each of the times."""
    sim = start(case, comm)
    for time in times:
        while sim.time < time:
            found = reduce_state(sim)
            dt = step_to(time - sim.time, allowed_step(step_rule(case), found.limit))
            advance(sim, dt, found.rank_boxes)
        yield sim


def front(sim, level):
    """Where u_z falls below `level` ahead of the wave, near the axis [m].

    Particles of one layer share their initial z, so they are averaged by layer.
    """
    p = sim.particles
    near = (p.r < 1e-3) & (p.body == 1)
    layer = np.round(p.z[near] / sim.case.spacing).astype(int)
    count = np.bincount(layer)
    used = count > 0
    z = np.bincount(layer, p.z[near])[used] / count[used]
    u = np.bincount(layer, p.u_z[near])[used] / count[used]
    i = np.flatnonzero(u > level).max()
    return z[i] + (u[i] - level) / (u[i] - u[i + 1]) * (z[i + 1] - z[i])
