"""What a run yields: snapshots, history, and all that its result needs.

The state of a run is what a checkpoint holds beside the particles.
"""

import time
from pathlib import Path

import numpy as np
from mpi4py import MPI
from pydantic import BaseModel, ConfigDict

from mpisph.case import Case
from mpisph.core.errors import MpisphError, UnstableError
from mpisph.core.particles import IntArray
from mpisph.diagnostics.diagnostics import (
    ConservationErrors,
    conservation_errors,
    measure_cloud,
)
from mpisph.io.checkpoint import PARTICLE_BYTES, Checkpoint, write_checkpoint
from mpisph.io.history import History, HistoryRow
from mpisph.io.provenance import versions
from mpisph.io.result import (
    CloudRecord,
    Conservation,
    Ending,
    Result,
    Timing,
    make_comparisons,
)
from mpisph.io.snapshot import write_snapshot
from mpisph.parallel.collectives import from_root, raise_together
from mpisph.parallel.decomposition import imbalance
from mpisph.run.progress import Progress, RunLog
from mpisph.solver.reduction import Survey
from mpisph.solver.simulation import Scales, Simulation, restore


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
    energy_scale: float
    """Specific energy of the run [J/kg]."""
    sum_bounds: tuple[float, ...]
    """Bounds of one particle's terms of the conserved sums."""
    initial: tuple[float, ...] | None
    """Conserved sums at the start."""
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
    phases: dict[str, float]
    """Time in each phase, on the rank that spent most in it [s]."""


class Recorder:
    """Writes what a run yields, and remembers what its result needs.

    Parameters
    ----------
    sim : Simulation
    folder : Path
    history : History
    progress : Progress
    log : RunLog
    provenance : dict of str to str
        Versions and revision, written into every snapshot.
    state : RunState, optional
        That of the checkpoint from which the run goes on.
    """

    def __init__(
        self,
        sim: Simulation,
        folder: Path,
        history: History,
        progress: Progress,
        log: RunLog,
        provenance: dict[str, str],
        state: RunState | None = None,
    ) -> None:
        self.folder = folder
        self.history = history
        self.progress = progress
        self.log = log
        self.provenance = provenance
        self.metadata = {"case": sim.case.to_toml(), **provenance}
        self.clouds: list[CloudRecord] = list(state.clouds) if state else []
        self.snapshots = state.snapshots if state else 0
        self.initial = list(state.initial) if state and state.initial else None
        self.energy_error_max = state.energy_error_max if state else 0.0
        self.errors = ConservationErrors(0.0, 0.0, 0.0)
        self._unwritten: Survey | None = None
        self.begin = time.perf_counter() - (state.wall if state else 0.0)
        self.first_step: float | None = None
        self._spent = (state.wall, state.rank_seconds) if state else (0.0, 0.0)
        self._interactions = state.interactions if state else 0
        self._phases = state.phases if state else {}

    @property
    def wall(self) -> float:
        """Wall time since the first step, time between runs left out [s]."""
        return time.perf_counter() - self.begin

    def note(self, sim: Simulation, found: Survey) -> None:
        """Take note of a step: conservation, history, progress."""
        if sim.step == 1:
            self.first_step = time.time()
        if self.initial is None:
            self.initial = found.sums.tolist()
        self.errors = conservation_errors(self.initial, found.sums)
        self.energy_error_max = max(self.energy_error_max, abs(self.errors.energy))
        self._unwritten = found
        if sim.step % sim.case.output.history_every == 0:
            self.write_last_row(sim)
        self.progress.update(sim.time, sim.step, sim.dt)

    def write_last_row(self, sim: Simulation) -> None:
        """Write the last step's line of the history, unless it has been written."""
        if self._unwritten is not None:
            self.history.add(self._row(sim, self._unwritten))
            self._unwritten = None

    def _row(self, sim: Simulation, found: Survey) -> HistoryRow:
        mass, momentum, kinetic, internal = found.sums.tolist()
        radius, length = found.extent.tolist()
        return HistoryRow(
            step=sim.step,
            time=sim.time,
            dt=sim.dt,
            mass=mass,
            momentum_z=momentum,
            kinetic_energy=kinetic,
            internal_energy=internal,
            energy_error=self.errors.energy,
            cloud_radius=radius,
            cloud_length=length,
            cloud_mass=found.cloud_mass,
            imbalance=imbalance(found.work),
            wall=self.wall,
        )

    def save(self, sim: Simulation) -> None:
        """Write a snapshot and measure the cloud."""
        with sim.phases.measure("output"):
            path = write_snapshot(
                sim.comm,
                self.folder,
                self.snapshots,
                sim.particles,
                time=sim.time,
                step=sim.step,
                metadata=self.metadata,
                n_total=sim.n_total,
            )
            self.snapshots += 1
            measure = measure_cloud(sim.comm, sim.particles, sim.cloud)
        if sim.time in sim.case.output_times:
            self.clouds.append(CloudRecord.of(sim.time, measure))
        self.log.say(
            f"{path.name}: t = {sim.time * 1e6:.4f} us, step {sim.step}, "
            f"R_b = {measure.radius * 1e3:.2f} mm, L_b = {measure.length * 1e3:.2f} mm"
        )

    def save_checkpoint(self, sim: Simulation) -> None:
        """Write a checkpoint of the state before this step is taken note of."""
        with sim.phases.measure("output") as watch:
            state = self._state(sim).model_dump_json()
            path = write_checkpoint(
                sim.comm, self.folder, sim.step, sim.particles, sim.n_total, state
            )
        size = sim.n_total * PARTICLE_BYTES / 1e6
        self.log.say(f"{path.name}: {size:.2f} MB in {watch.spent:.3f} s")

    def warn(self, text: str) -> None:
        """Tell people of something that does not keep the run from going on."""
        self.progress.tell(f"warning: {text}")

    def _state(self, sim: Simulation) -> RunState:
        """Return the state of the run; collective."""
        wall = self.wall
        return RunState(
            case=self.metadata["case"],
            provenance=self.provenance,
            time=sim.time,
            step=sim.step,
            dt=sim.dt,
            first_dt=sim.first_dt,
            energy_scale=sim.scales.energy,
            sum_bounds=tuple(sim.scales.sums.tolist()),
            initial=None if self.initial is None else tuple(self.initial),
            energy_error_max=self.energy_error_max,
            snapshots=self.snapshots,
            clouds=tuple(self.clouds),
            history_bytes=from_root(sim.comm, self.history.save),
            wall=wall,
            rank_seconds=self._rank_seconds(sim.comm.size, wall),
            interactions=self._all_interactions(sim),
            phases=self._longest_phases(sim),
        )

    def _rank_seconds(self, ranks: int, wall: float) -> float:
        """Return the time over all ranks, where that on the wall is `wall` [s]."""
        before, rank_seconds = self._spent
        return rank_seconds + ranks * (wall - before)

    def _all_interactions(self, sim: Simulation) -> int:
        """Return the interactions of all ranks since the run's start; collective."""
        here: int = sim.comm.allreduce(sim.interactions, MPI.SUM)
        return self._interactions + here

    def _longest_phases(self, sim: Simulation) -> dict[str, float]:
        """Return for each phase the time of the rank that spent most; collective."""
        longest: dict[str, float] = {}
        for seconds in sim.comm.allgather(sim.phases.seconds):
            for name, spent in seconds.items():
                longest[name] = max(longest.get(name, 0.0), spent)
        names = dict.fromkeys((*self._phases, *longest))
        return {n: self._phases.get(n, 0.0) + longest.get(n, 0.0) for n in names}

    def conclude(
        self,
        sim: Simulation,
        status: Ending,
        failure: UnstableError | None = None,
        reason: str | None = None,
    ) -> Result:
        """Gather what the result holds; collective."""
        wall = sim.comm.allreduce(self.wall, MPI.MAX)
        interactions = self._all_interactions(sim)
        phases = self._longest_phases(sim)
        stepping = wall - phases.get("output", 0.0)
        rank_stepping = self._rank_seconds(sim.comm.size, wall) * stepping / wall
        return Result(
            title=sim.case.title,
            status=status,
            reason=failure.reason if failure else reason,
            detail=failure.detail if failure else None,
            step=sim.step,
            time=sim.time,
            particle=failure.particle if failure else None,
            particles=sim.n_total,
            clouds=tuple(self.clouds),
            comparisons=make_comparisons(sim.case, self.clouds),
            conservation=Conservation(
                mass_error=self.errors.mass,
                momentum_z_error=self.errors.momentum_z,
                energy_error_final=self.errors.energy,
                energy_error_max=self.energy_error_max,
            ),
            timing=Timing(
                ranks=sim.comm.size,
                steps=sim.step,
                wall=wall,
                step_ms=1e3 * stepping / max(sim.step, 1),
                interaction_ns=1e9 * rank_stepping / max(interactions, 1),
                phases=phases,
                first_step=self.first_step,
            ),
            versions=versions(),
            revision=self.provenance["revision"],
        )


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
    scales = Scales(state.energy_scale, np.array(state.sum_bounds))
    sim = restore(case, comm, checkpoint.particles, checkpoint.n_total, scales)
    sim.time, sim.step = state.time, state.step
    sim.dt, sim.first_dt = state.dt, state.first_dt
    return sim


def _within(labels: IntArray, end: int) -> bool:
    """Say whether all labels lie in ``[0, end)``."""
    return bool(np.all((labels >= 0) & (labels < end)))
