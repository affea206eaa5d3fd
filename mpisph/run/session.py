"""A whole run: steps, triggers, files and the result; begun anew or resumed.

The word that counts is ``status.json``. A run begins where its folder holds none, goes
on from the last sound checkpoint where it was stopped, failed or was killed, and is not
repeated once it has ended.
"""

import time
import tomllib
from contextlib import ExitStack, suppress
from functools import partial
from pathlib import Path

from mpi4py import MPI
from rich.console import Console

from mpisph.case import Case, case_from_dict
from mpisph.case.identity import differences
from mpisph.core.console import open_console
from mpisph.core.errors import (
    CaseError,
    CollectiveError,
    MpisphError,
    Problem,
    UnstableError,
)
from mpisph.core.jit import CACHE_FOLDER, is_compiled
from mpisph.io.checkpoint import (
    Checkpoint,
    DamagedError,
    find_checkpoints,
    read_checkpoint,
    remove_checkpoints,
    set_aside,
)
from mpisph.io.files import write_text
from mpisph.io.history import History, kept_history
from mpisph.io.lock import FolderLock
from mpisph.io.provenance import git_revision, versions
from mpisph.io.result import RESULT_FILE, Ending, Result, read_result, write_result
from mpisph.io.run_folder import CASE_FILE, case_in, clear_away, remove_parts
from mpisph.io.run_log import RunLog
from mpisph.io.status import FINAL, STATUS_FILE, Status, StatusFile, read_status
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.checkpointing import CheckpointPolicy, StopRequested
from mpisph.run.loop import step_to_end
from mpisph.run.output import RunOutput
from mpisph.run.progress import Progress
from mpisph.run.signals import SignalHandler
from mpisph.run.state import RunState, restored
from mpisph.solver.estimate import check_memory
from mpisph.solver.start import start
from mpisph.solver.state import Simulation
from mpisph.solver.warmup import warm_up

SHOWN_DIFFERENCES = 5
"""How many differences between two cases are named."""


def run(
    case: Case,
    comm: MPI.Intracomm,
    folder: Path,
    console: Console | None = None,
    *,
    force: bool = False,
    signals: SignalHandler | None = None,
) -> Result:
    """Run a case and write its files into `folder`, or go on with it there.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
        The run is collective over it; any number of ranks gives the same bits.
    folder : Path
        Made where missing. Where the run in it was stopped or killed, it goes on; where
        it has ended, nothing is done.
    console : rich.console.Console, optional
        For progress; by default the standard error.
    force : bool, optional
        Whether to start anew, and remove the files of the run in the folder.
    signals : SignalHandler, optional
        Signals and limits to heed; by default only the file ``stop`` in the folder.

    Returns
    -------
    Result
        On all ranks; its status is ``unstable`` for a run that broke down, and
        ``stopped`` for one that was asked to stop.

    Raises
    ------
    CaseError
        On all ranks, if the folder holds a run of another case, or if the particles
        would not fit into the nodes' memory.
    MpisphError
        On all ranks, if another run is at work in the folder, or if it holds files of a
        run but no status.
    OSError
        On all ranks, if a file cannot be written; on rank 0 alone, if it is the history
        or the log: started with ``python -m mpi4py``, a program then ends on all ranks.
    """
    on_root(comm, lambda: folder.mkdir(parents=True, exist_ok=True))
    session = _Session(comm, folder, console, signals)
    with FolderLock(comm, folder, session.say):
        if force:
            return session.begin(case)
        status = from_root(comm, lambda: _status_of(case, folder))
        return session.begin(case) if status is None else session.go_on(case, status)


def resume(
    comm: MPI.Intracomm,
    folder: Path,
    console: Console | None = None,
    *,
    signals: SignalHandler | None = None,
) -> Result:
    """Go on with the run in a folder, on any number of ranks.

    Parameters
    ----------
    comm, folder, console, signals
        See `run`.

    Returns
    -------
    Result
        See `run`.

    Raises
    ------
    MpisphError, OSError
        See `run`; also where the folder holds no run.
    """
    session = _Session(comm, folder, console, signals)
    case = from_root(comm, lambda: case_in(folder))
    with FolderLock(comm, folder, session.say):
        status = from_root(comm, lambda: read_status(folder))
        if status is None:
            raise MpisphError(f"{folder}: no {STATUS_FILE}; is it a run's folder?")
        return session.go_on(case, status)


def _status_of(case: Case, folder: Path) -> Status | None:
    """Return how the run in a folder stands; it must be one of this case."""
    status = read_status(folder)
    if status is None:
        found = [n for n in (CASE_FILE, RESULT_FILE) if (folder / n).exists()]
        if found:
            raise MpisphError(
                f"{folder}: holds {found[0]} of a run, but no {STATUS_FILE}; name "
                "another folder, or --force to start anew and lose what is there"
            )
        return None
    if status.state not in FINAL and not (folder / CASE_FILE).exists():
        return None  # killed before it had begun
    differing = differences(case_in(folder), case)
    if differing:
        shown = ", ".join(differing[:SHOWN_DIFFERENCES])
        more = len(differing) - SHOWN_DIFFERENCES
        text = f"{shown} and {more} more" if more > 0 else shown
        problem = Problem(
            f"the folder holds a run of another case ({text}); name another folder, or "
            "--force to start anew and lose what is there",
            file=str(folder),
        )
        raise CaseError([problem])
    return status


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

    def say(self, text: str) -> None:
        """Print a line, once for all ranks."""
        if self.comm.rank == 0:
            self.console.print(text, highlight=False, markup=False, soft_wrap=True)

    def begin(self, case: Case) -> Result:
        """Start a run anew."""
        check_memory(case, self.comm)
        status = StatusFile(self.comm, self.folder, case.end_time, starts=1)
        # First of all: what is there then no longer counts as a run that has ended.
        status.write("running", 0, 0.0)
        on_root(self.comm, lambda: clear_away(self.folder))
        return self._work(case, status, resuming=False)

    def go_on(self, case: Case, before: Status) -> Result:
        """Go on with a run, unless it has ended."""
        if before.state in FINAL:
            self.say(
                f"{self.folder} holds a run that is {before.state}: nothing to do; "
                "`mpisph run --force` starts anew"
            )
            if before.state == "completed":
                on_root(self.comm, lambda: remove_checkpoints(self.folder))
            return from_root(self.comm, lambda: _read_result(self.folder))
        check_memory(case, self.comm)
        on_root(self.comm, lambda: remove_parts(self.folder))
        starts = before.starts + 1
        status = StatusFile(self.comm, self.folder, case.end_time, starts)
        return self._work(case, status, resuming=True)

    def _work(self, case: Case, status: StatusFile, resuming: bool) -> Result:
        """Run a case from its start or from a checkpoint, and see to its end."""
        with self.signals.working_in(self.folder, status.fail):
            try:
                path, text = self.folder / CASE_FILE, case.to_toml()
                on_root(self.comm, lambda: write_text(path, text))
                return self._run(case, status, resuming)
            except (MpisphError, CollectiveError) as error:
                # What one rank alone meets is for `SignalHandler.end_all_ranks`.
                if self.comm.rank == 0:
                    self._take_down(error, status)
                raise

    def _take_down(self, error: Exception, status: StatusFile) -> None:
        """Write why the run has failed, as far as that is possible; on rank 0."""
        status.fail(str(error))
        with suppress(OSError), RunLog(self.folder, self.comm) as log:
            log.say(f"failed: {error}")
        if find_checkpoints(self.folder):
            error.add_note(f"`mpisph resume {self.folder}` goes on from a checkpoint")

    def _run(self, case: Case, status: StatusFile, resuming: bool) -> Result:
        with ExitStack() as stack:
            log = stack.enter_context(RunLog(self.folder, self.comm))
            log.say(f"{case.title}\n{self.comm.size} ranks, code cache {CACHE_FOLDER}")
            self._compile(log)
            state = None
            if resuming:
                sim, state = self._restored(case)
            else:
                sim = start(case, self.comm)
            log.say(f"{sim.n_total} particles, step {sim.step}")
            status.write("running", sim.step, sim.time)
            size = state.history_bytes if state else 0
            kept = from_root(self.comm, lambda: kept_history(self.folder, size))
            history = stack.enter_context(History(self.folder, self.comm, kept))
            progress = stack.enter_context(
                Progress(self.comm, case.end_time, self.console, log=log)
            )
            provenance = from_root(self.comm, _provenance)
            output = RunOutput(
                sim, self.folder, history, progress, log, provenance, state
            )
            if state is not None:
                _warn_of_changes(output, state, kept)
            checkpointing = CheckpointPolicy(sim, output, status, self.signals)
            result = self._step_to_end(sim, output, checkpointing, status)
        if result.status != "stopped" and case.output.figures:
            self._draw()
        return result

    def _restored(self, case: Case) -> tuple[Simulation, RunState | None]:
        """Return the run as the last sound checkpoint holds it, or else at its start.

        Raises
        ------
        OSError
            On all ranks, if a checkpoint cannot be read: another time it may.
        """
        for path in from_root(self.comm, lambda: find_checkpoints(self.folder)):
            try:
                checkpoint = read_checkpoint(self.comm, path)
            except DamagedError as error:
                aside = from_root(self.comm, partial(set_aside, path))
                self.say(f"{error}; kept as {aside.name}")
                continue
            state = _understood(path, checkpoint, case)
            self.say(f"going on from {path.name}, t = {state.time * 1e6:.4f} us")
            return restored(case, self.comm, checkpoint, state), state
        self.say(f"{self.folder}: no sound checkpoint; starting from the beginning")
        return start(case, self.comm), None

    def _compile(self, log: RunLog) -> None:
        begin = time.perf_counter()
        if not is_compiled():
            self.say("compiling, once for this version: some 20 s")
        warm_up(self.comm)
        log.say(f"compiled code at hand after {time.perf_counter() - begin:.2f} s")

    def _step_to_end(
        self,
        sim: Simulation,
        output: RunOutput,
        checkpointing: CheckpointPolicy,
        status: StatusFile,
    ) -> Result:
        """Make all steps, write how they ended, and return it."""
        ending: Ending = "completed"
        failure = None
        try:
            step_to_end(sim, output, checkpointing)
        except UnstableError as error:
            ending, failure = "unstable", error
            output.log.say(str(error))
            output.save(sim)
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
            on_root(self.comm, lambda: remove_checkpoints(self.folder))
        return result

    def _draw(self) -> None:
        """Draw the figures; the run has ended well without them."""
        # Imported here: matplotlib takes longer to load than a small case to run.
        from mpisph.figures.cloud import draw_run

        try:
            on_root(self.comm, lambda: draw_run(self.folder))
        except (CollectiveError, MpisphError, RuntimeError) as error:
            self.say(f"warning: no figures: {error}; see `mpisph figures`")


def _warn_of_changes(output: RunOutput, state: RunState, kept: int) -> None:
    """Say what is no longer as it was when the checkpoint was written."""
    if state.provenance != output.provenance:
        output.warn(
            "the checkpoint was written by other software (see `provenance` in it): "
            "the bits may differ from those of one run"
        )
    if kept != state.history_bytes:
        output.warn("history.csv is not as it was written: it begins anew")


def _understood(path: Path, checkpoint: Checkpoint, case: Case) -> RunState:
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
            "starts anew"
        ) from error
    if differences(stored, case):
        raise MpisphError(
            f"{path}: belongs to another case than {CASE_FILE} beside it; was that "
            "changed?"
        )
    return state


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
