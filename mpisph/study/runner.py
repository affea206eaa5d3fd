"""Running a study: groups of ranks that take one case after the other.

The ranks are divided into groups. Each takes the next case from a shared counter, runs
it, and counts how it ended; nothing is decided beforehand, so that a group with short
cases does more of them. A case that another process is at work on, such as another
element of a job array, is left to it.
"""

import math
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple, Protocol

import numpy as np
from mpi4py import MPI
from rich.console import Console

from mpisph.case import Case
from mpisph.core.errors import CollectiveError, MpisphError
from mpisph.io.files import write_bytes, write_text
from mpisph.io.lock import FolderLock, InUseError, in_use
from mpisph.io.status import FINAL, StatusFile
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.session import run
from mpisph.run.signals import STOP_FILE, SignalHandler, StopRequest
from mpisph.solver.estimate import estimate
from mpisph.solver.warmup import warm_up
from mpisph.study.counter import SharedCounters
from mpisph.study.keys import keep_keys
from mpisph.study.model import Study
from mpisph.study.progress import (
    COMPLETED,
    FAILED,
    LEFT,
    N_COUNTERS,
    NEXT,
    STOP,
    UNSTABLE,
    WORK,
    StudyProgress,
)
from mpisph.study.store import Place, case_folder, counts, look_up_all, study_folder

WORK_UNIT = 1e6
"""Interactions in which the work done is counted."""

SMALL_STEP = 2e4
"""What a step costs besides, in interactions (0.3 ms at 15 ns; measured)."""

_QUIET = Console(quiet=True)


class Part(NamedTuple):
    """Which cases a process takes first.

    Attributes
    ----------
    number, of : int
        Every `of`-th case from the `number`-th on; when they are done, it helps with
        the others.
    """

    number: int = 0
    of: int = 1


class Outcome(NamedTuple):
    """How running a study ended.

    Attributes
    ----------
    completed, unstable, failed, elsewhere, left : int
        Numbers of distinct runs, earlier ones included; another process is at work on
        those elsewhere, and what is left is stopped or not started.
    stopped : bool
        Whether the study was told to stop.
    """

    completed: int
    unstable: int
    failed: int
    elsewhere: int
    left: int
    stopped: bool


class Runnable(Protocol):
    """A case with its key, such as `StudyCase`."""

    @property
    def case(self) -> Case:
        """What is run."""

    @property
    def key(self) -> str:
        """See `case_key`."""


class _Todo(NamedTuple):
    """A run that is to be made."""

    case: Case
    folder: Path
    work: int


def run_study(
    study: Study,
    comm: MPI.Intracomm,
    root: Path,
    console: Console,
    *,
    ranks_per_case: int = 1,
    part: Part | None = None,
    signals: SignalHandler | None = None,
) -> Outcome:
    """Run all cases of a study that have not ended yet; collective.

    Parameters
    ----------
    study : Study
        On all ranks.
    comm : MPI.Intracomm
    root : Path
        See `store`.
    console : rich.console.Console
        For progress.
    ranks_per_case : int, optional
        Ranks of one case. The last group has what is left over.
    part : Part, optional
        By default all cases in turn.
    signals : SignalHandler, optional
        Signals and limits that stop the study.

    Returns
    -------
    Outcome
        On all ranks. An instability or a failure of one case does not stop the others.

    Raises
    ------
    MpisphError
        On all ranks, if there are fewer ranks than a case is to have.
    OSError
        On all ranks, if the folders cannot be made.
    """
    signals = signals or SignalHandler()
    folder = study_folder(root, study)
    on_root(comm, lambda: _keep_copy(study, folder))
    on_root(comm, lambda: keep_keys(study, root))
    stopped = run_cases(
        study.cases,
        comm,
        root,
        console,
        folder,
        ranks_per_case=ranks_per_case,
        part=part,
        signals=signals,
    )
    places = from_root(comm, lambda: _distinct(study, look_up_all(root, study.cases)))
    found = counts(places)
    return Outcome(
        found["completed"],
        found["unstable"],
        found["failed"],
        found["running"],
        found["stopped"] + found["to do"],
        stopped,
    )


def run_cases(
    cases: Sequence[Runnable],
    comm: MPI.Intracomm,
    root: Path,
    console: Console,
    stop_folder: Path,
    *,
    ranks_per_case: int,
    signals: SignalHandler,
    part: Part | None = None,
) -> bool:
    """Run those of some cases that have not ended yet; collective.

    Parameters
    ----------
    cases : sequence of Runnable
        On all ranks; those with one key share a run.
    comm, root, console, ranks_per_case, part, signals
        See `run_study`.
    stop_folder : Path
        A file ``stop`` in it stops them.

    Returns
    -------
    bool
        Whether they were told to stop.

    Raises
    ------
    MpisphError, OSError
        See `run_study`.
    """
    if ranks_per_case > comm.size:
        raise MpisphError(
            f"{ranks_per_case} ranks for each case, but mpirun started {comm.size}"
        )
    warm_up(comm, sorted({case.case.scheme.pair_form for case in cases}))
    todo = from_root(comm, lambda: _to_do(cases, root, part or Part()))
    groups = comm.size // ranks_per_case
    colour = min(comm.rank // ranks_per_case, groups - 1)
    group = MPI.Intracomm(comm.Split(colour))
    with SharedCounters(comm, N_COUNTERS) as counters:
        here = counters.here if comm.rank == 0 else np.zeros(N_COUNTERS, np.int64)
        works = [run.work for run in todo]
        with StudyProgress(comm, console, here, works, groups):
            _take_cases(todo, group, counters, signals, stop_folder)
            comm.Barrier()
        stopped = bool(counters.add(STOP, 0))
    group.Free()
    return stopped


def _keep_copy(study: Study, folder: Path) -> None:
    """Put copies of the study file, and of its rows, beside its tables."""
    folder.mkdir(parents=True, exist_ok=True)
    text = study.path.read_text(encoding="utf-8")
    write_text(folder / "study.toml", text)
    if study.file.rows is not None:
        rows = (study.path.parent / study.file.rows).read_bytes()
        write_bytes(folder / "rows.csv", rows)


def _distinct(study: Study, places: Sequence[Place]) -> list[Place]:
    """Return how each run stands, where cases that are the same share one."""
    keys = [case.key for case in study.cases]
    return list(dict(zip(keys, places, strict=True)).values())


def _to_do(cases: Sequence[Runnable], root: Path, part: Part) -> list[_Todo]:
    """Return the runs to make: the longest first, those that have failed last."""
    runs: dict[str, tuple[bool, _Todo]] = {}
    places = look_up_all(root, cases)
    for case, place in zip(cases, places, strict=True):
        if place.standing not in FINAL:
            todo = _Todo(case.case, case_folder(root, case), _work(case.case))
            runs[case.key] = (place.standing == "failed", todo)
    longest_first = sorted(runs.values(), key=lambda run: -run[1].work)
    ordered = sorted(
        (failed, k % part.of != part.number, k)
        for k, (failed, _) in enumerate(longest_first)
    )
    return [longest_first[k][1] for *_, k in ordered]


def _work(case: Case) -> int:
    """Return about what a run costs, in units of `WORK_UNIT` interactions."""
    size = estimate(case, 1)
    a_step = size.particles * size.neighbours + SMALL_STEP
    return max(math.ceil(size.steps * a_step / WORK_UNIT), 1)


def _take_cases(
    todo: Sequence[_Todo],
    group: MPI.Intracomm,
    counters: SharedCounters,
    signals: SignalHandler,
    folder: Path,
) -> None:
    """Run one case after the other, until there are none or the study is to stop."""
    while True:
        taken = -1
        # Any rank may have had the signal.
        is_to_stop = group.allreduce(_is_to_stop(signals, folder), MPI.LOR)
        if group.rank == 0:
            if is_to_stop:
                counters.add(STOP)
            elif not counters.add(STOP, 0):
                taken = counters.add(NEXT)
        taken = group.bcast(taken)
        if not 0 <= taken < len(todo):
            return
        ending = _run_one(todo[taken], group, signals)
        if group.rank == 0:
            counters.add(ending)
            counters.add(WORK, todo[taken].work)


def _is_to_stop(signals: SignalHandler, folder: Path) -> bool:
    """Say whether a signal, the wall time or the file ``stop`` ends the study."""
    return (
        signals.signal_request() != StopRequest.NOTHING
        or signals.time_left() <= 0.0
        or (folder / STOP_FILE).exists()
    )


def _run_one(todo: _Todo, group: MPI.Intracomm, signals: SignalHandler) -> int:
    """Run a case and return the counter of its ending; collective over the group."""
    busy = from_root(group, lambda: in_use(todo.folder))
    if busy:
        return LEFT
    try:
        result = run(todo.case, group, todo.folder, _QUIET, signals=signals)
    except InUseError:  # started since: the folder is another run's
        return LEFT
    except (MpisphError, CollectiveError) as error:
        _record_failure(f"{error}", todo, group)
        return FAILED
    except Exception as error:
        # Alone in its group, a rank leaves nobody waiting.
        if group.size > 1:
            raise
        _record_failure(signals.describe(error), todo, group)
        return FAILED
    return {"completed": COMPLETED, "unstable": UNSTABLE}.get(result.status, LEFT)


def _record_failure(text: str, todo: _Todo, group: MPI.Intracomm) -> None:
    """Write into the run's folder why it has failed, as far as that is possible."""
    if group.rank == 0:
        with suppress(OSError, InUseError):
            todo.folder.mkdir(parents=True, exist_ok=True)
            # Locked again: the run's own lock has ended, and another may have started.
            with FolderLock(MPI.COMM_SELF, todo.folder):
                end_time = todo.case.end_time
                StatusFile(MPI.COMM_SELF, todo.folder, end_time, 1).fail(text)
