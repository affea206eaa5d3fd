"""The state of a run between two steps, and how a checkpoint brings it back."""

import tomllib
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mpi4py import MPI
from pydantic import BaseModel, ConfigDict

from mpisph.case import Case, case_from_dict
from mpisph.case.extension import is_extension
from mpisph.core.errors import CaseError, MpisphError, os_error_text
from mpisph.core.particles import IntArray
from mpisph.diagnostics.series import Scales
from mpisph.io.checkpoint import (
    Checkpoint,
    DamagedError,
    find_checkpoints,
    read_checkpoint,
    read_state,
)
from mpisph.io.files import set_aside
from mpisph.io.history import HEADER, HISTORY_FILE, Beginning, keep_rows
from mpisph.io.probe_files import ProbeState, probe_headers
from mpisph.io.result import CloudRecord
from mpisph.io.run_folder import CASE_FILE
from mpisph.io.snapshot import SNAPSHOTS_FOLDER, write_series
from mpisph.io.verdict import WallRecord
from mpisph.io.written import Fault, SnapshotRecord, find_faults
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
    snapshots: tuple[SnapshotRecord, ...]
    """The snapshots written."""
    clouds: tuple[CloudRecord, ...]
    """The cloud at the requested times reached so far."""
    cloud_arrival: float | None
    """When the cloud came to the next body [s]."""
    walls: tuple[WallRecord, ...] = ()
    """The wall of a shield at the output times reached so far."""
    lowest_energy: float
    """Lowest specific internal energy so far [J/kg]."""
    history: Beginning
    """The history up to this step."""
    probes: ProbeState
    """What is followed of bodies and at gauges."""
    damage: dict[str, str]
    """Files that were found damaged and could not be written again: what they are."""
    wall: float
    """Time spent [s]."""
    rank_seconds: float
    """Time spent, over all ranks [s]."""
    interactions: int
    """Directed interactions evaluated by all ranks."""
    timers: dict[str, float]
    """Time in each phase, on the rank that spent most in it [s]."""


class Loaded(NamedTuple):
    """A run as a checkpoint holds it.

    Attributes
    ----------
    sim : Simulation
    state : RunState
    faults : list of Fault
        What of the run so far is not in the folder as it was written.
    """

    sim: Simulation
    state: RunState
    faults: list[Fault]


class _Found(NamedTuple):
    """A sound checkpoint, and what has been damaged before it."""

    path: Path
    checkpoint: Checkpoint
    state: RunState
    faults: list[Fault]


def load_last_state(
    case: Case, comm: MPI.Intracomm, folder: Path, say: Callable[[str], object]
) -> Loaded | None:
    """Return a run as its last sound checkpoint holds it; collective.

    Where a file from before that checkpoint is damaged, and an earlier checkpoint
    would have it written again, that one is taken.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
    folder : Path
        Folder of the run. Damaged checkpoints in it are renamed.
    say : callable
        Takes lines to print: which checkpoint it is, and what is damaged.

    Returns
    -------
    Loaded or None
        None where there is no sound checkpoint.

    Raises
    ------
    MpisphError
        On all ranks, if a checkpoint is of another version or of another case.
    OSError
        On all ranks, if no checkpoint can be read, but another time one may.
    """
    found, unreadable = _sound_checkpoints(case, comm, folder, say)
    if not found:
        if unreadable is not None:
            raise unreadable
        return None
    path, checkpoint, state, faults = min(found, key=lambda one: len(one.faults))
    for fault in found[0].faults:
        if fault not in faults:
            say(f"{folder / fault.name}: {fault.text}; it is written again")
    say(f"continuing from {path.name}, t = {state.time * 1e6:.4f} us")
    return Loaded(restored(case, comm, checkpoint, state), state, faults)


def _sound_checkpoints(
    case: Case, comm: MPI.Intracomm, folder: Path, say: Callable[[str], object]
) -> tuple[list[_Found], OSError | None]:
    """Return sound checkpoints, the last first, down to one without faults before it.

    And the error of a checkpoint that could not be read, where there is one.
    """
    sound: list[_Found] = []
    unreadable = None
    for path in from_root(comm, partial(find_checkpoints, folder)):
        try:
            sound.append(_look_at(case, comm, path))
        except DamagedError as error:
            aside = from_root(comm, partial(set_aside, path))
            say(f"{error}; kept as {aside.name}")
        except OSError as error:
            unreadable = error
            say(f"{os_error_text(error)}: {path} is left as it is")
        except MpisphError:
            if not sound:
                raise
        if sound and not sound[-1].faults:
            break
    return sound, unreadable


def _look_at(case: Case, comm: MPI.Intracomm, path: Path) -> _Found:
    """Read a checkpoint, and compare the folder with what it says; collective."""
    checkpoint = read_checkpoint(comm, path)
    state = _state_in(checkpoint, path, case)
    faults = from_root(comm, partial(_faults, path.parents[1], state))
    return _Found(path, checkpoint, state, faults)


def _faults(folder: Path, state: RunState) -> list[Fault]:
    return find_faults(folder, state.snapshots, _tables(state))


def _tables(state: RunState) -> dict[str, Beginning]:
    return {HISTORY_FILE: state.history, **state.probes.tables}


def faults_of_ended(folder: Path) -> list[Fault]:
    """Return what is damaged in the folder of a run that has ended.

    As far as its last checkpoint tells; call it on rank 0.
    """
    for path in find_checkpoints(folder):
        with suppress(MpisphError, OSError, ValueError):
            return _faults(folder, RunState.model_validate_json(read_state(path)))
    return []


class Mended(NamedTuple):
    """What is left of a run after mending.

    Attributes
    ----------
    damage : dict of str to str
        The files that remain damaged, with what they are; those of earlier starts too.
    sizes : dict of str to int
        Of the history and the other tables to continue [bytes].
    """

    damage: dict[str, str]
    sizes: dict[str, int]


def mend(folder: Path, loaded: Loaded) -> Mended:
    """Write again what can be of a damaged run; call it on rank 0.

    Snapshots that cannot be opened are renamed, the list of snapshots is made anew, and
    of the history the rows that can be read are kept.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    state, faults = loaded.state, loaded.faults
    tables = _tables(state)
    sizes = {name: beginning.size for name, beginning in tables.items()}
    case = case_from_dict(tomllib.loads(state.case))
    headers = {HISTORY_FILE: HEADER, **probe_headers(case)}
    lost, damage = set(), {}
    for name, kind, text in faults:
        damage[name] = text
        if name in tables:
            every, path = case.output.history_every, folder / name
            kept, wanted = keep_rows(path, state.step, every, headers[name])
            damage[name] = f"{text}; {kept} of {wanted} rows kept"
            sizes[name] = path.stat().st_size
        elif kind in {"missing", "broken"}:
            lost.add(name)
        if kind == "broken":
            damage[name] = f"{text}; kept as {set_aside(folder / name).name}"
    listed = [
        (folder / SNAPSHOTS_FOLDER / record.name, record.time)
        for record in state.snapshots
        if f"{SNAPSHOTS_FOLDER}/{record.name}" not in lost
    ]
    write_series(folder, listed)
    earlier = {
        name: text
        for name, text in state.damage.items()
        if name in tables or name in damage
    }
    return Mended(damage | earlier, sizes)


def _state_in(checkpoint: Checkpoint, path: Path, case: Case) -> RunState:
    """Return the state in a checkpoint, which must be one of this case.

    Or of one that this case extends.

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
    if not is_extension(stored, case):
        raise MpisphError(
            f"{path}: belongs to another case than {CASE_FILE} beside it; was that "
            "changed? Without it, the case in the checkpoint counts"
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
