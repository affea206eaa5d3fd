"""Running a search: the tries of all points side by side, round after round."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from mpi4py import MPI
from rich.console import Console

from mpisph.core.words import counted
from mpisph.io.result import RESULT_FILE, read_result
from mpisph.io.status import FINAL
from mpisph.io.verdict import Outcome
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.signals import SignalHandler
from mpisph.study.limit.plan import Plan, Try, first_guess, make_try
from mpisph.study.limit.search import (
    next_severities,
    severity,
    value_of,
)
from mpisph.study.runner import run_cases
from mpisph.study.store import case_folder, look_up

__all__ = ["Judged", "Search", "search"]


class Judged(NamedTuple):
    """A try that has ended.

    Attributes
    ----------
    trial : Try
    outcome : str
        The verdict; ``undecided`` where the run failed or the case is not sound.
    damage : float or None
    reason : str
    """

    trial: Try
    outcome: Outcome
    damage: float | None
    reason: str


class Search(NamedTuple):
    """How far a search has come.

    Attributes
    ----------
    tries : tuple of list of Judged
        Of each point, in the order in which they were made.
    left : int
        Tries that are to be made next.
    stopped : bool
        Whether it was told to stop.
    """

    tries: tuple[list[Judged], ...]
    left: int
    stopped: bool

    def runs(self) -> int:
        """Return the number of tries that have ended."""
        return sum(map(len, self.tries))


def search(
    plan: Plan,
    comm: MPI.Intracomm,
    root: Path,
    console: Console,
    tolerance: float,
    *,
    ranks_per_case: int = 1,
    signals: SignalHandler | None = None,
    collect_only: bool = False,
) -> Search:
    """Make tries until each point's limit lies within the tolerance; collective.

    Runs lie in ``cases/<key>`` below the root. One that has ended is not repeated, so a
    search goes on where it was stopped.

    Parameters
    ----------
    plan : Plan
    comm : MPI.Intracomm
    root : Path
    console : rich.console.Console
    tolerance : float
        Relative width of the bracket that is wanted.
    ranks_per_case : int, optional
    signals : SignalHandler, optional
    collect_only : bool, optional
        Whether to take what is there and run nothing.
    """
    signals = signals or SignalHandler()
    on_root(comm, lambda: root.mkdir(parents=True, exist_ok=True))
    groups = max(comm.size // ranks_per_case, 1)
    made: tuple[list[Judged], ...] = tuple([] for _ in plan.points)
    while True:
        tries = _next_tries(plan, made, tolerance, groups)
        ended = from_root(comm, lambda: [_judged(t, root) for t in tries])  # noqa: B023
        for found in filter(None, ended):
            made[found.trial.point].append(found)
        open_ = [t for t, found in zip(tries, ended, strict=True) if found is None]
        if not tries or (collect_only and open_):
            return Search(made, len(open_), stopped=False)
        if not open_:
            continue
        said = f"{counted(len(open_), 'run')} for {counted(len(plan.points), 'point')}"
        if comm.rank == 0:
            console.print(said, highlight=False, markup=False)
        stopped = run_cases(
            open_, comm, root, console, root,
            ranks_per_case=ranks_per_case, signals=signals,
        )  # fmt: skip
        left = from_root(comm, lambda: _not_ended(open_, root))  # noqa: B023
        if stopped or left:
            ended = from_root(comm, lambda: [_judged(t, root) for t in open_])  # noqa: B023
            for found in filter(None, ended):
                made[found.trial.point].append(found)
            return Search(made, left, stopped)


def _next_tries(
    plan: Plan, made: Sequence[list[Judged]], tolerance: float, groups: int
) -> list[Try]:
    """Return the tries to make next, of all points; several where ranks are free."""
    width, harder = math.log1p(tolerance), plan.find.harder
    wanted = [_severities(plan, k, made[k], width, 1) for k in range(len(made))]
    waiting = sum(map(bool, wanted))
    if waiting and groups > waiting:
        each = groups // waiting
        wanted = [_severities(plan, k, made[k], width, each) for k in range(len(made))]
    tries = []
    for point, severities in enumerate(wanted):
        for at in severities:
            tries.append(make_try(plan, point, value_of(at, harder)))
    return tries


def _severities(
    plan: Plan, point: int, made: Sequence[Judged], width: float, count: int
) -> list[float]:
    """Return the severities to try next at a point."""
    harder = plan.find.harder
    trials = {severity(j.trial.value, harder): j.outcome for j in made}
    if plan.between is not None and len(trials) < len(plan.between):
        ends = [severity(value, harder) for value in plan.between]
        return [at for at in ends if at not in trials]
    guess = severity(first_guess(plan, point), harder)
    return next_severities(trials, guess, width, count)


def _not_ended(tries: Sequence[Try], root: Path) -> int:
    return sum(_judged(t, root) is None for t in tries)


def _judged(trial: Try, root: Path) -> Judged | None:
    """Return what a try has come to; None where it has not ended."""
    folder = case_folder(root, trial)
    place = look_up(folder)
    if place.standing == "failed":
        return Judged(trial, "undecided", None, f"the run failed: {place.reason}")
    if place.standing not in FINAL:
        return None
    verdict = read_result(folder / RESULT_FILE).verdict
    if verdict is None:
        return Judged(trial, "undecided", None, "the run has no verdict")
    return Judged(trial, verdict.outcome, verdict.damage, verdict.reason)
