"""A whole run in its folder: started, resumed from a checkpoint, and how it ended.

What counts is ``status.json``. A run starts where its folder holds none, continues from
the last sound checkpoint where it was stopped, failed or was killed, and is not
repeated once it has ended. One that has completed can be extended: it then continues
from the checkpoint at its end.
"""

import time
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from functools import partial
from os import PathLike
from pathlib import Path

import numpy.typing as npt
from mpi4py import MPI
from rich.console import Console

from mpisph.case import Case, load_case
from mpisph.case.discretise import InitialParticles
from mpisph.case.extension import extended_case
from mpisph.case.identity import differences
from mpisph.case.initial import complete_particles, read_initial, with_particles
from mpisph.case.model import INITIAL_FILE
from mpisph.case.plausibility import find_warnings
from mpisph.core.console import open_console
from mpisph.core.errors import CollectiveError, MpisphError, UnstableError
from mpisph.core.jit import CACHE_FOLDER, is_compiled
from mpisph.core.words import counted
from mpisph.io.checkpoint import find_checkpoints, keep_last_checkpoint
from mpisph.io.files import write_text
from mpisph.io.history import HISTORY_FILE, History
from mpisph.io.initial_file import write_initial
from mpisph.io.lock import FolderLock
from mpisph.io.provenance import git_revision, versions
from mpisph.io.result import RESULT_FILE, Ending, Result, read_result, write_result
from mpisph.io.run_folder import (
    CASE_FILE,
    known_case,
    known_status,
    no_run,
    remove_parts,
    remove_run,
    restore_status,
    status_of_case,
)
from mpisph.io.run_log import RunLog
from mpisph.io.snapshot import snapshot_path, snapshot_time
from mpisph.io.status import FINAL, STATUS_FILE, Status, StatusFile
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.checkpointing import CheckpointPolicy, StopRequested
from mpisph.run.loop import step_to_end
from mpisph.run.output import RunOutput
from mpisph.run.probing import Probes
from mpisph.run.progress import Progress
from mpisph.run.signals import SignalHandler
from mpisph.run.state import Loaded, faults_of_ended, load_last_state, mend
from mpisph.solver.estimate import check_memory, estimate
from mpisph.solver.start import check_expressions, start
from mpisph.solver.state import Simulation
from mpisph.solver.warmup import warm_up


def run(
    case: Case,
    comm: MPI.Intracomm,
    folder: str | PathLike[str],
    console: Console | None = None,
    *,
    particles: Mapping[str, npt.ArrayLike] | None = None,
    force: bool = False,
    signals: SignalHandler | None = None,
) -> Result:
    """Run a case and write its files into a folder, or continue the run there.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
        The run is collective over it; any number of ranks gives the same bits.
    folder : path
        Made where missing. A run in it that was stopped or killed is continued; one
        that has ended is left as it is.
    console : rich.console.Console, optional
        For progress; by default the standard error.
    particles : mapping of str to array_like, shape (n,), optional
        Particles to start from, instead of those that fill the bodies, as arrays by
        field: see `case.initial.complete_particles`. Those of rank 0 count; other
        ranks may give the same or None. They are kept in ``initial.h5``.
    force : bool, optional
        Whether to start over, and remove the files of the run in the folder.
    signals : SignalHandler, optional
        Signals and limits that stop the run; by default only the file ``stop`` in the
        folder does.

    Returns
    -------
    Result
        On all ranks; its status is ``unstable`` for a run that broke down, and
        ``stopped`` for one that was asked to stop.

    Raises
    ------
    CaseError
        On all ranks, if the folder holds a run of another case, if the particles would
        not fit into the nodes' memory, or if those given are not sound.
    InUseError
        On all ranks, if another run is at work in the folder.
    MpisphError
        On all ranks, if the folder holds files of a run but no status.
    OSError
        On all ranks, if a file cannot be written; on rank 0 alone, if it is the history
        or the log: started with ``python -m mpi4py``, a program then ends on all ranks.
    """
    folder = Path(folder)
    session = _Session(comm, folder, console, signals)
    if comm.bcast(particles is not None):
        case = from_root(comm, lambda: session.take(case, particles or {}))
    on_root(comm, lambda: folder.mkdir(parents=True, exist_ok=True))
    with FolderLock(comm, folder, session.say):
        if force:
            return session.start_run(case)
        before = from_root(comm, lambda: status_of_case(case, folder))
        if before is None:
            return session.start_run(case)
        return session.resume_run(case, before)


def resume(
    comm: MPI.Intracomm,
    folder: str | PathLike[str],
    console: Console | None = None,
    *,
    overrides: Sequence[str] = (),
    signals: SignalHandler | None = None,
) -> Result:
    """Continue the run in a folder, on any number of ranks.

    Parameters
    ----------
    comm, folder, console, signals
        See `run`.
    overrides : sequence of str, optional
        Changes ``key=value`` of the case, such as a later ``time.end``, with which even
        a completed run continues; see `extended_case`.

    Returns
    -------
    Result
        See `run`.

    Raises
    ------
    CaseError
        On all ranks, if what would change cannot.
    MpisphError, OSError
        See `run`; also where the folder holds no run, or one without a checkpoint to
        extend it from. What is there is then left as it is.
    """
    folder = Path(folder)
    session = _Session(comm, folder, console, signals)
    if from_root(comm, lambda: known_status(folder)) is None:
        raise no_run(folder, STATUS_FILE)
    with FolderLock(comm, folder, session.say):
        before = from_root(comm, lambda: known_status(folder))
        assert before is not None, "no other process removes it"
        case = session.known_case()
        if not overrides:
            return session.resume_run(case, before)
        path = folder / CASE_FILE
        changed = from_root(comm, lambda: load_case(path, overrides))
        longer = from_root(comm, lambda: extended_case(case, changed))
        is_longer = bool(differences(case, longer))
        return session.resume_run(longer, before, is_longer)


class _Session:
    """One start or resumption of a run, in a folder that it has locked."""

    def __init__(
        self,
        comm: MPI.Intracomm,
        folder: Path,
        console: Console | None,
        signals: SignalHandler | None,
    ) -> None:
        self.comm = comm
        self.folder = folder
        self.console = console or open_console(stderr=True)
        self.signals = signals or SignalHandler()
        self.particles: InitialParticles | None = None

    def say(self, text: str) -> None:
        """Print a line, once for all ranks."""
        if self.comm.rank == 0:
            self.console.print(text, highlight=False, markup=False, soft_wrap=True)

    def known_case(self) -> Case:
        """Return the case in the folder; write it again where it is damaged."""
        case, note = from_root(self.comm, lambda: known_case(self.folder))
        if note:
            self.say(note)
            self._write_case(case)
        return case

    def take(self, case: Case, given: Mapping[str, npt.ArrayLike]) -> Case:
        """Return a case with particles to start from, and keep these; on rank 0."""
        self.particles = complete_particles(case, given, "particles")
        return with_particles(case, self.particles, self.folder / INITIAL_FILE)

    def _begin(self, case: Case) -> Simulation:
        """Start from the beginning; particles of its own are kept beside the case."""
        on_root(self.comm, lambda: self._keep_initial(case))
        return start(case, self.comm)

    def _keep_initial(self, case: Case) -> None:
        """Write or remove the copy of the particles to start from; on rank 0."""
        path = self.folder / INITIAL_FILE
        if case.initial is None:
            path.unlink(missing_ok=True)
        elif self.particles is not None or not _is_same(path, Path(case.initial.file)):
            write_initial(self.folder, self.particles or read_initial(case))

    def start_run(self, case: Case) -> Result:
        """Make a run from its beginning."""
        check_memory(case, self.comm)
        check_expressions(case, self.comm)
        status = StatusFile(self.comm, self.folder, case.end_time, starts=1)
        # First of all: what is there then no longer counts as a run that has ended.
        status.write("running", 0, 0.0)
        on_root(self.comm, lambda: remove_run(self.folder))
        return self._run_recorded(case, status, resuming=False)

    def resume_run(self, case: Case, before: Status, is_longer: bool = False) -> Result:
        """Continue a run, unless it has ended and is not to become longer."""
        if before.state == "unstable" and is_longer:
            raise MpisphError(f"{self.folder}: an unstable run cannot be extended")
        has_ended = before.state in FINAL
        if has_ended:
            on_root(self.comm, lambda: restore_status(self.folder, before))
        if has_ended and not is_longer:
            on_root(self.comm, lambda: remove_parts(self.folder))
            if before.state == "completed":
                on_root(self.comm, lambda: keep_last_checkpoint(self.folder))
            lost = from_root(self.comm, lambda: _lost_ending(self.folder, case, before))
            if not lost:
                return self._result_of_ended(before)
            self.say(f"{lost}; it is written again from the last checkpoint")
        check_memory(case, self.comm)
        on_root(self.comm, lambda: remove_parts(self.folder))
        starts = before.starts + 1
        status = StatusFile(self.comm, self.folder, case.end_time, starts)
        if not has_ended:  # an earlier failure is not to be taken for one of this start
            status.write("running", before.step, before.time)
        return self._run_recorded(case, status, resuming=True, has_ended=has_ended)

    def _result_of_ended(self, before: Status) -> Result:
        """Return the result of a run that has ended; say what of it is damaged."""
        self.say(
            f"{self.folder} holds a run that is {before.state}: nothing to do; "
            "`mpisph run --force` starts over"
        )
        for fault in from_root(self.comm, lambda: faults_of_ended(self.folder)):
            self.say(f"warning: {self.folder / fault.name}: {fault.text}")
        return from_root(self.comm, lambda: _read_result(self.folder))

    def _run_recorded(
        self, case: Case, status: StatusFile, resuming: bool, has_ended: bool = False
    ) -> Result:
        """Run the case, and record a failure in the folder."""
        with self.signals.working_in(self.folder, status.fail):
            try:
                return self._run(case, status, resuming, has_ended)
            except (MpisphError, CollectiveError) as error:
                # What one rank alone meets is for `SignalHandler.end_all_ranks`.
                if self.comm.rank == 0:
                    self._record_failure(error, status)
                raise

    def _record_failure(self, error: Exception, status: StatusFile) -> None:
        """Write why the run has failed, as far as that is possible; on rank 0."""
        status.fail(str(error))
        with suppress(OSError), RunLog(self.folder, self.comm) as log:
            log.say(f"failed: {error}")
        with suppress(OSError):
            now = known_status(self.folder)
            has_ended = now is not None and now.state in FINAL
            if find_checkpoints(self.folder) and not has_ended:
                error.add_note(
                    f"`mpisph resume {self.folder}` continues from a checkpoint"
                )

    def _run(
        self, case: Case, status: StatusFile, resuming: bool, has_ended: bool
    ) -> Result:
        """Make the steps of a run from its beginning or from its last checkpoint.

        Of a run that has ended nothing changes before the checkpoint is read.
        """
        with ExitStack() as stack:
            log = stack.enter_context(RunLog(self.folder, self.comm))
            ranks = counted(self.comm.size, "rank")
            log.say(f"{case.title}\n{ranks}, code cache {CACHE_FOLDER}")
            if not resuming:
                self._say_beforehand(case, log)
            if not has_ended:
                self._write_case(case)
            self._compile(case, log)
            loaded = None
            if resuming:
                loaded = load_last_state(case, self.comm, self.folder, self.say)
            if loaded is None and has_ended:
                raise MpisphError(
                    f"{self.folder}: no sound checkpoint from the end of the run, from "
                    "which it could be continued; `mpisph run --force` runs it again"
                )
            if loaded is None and resuming:
                self.say(
                    f"{self.folder}: no sound checkpoint; starting from the beginning"
                )
            sim = loaded.sim if loaded else self._begin(case)
            log.say(f"{sim.n_total} particles, step {sim.step}")
            status.write("running", sim.step, sim.time)
            if has_ended:
                self._write_case(case)
            output = self._open_output(stack, sim, log, loaded)
            policy = CheckpointPolicy(sim, output, status, self.signals)
            result = self._step_to_end(sim, output, policy, status)
        if result.status != "stopped" and case.output.figures:
            self._draw()
        return result

    def _say_beforehand(self, case: Case, log: RunLog) -> None:
        """Say what is hardly meant in the case, and how long the run may take."""
        for text in find_warnings(case):
            self.say(f"warning: {text}")
            log.say(f"warning: {text}")
        size = estimate(case, self.comm.size)
        self.say(
            f"about {size.particles} particles, {size.steps} steps, {size.duration()}"
        )

    def _write_case(self, case: Case) -> None:
        path, text = self.folder / CASE_FILE, case.to_toml()
        on_root(self.comm, lambda: write_text(path, text))

    def _compile(self, case: Case, log: RunLog) -> None:
        begin = time.perf_counter()
        form = case.scheme.pair_form
        if not is_compiled(form):
            self.say("compiling, once for this version: some 20 s")
        warm_up(self.comm, [form])
        log.say(f"compiled code at hand after {time.perf_counter() - begin:.2f} s")

    def _open_output(
        self, stack: ExitStack, sim: Simulation, log: RunLog, loaded: Loaded | None
    ) -> RunOutput:
        """Open what the run writes, as of its state; warn of what has changed since."""
        state, damage, kept = None, dict[str, str](), dict[str, int]()
        if loaded is not None:
            state = loaded.state
            damage, kept = from_root(self.comm, partial(mend, self.folder, loaded))
        size = kept.get(HISTORY_FILE, 0)
        history = stack.enter_context(History(self.folder, self.comm, size))
        probes = stack.enter_context(
            Probes(sim, self.folder, state.probes if state else None, kept)
        )
        progress = stack.enter_context(
            Progress(self.comm, sim.case.end_time, self.console, log=log)
        )
        provenance = from_root(self.comm, _provenance)
        output = RunOutput(
            sim, self.folder, history, probes, progress, log, provenance, state, damage
        )
        if state is not None and state.provenance != provenance:
            output.warn(
                "the checkpoint was written by other software (see `provenance` in it):"
                " the bits may differ from those of one run"
            )
        for name, text in damage.items():
            output.warn(f"{name} {text}")
        return output

    def _step_to_end(
        self,
        sim: Simulation,
        output: RunOutput,
        policy: CheckpointPolicy,
        status: StatusFile,
    ) -> Result:
        """Make all steps, write how they ended, and return it."""
        ending: Ending = "completed"
        failure = None
        try:
            step_to_end(sim, output, policy)
        except UnstableError as error:
            ending, failure = "unstable", error
            output.log.say(str(error))
            output.save_snapshot(sim)
        except StopRequested as request:
            text = str(request)
            status.write("stopped", sim.step, sim.time, text)
            output.log.say(f"stopped at step {sim.step}: {text}")
            return output.conclude(sim, "stopped", reason=text)
        output.write_last_row(sim)
        result = output.conclude(sim, ending, failure)
        output.log.say(f"{ending}: {sim.step} steps in {output.wall:.2f} s")
        on_root(self.comm, lambda: write_result(self.folder, result))
        status.write(ending, sim.step, sim.time, result.reason)
        if ending == "completed":  # what is unstable may be looked into
            on_root(self.comm, lambda: keep_last_checkpoint(self.folder))
        return result

    def _draw(self) -> None:
        """Draw the figures; the run has ended well without them."""
        # Imported here: matplotlib takes longer to load than a small case to run.
        from mpisph.figures.cloud import draw_run

        try:
            on_root(self.comm, lambda: draw_run(self.folder))
        except (CollectiveError, MpisphError, RuntimeError) as error:
            self.say(f"warning: no figures: {error}; see `mpisph figures`")


def _lost_ending(folder: Path, case: Case, before: Status) -> str:
    """Return what a run that has ended lacks and its last checkpoint can bring back."""
    if not find_checkpoints(folder):
        return ""
    try:
        _read_result(folder)
        if before.state == "completed":
            snapshot_time(snapshot_path(folder, len(case.output_times)))
    except MpisphError:
        return f"{folder / RESULT_FILE}: missing or damaged"
    except (OSError, ValueError):
        path = snapshot_path(folder, len(case.output_times))
        return f"{path}: missing or damaged"
    return ""


def _is_same(path: Path, other: Path) -> bool:
    return path.exists() and other.exists() and path.samefile(other)


def _read_result(folder: Path) -> Result:
    path = folder / RESULT_FILE
    try:
        return read_result(path)
    except (OSError, ValueError) as error:
        raise MpisphError(
            f"{path}: missing or damaged, although the run has ended; `mpisph run "
            "--force` runs it again"
        ) from error


def _provenance() -> dict[str, str]:
    return {"revision": git_revision(), **versions()}
