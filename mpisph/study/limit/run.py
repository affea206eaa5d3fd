"""Running a search: the tries of all points side by side, round after round."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from mpi4py import MPI
from rich.console import Console

from mpisph.core.errors import CaseError
from mpisph.core.words import counted
from mpisph.io.run_folder import CASE_FILE
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
from mpisph.study.store import CASES_FOLDER, case_folder, look_up
from mpisph.study.table import run_result

__all__ = ["Judged", "Refused", "Search", "search"]


class Judged(NamedTuple):
    """A try that has ended.

    Attributes
    ----------
    trial : Try
    outcome : str
        The verdict; ``undecided`` where the run failed.
    damage : float or None
    reason : str
    """

    trial: Try
    outcome: Outcome
    damage: float | None
    reason: str


class Refused(NamedTuple):
    """A value that is no sound case [SI], and why."""

    value: float
    reason: str


class Search(NamedTuple):
    """How far a search has come.

    Attributes
    ----------
    tries : tuple of list of Judged
        Of each point.
    refused : tuple of list of Refused
        Of each point.
    left : int
        Tries that are to be made next.
    stopped : bool
        Whether it was told to stop.
    """

    tries: tuple[list[Judged], ...]
    refused: tuple[list[Refused], ...]
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

    Runs lie in ``cases/<key>`` below the root. All that have ended there count, whoever
    made them, so that a search goes on where it was stopped, on any number of ranks.
    Those that failed are run again.

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
    made = from_root(comm, lambda: _known(plan, root, with_failed=collect_only))
    refused: tuple[list[Refused], ...] = tuple([] for _ in plan.points)
    while True:
        tries, refused = from_root(
            comm,
            lambda: _next_tries(plan, made, refused, tolerance, groups),  # noqa: B023
        )
        if not tries or collect_only:
            return Search(made, refused, len(tries), stopped=False)
        if comm.rank == 0:
            points = len({trial.point for trial in tries})
            said = f"{counted(len(tries), 'run')} for {counted(points, 'point')}"
            console.print(said, highlight=False, markup=False)
        stopped = run_cases(
            tries, comm, root, console, root,
            ranks_per_case=ranks_per_case, signals=signals,
        )  # fmt: skip
        ended = from_root(comm, lambda: [_judged(t, root) for t in tries])  # noqa: B023
        for found in filter(None, ended):
            made[found.trial.point].append(found)
        left = ended.count(None)
        if stopped or left:
            return Search(made, refused, left, stopped)


def _known(plan: Plan, root: Path, *, with_failed: bool) -> tuple[list[Judged], ...]:
    """Return the tries of each point that have ended already."""
    made: tuple[list[Judged], ...] = tuple([] for _ in plan.points)
    for path in sorted((root / CASES_FOLDER).glob(f"*/{CASE_FILE}")):
        table = _toml(path)
        value = _number(table, plan.find.key)
        if value is None:
            continue
        for point, place in enumerate(plan.points):
            at = None if plan.along is None else _number(table, plan.along.key)
            if at is not None and not math.isclose(at, place.at or 0.0):
                continue
            trial = _try_of(plan, point, value)
            # The key tells whether all else is the same.
            if isinstance(trial, Refused) or trial.key != path.parent.name:
                continue
            judged = _judged(trial, root)
            if judged and (with_failed or look_up(path.parent).standing in FINAL):
                made[point].append(judged)
    return made


def _toml(path: Path) -> Any:
    """Return what a TOML file holds; nothing where a killed run has left half of it."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError):
        return {}


def _number(table: Any, key: str) -> float | None:
    """Return the number at a key such as ``shield.bumpers.0.standoff``, if any."""
    for word in key.split("."):
        try:
            table = table[int(word) if word.isdigit() else word]
        except (KeyError, IndexError, TypeError):
            return None
    return float(table) if isinstance(table, (int, float)) else None


def _next_tries(
    plan: Plan,
    made: Sequence[list[Judged]],
    refused: Sequence[list[Refused]],
    tolerance: float,
    groups: int,
) -> tuple[list[Try], tuple[list[Refused], ...]]:
    """Return the tries to make next, of all points, and what cannot be tried.

    Where ranks are free, a point has several.
    """
    width = math.log1p(tolerance)
    known = tuple(map(list, refused))

    def of_all(count: int) -> list[list[Try]]:
        return [
            _tries_of(plan, point, made[point], known[point], width, count)
            for point in range(len(made))
        ]

    wanted = of_all(1)
    waiting = sum(map(bool, wanted))
    if waiting and groups >= 2 * waiting:
        wanted = of_all(groups // waiting)
    return [trial for tries in wanted for trial in tries], known


def _tries_of(
    plan: Plan,
    point: int,
    made: Sequence[Judged],
    refused: list[Refused],
    width: float,
    count: int,
) -> list[Try]:
    """Return the tries to make next at a point; take down what is refused."""
    harder = plan.find.harder
    trials = {severity(j.trial.value, harder): j.outcome for j in made}
    guess = severity(first_guess(plan, point), harder)
    ends = [severity(value, harder) for value in plan.between or ()]
    while True:
        wanted = [at for at in ends if at not in trials] or next_severities(
            trials, guess, width, count, [severity(r.value, harder) for r in refused]
        )
        values = dict.fromkeys(value_of(at, harder) for at in wanted)
        found = [_try_of(plan, point, value) for value in values]
        refused += [f for f in found if isinstance(f, Refused)]
        tries = [f for f in found if isinstance(f, Try)]
        if tries or not wanted:
            return tries


def _try_of(plan: Plan, point: int, value: float) -> Try | Refused:
    """Return a try, or why its value cannot be tried."""
    try:
        return make_try(plan, point, value)
    except CaseError as error:
        problem = error.problems[0]
        return Refused(value, f"{problem.key}: {problem.expected}")


def _judged(trial: Try, root: Path) -> Judged | None:
    """Return what a try has come to; None where it has not ended."""
    folder = case_folder(root, trial)
    place = look_up(folder)
    if place.standing == "failed":
        return Judged(trial, "undecided", None, f"the run failed: {place.reason}")
    if place.standing not in FINAL:
        return None
    verdict = run_result(folder).verdict
    if verdict is None:
        return Judged(trial, "undecided", None, "the run has no verdict")
    return Judged(trial, verdict.outcome, verdict.damage, verdict.reason)
