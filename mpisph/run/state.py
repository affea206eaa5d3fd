"""The state of a run between two steps, without its particles."""

import numpy as np
from mpi4py import MPI
from pydantic import BaseModel, ConfigDict

from mpisph.case import Case
from mpisph.core.errors import MpisphError
from mpisph.core.particles import IntArray
from mpisph.diagnostics.series import Scales
from mpisph.io.checkpoint import Checkpoint
from mpisph.io.result import (
    CloudRecord,
)
from mpisph.parallel.collectives import raise_together
from mpisph.solver.start import restore
from mpisph.solver.state import Simulation


class RunState(BaseModel):
    """The state of a run between two steps, without its particles.

    Numbers come back from its JSON with all of their bits.
    """

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="constants")

    case: str
    """The resolved case as TOML."""
    provenance: dict[str, str]
    """Versions and revision of the program that wrote it."""
    time: float
    """[s]."""
    step: int
    """Steps made."""
    dt: float
    """Length of the last step [s]."""
    first_dt: float
    """Length allowed for the first step [s]."""
    scales: Scales
    """Magnitudes of the run, taken at its start."""
    initial: dict[str, float] | None
    """The series at the start, by name."""
    energy_error_max: float
    """Largest energy error so far."""
    snapshots: int
    """Number of snapshots written."""
    clouds: tuple[CloudRecord, ...]
    """The cloud at the requested times reached so far."""
    history_bytes: int
    """Size of the history up to this step [bytes]."""
    wall: float
    """Time spent [s]."""
    rank_seconds: float
    """Time spent, over all ranks [s]."""
    interactions: int
    """Directed interactions evaluated by all ranks."""
    timers: dict[str, float]
    """Time in each phase, on the rank that spent most in it [s]."""


def restored(
    case: Case, comm: MPI.Intracomm, checkpoint: Checkpoint, state: RunState
) -> Simulation:
    """Return the simulation that a checkpoint holds; collective.

    Parameters
    ----------
    case : Case
        The state's.
    comm : MPI.Intracomm
    checkpoint : Checkpoint
    state : RunState
        The checkpoint's.

    Raises
    ------
    MpisphError
        On all ranks, if a particle is of a body or of a material that is not there.
    """
    p = checkpoint.particles
    sound = _within(p.body, len(case.bodies)) and _within(
        p.material, len(case.material_table)
    )
    error = None if sound else MpisphError("the checkpoint's particles are no case's")
    raise_together(comm, error)
    sim = restore(case, comm, checkpoint.particles, checkpoint.n_total, state.scales)
    sim.time, sim.step = state.time, state.step
    sim.dt, sim.first_dt = state.dt, state.first_dt
    return sim


def _within(labels: IntArray, end: int) -> bool:
    """Say whether all labels lie in ``[0, end)``."""
    return bool(np.all((labels >= 0) & (labels < end)))
