"""The state of a run between two steps, and how a checkpoint brings it back."""

import tomllib
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from mpi4py import MPI
from pydantic import BaseModel, ConfigDict

from mpisph.case import Case, case_from_dict
from mpisph.case.identity import differences
from mpisph.core.errors import CaseError, MpisphError
from mpisph.core.particles import IntArray
from mpisph.diagnostics.series import Scales
from mpisph.io.checkpoint import (
    Checkpoint,
    DamagedError,
    find_checkpoints,
    read_checkpoint,
    set_aside,
)
from mpisph.io.result import CloudRecord
from mpisph.io.run_folder import CASE_FILE
from mpisph.parallel.collectives import from_root, raise_together
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
    cloud_arrival: float | None
    """When the cloud came to the next body [s]."""
    lowest_energy: float
    """Lowest specific internal energy so far [J/kg]."""
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


def load_last_state(
    case: Case, comm: MPI.Intracomm, folder: Path, say: Callable[[str], object]
) -> tuple[Simulation, RunState] | None:
    """Return a run as its last sound checkpoint holds it; collective.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
    folder : Path
        Folder of the run. Damaged checkpoints in it are renamed.
    say : callable
        Takes lines to print: which checkpoint it is, and which are damaged.

    Returns
    -------
    (Simulation, RunState) or None
        None where there is no sound checkpoint.

    Raises
    ------
    MpisphError
        On all ranks, if a checkpoint is of another version or of another case.
    OSError
        On all ranks, if a checkpoint cannot be read: another time it may.
    """
    for path in from_root(comm, lambda: find_checkpoints(folder)):
        try:
            checkpoint = read_checkpoint(comm, path)
        except DamagedError as error:
            aside = from_root(comm, partial(set_aside, path))
            say(f"{error}; kept as {aside.name}")
            continue
        state = _state_in(checkpoint, path, case)
        say(f"continuing from {path.name}, t = {state.time * 1e6:.4f} us")
        return restored(case, comm, checkpoint, state), state
    say(f"{folder}: no sound checkpoint; starting from the beginning")
    return None


def _state_in(checkpoint: Checkpoint, path: Path, case: Case) -> RunState:
    """Return the state in a checkpoint, which must be one of this case.

    Raises
    ------
    MpisphError
        If it is of another version or of another case, or holds what cannot be.
    """
    try:
        state = RunState.model_validate_json(checkpoint.state)
        stored = case_from_dict(tomllib.loads(state.case))
    except (ValueError, CaseError) as error:
        raise MpisphError(
            f"{path}: written by another version of mpisph; `mpisph run --force` "
            "starts over"
        ) from error
    if differences(stored, case):
        raise MpisphError(
            f"{path}: belongs to another case than {CASE_FILE} beside it; was that "
            "changed?"
        )
    return state


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
