"""A whole run: steps, triggers, files and the result."""

import time
from contextlib import ExitStack
from pathlib import Path

from mpi4py import MPI
from rich.console import Console

from mpisph.case import Case
from mpisph.collectives import on_root
from mpisph.compiled import warm_up
from mpisph.decomposition import imbalance
from mpisph.diagnostics import (
    ConservationErrors,
    conservation_errors,
    measure_cloud,
)
from mpisph.errors import UnstableError
from mpisph.files import write_text
from mpisph.history import History, HistoryRow
from mpisph.jit import CACHE_FOLDER, is_compiled
from mpisph.progress import Progress, RunLog, open_console
from mpisph.provenance import git_revision, versions
from mpisph.result import (
    CloudRecord,
    Conservation,
    Result,
    Status,
    Timing,
    make_comparisons,
    write_result,
)
from mpisph.simulation import Simulation, advance, rebalance, start, step_rule, survey
from mpisph.snapshot import SERIES_FILE, SNAPSHOTS_FOLDER, write_snapshot
from mpisph.stability import REASONS, STABLE
from mpisph.survey import Survey
from mpisph.timestep import step_to

CASE_FILE = "case.toml"

URGENT = 0.1
"""Imbalance that calls for a look at the load at once: in the first steps, when matter
is set in motion fastest."""


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
    """

    def __init__(
        self,
        sim: Simulation,
        folder: Path,
        history: History,
        progress: Progress,
        log: RunLog,
        provenance: dict[str, str],
    ) -> None:
        self.folder = folder
        self.history = history
        self.progress = progress
        self.log = log
        self.metadata = {"case": sim.case.to_toml(), **provenance}
        self.clouds: list[CloudRecord] = []
        self.snapshots = 0
        self.last_row: HistoryRow | None = None
        self.initial: list[float] | None = None
        self.errors = ConservationErrors(0.0, 0.0, 0.0)
        self.energy_error_max = 0.0
        self.begin = time.perf_counter()
        self.first_step: float | None = None

    @property
    def wall(self) -> float:
        """Wall time since the first step [s]."""
        return time.perf_counter() - self.begin

    def note(self, sim: Simulation, found: Survey, dt: float) -> None:
        """Take note of a step: conservation, history, progress."""
        if sim.step == 1:
            self.first_step = time.time()
        if self.initial is None:
            self.initial = found.sums.tolist()
        self.errors = conservation_errors(self.initial, found.sums)
        self.energy_error_max = max(self.energy_error_max, abs(self.errors.energy))
        self.last_row = self._row(sim, found, dt)
        if sim.step % sim.case.output.history_every == 0:
            self.write_last_row()
        self.progress.update(sim.time, sim.step, dt)

    def write_last_row(self) -> None:
        """Write the last step's line of the history, unless it has been written."""
        if self.last_row is not None:
            self.history.write(self.last_row)
            self.last_row = None

    def _row(self, sim: Simulation, found: Survey, dt: float) -> HistoryRow:
        mass, momentum, kinetic, internal = found.sums.tolist()
        radius, length = found.extent.tolist()
        return HistoryRow(
            step=sim.step,
            time=sim.time,
            dt=dt,
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
        self.log.write(
            f"{path.name}: t = {sim.time * 1e6:.4f} us, step {sim.step}, "
            f"R_b = {measure.radius * 1e3:.2f} mm, L_b = {measure.length * 1e3:.2f} mm"
        )


def run(
    case: Case, comm: MPI.Intracomm, folder: Path, console: Console | None = None
) -> Result:
    """Run a case and write its files into `folder`.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
        The run is collective over it; any number of ranks gives the same bits.
    folder : Path
        Made where missing. The files of an earlier run in it are replaced.
    console : rich.console.Console, optional
        For progress; by default the standard error.

    Returns
    -------
    Result
        On all ranks; its status is ``unstable`` for a run that broke down.

    Raises
    ------
    CaseError
        On all ranks, if there would be absurdly many particles.
    OSError
        On all ranks, if a file cannot be written.
    """
    console = console or open_console(stderr=True)
    on_root(comm, lambda: _prepare_folder(folder, case))
    with ExitStack() as stack:
        log = stack.enter_context(RunLog(folder, comm))
        history = stack.enter_context(History(folder, comm))
        log.write(f"{case.title}\n{comm.size} ranks, code cache {CACHE_FOLDER}")
        begin = time.perf_counter()
        if comm.rank == 0 and not is_compiled():
            console.print("compiling, once for this version: some 20 s")
        warm_up(comm)
        log.write(f"compiled code at hand after {time.perf_counter() - begin:.2f} s")
        sim = start(case, comm)
        log.write(f"{sim.n_total} particles")
        progress = stack.enter_context(Progress(comm, case.end_time, console, log=log))
        provenance = comm.bcast(_provenance() if comm.rank == 0 else None)
        recorder = Recorder(sim, folder, history, progress, log, provenance)
        failure = None
        try:
            step_to_end(sim, recorder)
        except UnstableError as error:
            failure = error
            log.write(str(error))
            recorder.save(sim)
        recorder.write_last_row()
        result = _conclude(sim, recorder, failure)
        log.write(f"{result.status}: {sim.step} steps in {recorder.wall:.2f} s")
    on_root(comm, lambda: write_result(folder, result))
    if case.output.figures:
        on_root(comm, lambda: _draw(folder))
    return result


def _draw(folder: Path) -> None:
    # Imported here: matplotlib takes longer to load than a small case to run.
    from mpisph.figures import draw_run

    draw_run(folder)


def _provenance() -> dict[str, str]:
    return {"revision": git_revision(), **versions()}


def _prepare_folder(folder: Path, case: Case) -> None:
    """Make the folder, clear away an earlier run's files, and write the case."""
    folder.mkdir(parents=True, exist_ok=True)
    stale = [
        *(folder / SNAPSHOTS_FOLDER).glob("snapshot_*"),
        *folder.glob("*.part"),
        *(folder / "figures").glob("cloud_*.png"),
        folder / SERIES_FILE,
        folder / "result.json",
    ]
    for path in stale:
        path.unlink(missing_ok=True)
    write_text(folder / CASE_FILE, case.to_toml())


def step_to_end(sim: Simulation, recorder: Recorder) -> None:
    """Advance a simulation through all output times of its case.

    Parameters
    ----------
    sim : Simulation
        At time zero.
    recorder : Recorder

    Raises
    ------
    UnstableError
        On all ranks, at the step at which the run broke down.
    """
    rule = step_rule(sim.case)
    targets = [0.0, *sim.case.output_times]
    dt = first_dt = 0.0
    while True:
        found = survey(sim)
        recorder.note(sim, found, dt)
        check_stable(sim, found, recorder.errors.energy)
        if sim.time >= targets[0]:
            recorder.save(sim)
            del targets[0]
            if not targets:
                return
        allowed = rule.allowed(found.limit)
        first_dt = first_dt or allowed
        _check_step(sim, found, allowed, first_dt)
        dt = step_to(targets[0] - sim.time, allowed)
        last = dt == targets[0] - sim.time
        make_step(sim, found, dt)
        if last:
            sim.time = targets[0]


def make_step(sim: Simulation, found: Survey, dt: float) -> None:
    """Advance by a step, and now and then share the particles out anew.

    Parameters
    ----------
    sim : Simulation
    found : Survey
        Taken before the step.
    dt : float
        Length of the step [s].
    """
    advance(sim, dt, found.claims)
    urgent = imbalance(found.work) > URGENT
    if urgent or sim.step % sim.case.parallel.rebalance_every == 0:
        rebalance(sim, found.work)


def check_stable(sim: Simulation, found: Survey, energy_error: float) -> None:
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


def _check_step(sim: Simulation, found: Survey, dt: float, first: float) -> None:
    """Raise where the step has collapsed."""
    ratio = sim.case.limits.step_ratio_min
    if dt < ratio * first:
        where = describe_particle(sim, found.limited_by)
        text = (
            f"the step has fallen to {dt:.3g} s, below {ratio:g} of the first: {where}"
        )
        raise UnstableError("step_collapse", sim.step, sim.time, found.limited_by, text)


def describe_particle(sim: Simulation, who: int) -> str:
    """Return where a particle is and in what state, for people; collective."""
    p = sim.particles
    mine = None
    for i in (p.id == who).nonzero()[0]:
        body = sim.case.bodies[int(p.body[i])].name
        mine = (
            f"particle {who} of {body} at r = {p.r[i]:.4g} m, z = {p.z[i]:.4g} m, "
            f"u = ({p.u_r[i]:.4g}, {p.u_z[i]:.4g}) m/s, rho = {p.rho[i]:.4g} kg/m3, "
            f"E = {p.E[i]:.4g} J/kg, h = {p.h[i]:.4g} m"
        )
    found = [text for text in sim.comm.allgather(mine) if text is not None]
    return found[0] if found else f"particle {who}"


def _longest_phases(sim: Simulation) -> dict[str, float]:
    """Return the time of each phase on the rank that spent most in it; collective."""
    longest: dict[str, float] = {}
    for seconds in sim.comm.allgather(sim.phases.seconds):
        for name, spent in seconds.items():
            longest[name] = max(longest.get(name, 0.0), spent)
    return longest


def _conclude(
    sim: Simulation, recorder: Recorder, failure: UnstableError | None
) -> Result:
    """Gather what the result holds; collective."""
    wall = sim.comm.allreduce(recorder.wall, MPI.MAX)
    interactions = sim.comm.allreduce(sim.interactions, MPI.SUM)
    phases = _longest_phases(sim)
    stepping = wall - phases.get("output", 0.0)
    status: Status = "completed" if failure is None else "unstable"
    return Result(
        title=sim.case.title,
        status=status,
        reason=failure.reason if failure else None,
        detail=failure.detail if failure else None,
        step=sim.step,
        time=sim.time,
        particle=failure.particle if failure else None,
        particles=sim.n_total,
        clouds=tuple(recorder.clouds),
        comparisons=make_comparisons(sim.case, recorder.clouds),
        conservation=Conservation(
            mass_error=recorder.errors.mass,
            momentum_z_error=recorder.errors.momentum_z,
            energy_error_final=recorder.errors.energy,
            energy_error_max=recorder.energy_error_max,
        ),
        timing=Timing(
            ranks=sim.comm.size,
            steps=sim.step,
            wall=wall,
            step_ms=1e3 * stepping / max(sim.step, 1),
            interaction_ns=1e9 * stepping * sim.comm.size / max(interactions, 1),
            phases=phases,
            first_step=recorder.first_step,
        ),
        versions=versions(),
        revision=recorder.metadata["revision"],
    )
