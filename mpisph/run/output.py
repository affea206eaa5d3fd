"""What a run writes as it steps: snapshots, history, checkpoints, its result."""

import time
from pathlib import Path

from mpi4py import MPI

from mpisph.core.errors import UnstableError
from mpisph.diagnostics.cloud import measure_cloud, next_body
from mpisph.diagnostics.condition import measure_condition
from mpisph.diagnostics.conservation import ConservationErrors, conservation_errors
from mpisph.io.checkpoint import PARTICLE_BYTES, write_checkpoint
from mpisph.io.history import History, Row
from mpisph.io.provenance import versions
from mpisph.io.result import (
    CloudRecord,
    Conservation,
    Ending,
    Result,
    Timing,
    body_records,
    make_comparisons,
)
from mpisph.io.run_log import RunLog
from mpisph.io.snapshot import write_snapshot
from mpisph.io.verdict import Verdict, WallRecord
from mpisph.io.written import SnapshotRecord
from mpisph.parallel.collectives import from_root
from mpisph.parallel.load_balance import imbalance
from mpisph.run.probing import Probes
from mpisph.run.progress import Progress
from mpisph.run.state import RunState
from mpisph.run.wall_gauge import WallGauge
from mpisph.solver.reduction import Reduction
from mpisph.solver.state import Simulation


class RunOutput:
    """Writes what a run computes, and remembers what its result needs.

    Parameters
    ----------
    sim : Simulation
    folder : Path
    history : History
    probes : Probes
    progress : Progress
    log : RunLog
    provenance : dict of str to str
        Versions and revision, written into every snapshot.
    state : RunState, optional
        That of the checkpoint from which the run continues.
    damage : dict of str to str, optional
        Files found damaged, and what they are.
    """

    def __init__(
        self,
        sim: Simulation,
        folder: Path,
        history: History,
        probes: Probes,
        progress: Progress,
        log: RunLog,
        provenance: dict[str, str],
        state: RunState | None = None,
        damage: dict[str, str] | None = None,
    ) -> None:
        self.folder = folder
        self.history = history
        self.probes = probes
        self.progress = progress
        self.log = log
        self.provenance = provenance
        self.metadata = {"case": sim.case.to_toml(), **provenance}
        self.clouds: list[CloudRecord] = list(state.clouds) if state else []
        self.walls: list[WallRecord] = list(state.walls) if state else []
        self._wall_gauge = WallGauge(sim.case) if sim.case.shield else None
        self.snapshots = list(state.snapshots) if state else []
        self.damage = damage or {}
        self.initial = state.initial if state else None
        self.energy_error_max = state.energy_error_max if state else 0.0
        self.cloud_arrival = state.cloud_arrival if state else None
        self.lowest_energy = state.lowest_energy if state else 0.0
        self.errors = ConservationErrors(0.0, 0.0, 0.0)
        self._unwritten: Reduction | None = None
        self.begin = time.perf_counter() - (state.wall if state else 0.0)
        self.first_step: float | None = None
        self._spent = (state.wall, state.rank_seconds) if state else (0.0, 0.0)
        self._interactions = state.interactions if state else 0
        self._timers = state.timers if state else {}

    @property
    def wall(self) -> float:
        """Wall time since the first step, time between runs left out [s]."""
        return time.perf_counter() - self.begin

    def add_step(self, sim: Simulation, found: Reduction) -> None:
        """Add a step to the conservation errors, the history and the progress."""
        if sim.step == 1:
            self.first_step = time.time()
        if self.initial is None:
            self.initial = found.series
        self.lowest_energy = min(self.lowest_energy, found.series["energy_min"])
        self._note_arrival(sim, found)
        self.errors = conservation_errors(self.initial, found.series)
        self.energy_error_max = max(self.energy_error_max, abs(self.errors.energy))
        self._unwritten = found
        self.probes.note_step(sim)
        if sim.step % sim.case.output.history_every == 0:
            self.write_last_row(sim)
        self.progress.update(sim.time, sim.step, sim.dt)

    def _note_arrival(self, sim: Simulation, found: Reduction) -> None:
        """Say once that the cloud has come to the next body."""
        if self.cloud_arrival is None and found.series["cloud_arrived"]:
            self.cloud_arrival = sim.time
            hit = next_body(sim.case)
            assert hit is not None, "what the cloud has reached"
            self.progress.tell(
                f"the cloud has reached {hit.name} at t = {sim.time * 1e6:.4f} us: its "
                "measures end"
            )

    def write_last_row(self, sim: Simulation) -> None:
        """Write the last step's line of all tables, unless it has been; collective."""
        if self._unwritten is not None:
            with sim.timers.measure("bodies and gauges"):
                self.probes.add_row(sim)
            self.history.add(self._row(sim, self._unwritten))
            self._unwritten = None

    def _row(self, sim: Simulation, found: Reduction) -> Row:
        return {
            "step": sim.step,
            "time": sim.time,
            "dt": sim.dt,
            **found.series,
            "energy_error": self.errors.energy,
            "imbalance": imbalance(found.work),
            "wall": self.wall,
        }

    def save_snapshot(self, sim: Simulation) -> None:
        """Write a snapshot and measure the cloud."""
        with sim.timers.measure("output"):
            path = write_snapshot(
                sim.comm,
                self.folder,
                len(self.snapshots),
                sim.everything,
                time=sim.time,
                step=sim.step,
                metadata=self.metadata,
                n_total=sim.n_total,
                fields=sim.case.saved_fields,
            )
            record = from_root(sim.comm, lambda: SnapshotRecord.of(path, sim.time))
            self.snapshots.append(record)
            measure = measure_cloud(sim.comm, sim.particles, sim.cloud)
            if self._wall_gauge is not None:
                self.walls.append(self._wall_gauge.measure(sim))
        if sim.time in sim.case.output_times:
            self.clouds.append(CloudRecord.of(sim.time, measure, sim.case))
        self.log.say(
            f"{path.name}: t = {sim.time * 1e6:.4f} us, step {sim.step}, "
            f"R_b = {measure.radius * 1e3:.2f} mm, L_b = {measure.length * 1e3:.2f} mm"
        )

    def save_checkpoint(self, sim: Simulation) -> None:
        """Write a checkpoint of the state before this step is added."""
        with sim.timers.measure("output") as watch:
            state = self._state(sim).model_dump_json()
            path = write_checkpoint(
                sim.comm, self.folder, sim.step, sim.everything, sim.n_total, state
            )
        size = sim.n_total * PARTICLE_BYTES / 1e6
        self.log.say(f"{path.name}: {size:.2f} MB in {watch.spent:.3f} s")

    def warn(self, text: str) -> None:
        """Say what is wrong, on the console and in the log; the run continues."""
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
            scales=sim.scales,
            initial=self.initial,
            energy_error_max=self.energy_error_max,
            snapshots=tuple(self.snapshots),
            clouds=tuple(self.clouds),
            cloud_arrival=self.cloud_arrival,
            walls=tuple(self.walls),
            lowest_energy=self.lowest_energy,
            history=from_root(sim.comm, self.history.saved),
            probes=self.probes.state(sim),
            damage=self.damage,
            wall=wall,
            rank_seconds=self._rank_seconds(sim.comm.size, wall),
            interactions=self._all_interactions(sim),
            timers=self._longest_timers(sim),
        )

    def _rank_seconds(self, ranks: int, wall: float) -> float:
        """Return the time over all ranks, where that on the wall is `wall` [s]."""
        before, rank_seconds = self._spent
        return rank_seconds + ranks * (wall - before)

    def _all_interactions(self, sim: Simulation) -> int:
        """Return the interactions of all ranks since the run's start; collective."""
        here: int = sim.comm.allreduce(sim.interactions, MPI.SUM)
        return self._interactions + here

    def _longest_timers(self, sim: Simulation) -> dict[str, float]:
        """Return for each phase the time of the rank that spent most; collective."""
        longest: dict[str, float] = {}
        for seconds in sim.comm.allgather(sim.timers.seconds):
            for name, spent in seconds.items():
                longest[name] = max(longest.get(name, 0.0), spent)
        names = dict.fromkeys((*self._timers, *longest))
        return {n: self._timers.get(n, 0.0) + longest.get(n, 0.0) for n in names}

    def _verdict(
        self, sim: Simulation, failure: UnstableError | None
    ) -> Verdict | None:
        """Return the verdict on a shield's wall; None where there is none."""
        if sim.case.shield is None:
            return None
        # Imported here: only shields need it.
        from mpisph.analysis.verdict import judge

        return judge(sim.case, self.walls, failure.detail if failure else None)

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
        timers = self._longest_timers(sim)
        conditions = measure_condition(
            sim.comm, sim.everything, len(sim.case.bodies), sim.scales
        )
        stepping = wall - timers.get("output", 0.0)
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
            cloud_arrival=self.cloud_arrival,
            lowest_energy=self.lowest_energy,
            comparisons=make_comparisons(sim.case, self.clouds),
            bodies=body_records(sim.case, conditions),
            walls=tuple(self.walls),
            verdict=self._verdict(sim, failure) if status != "stopped" else None,
            conservation=Conservation(
                mass_error=self.errors.mass,
                momentum_z_error=(
                    None if sim.case.boundary.exists else self.errors.momentum_z
                ),
                energy_error_final=self.errors.energy,
                energy_error_max=self.energy_error_max,
            ),
            timing=Timing(
                ranks=sim.comm.size,
                steps=sim.step,
                wall=wall,
                step_ms=1e3 * stepping / max(sim.step, 1),
                interaction_ns=1e9 * rank_stepping / max(interactions, 1),
                timers=timers,
                first_step=self.first_step,
            ),
            versions=versions(),
            revision=self.provenance["revision"],
            damage=tuple(f"{name}: {text}" for name, text in self.damage.items()),
        )
