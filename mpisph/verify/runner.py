"""Running verification problems, one after the other, and judging them."""

import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from mpi4py import MPI
from rich.console import Console

from mpisph.analysis.opened_run import open_run
from mpisph.core.errors import UnstableError
from mpisph.core.words import counted, grouped
from mpisph.io.result import Result
from mpisph.parallel.collectives import from_root
from mpisph.run.session import run
from mpisph.verify.problem import Check, Problem, Setup, Solved

_QUIET = Console(quiet=True)


class RunFacts(NamedTuple):
    """What a run of a problem cost.

    Attributes
    ----------
    label : str
    particles, steps : int
    wall : float
        Its steps on the wall clock [s].
    """

    label: str
    particles: int
    steps: int
    wall: float


class Verdict(NamedTuple):
    """What came of a problem.

    Attributes
    ----------
    problem : Problem
    checks : tuple of Check
        Empty where a run was unstable.
    runs : tuple of RunFacts
    reason : str
        Why there is nothing to check; empty where there is.
    figure : Path or None
    """

    problem: Problem
    checks: tuple[Check, ...]
    runs: tuple[RunFacts, ...]
    reason: str
    figure: Path | None

    @property
    def passed(self) -> bool:
        """Whether all checks were made and passed."""
        return not self.reason and not self.failed

    @property
    def failed(self) -> list[str]:
        """The quantities that did not pass."""
        return [check.quantity for check in self.checks if not check.passed]


def verify(
    problems: Sequence[Problem],
    comm: MPI.Intracomm,
    folder: Path,
    console: Console,
    quick: bool = False,
) -> list[Verdict]:
    """Run problems from their beginning and check them; collective.

    Parameters
    ----------
    problems : sequence of Problem
    comm : MPI.Intracomm
        Each run is made on all of its ranks.
    folder : Path
        Gets a folder for each problem, with its runs, and a figure beside it.
    console : rich.console.Console
        For progress.
    quick : bool, optional
        Whether to make the quick runs.

    Returns
    -------
    list of Verdict
        On all ranks. A run that breaks down fails its problem and does not stop the
        others.

    Raises
    ------
    MpisphError, OSError
        See `mpisph.run`.
    """
    verdicts = []
    for problem in problems:
        begin = time.perf_counter()
        verdict = verify_one(problem, comm, folder, quick)
        if comm.rank == 0:
            wall = time.perf_counter() - begin
            console.print(_line(verdict, wall), highlight=False, soft_wrap=True)
        verdicts.append(verdict)
    return verdicts


def verify_one(
    problem: Problem, comm: MPI.Intracomm, folder: Path, quick: bool = False
) -> Verdict:
    """Run one problem and check it; collective. See `verify`."""
    setups = from_root(comm, lambda: tuple(problem.setups(quick)))
    facts, solved, reasons = [], [], []
    for setup in setups:
        place = run_folder(folder, problem, setup)
        result = run(
            setup.case, comm, place, _QUIET, particles=setup.particles, force=True
        )
        timing = result.timing
        facts.append(RunFacts(setup.label, result.particles, timing.steps, timing.wall))
        solved.append((setup.label, place))
        if result.status == "unstable":
            reasons.append(f"{setup.label}: {_breakdown(result)}")
    if reasons:
        return Verdict(problem, (), tuple(facts), "; ".join(reasons), None)
    figure = folder / f"{problem.name}.png"
    checks = from_root(comm, lambda: _judge(problem, solved, figure))
    return Verdict(problem, checks, tuple(facts), "", figure)


def run_folder(folder: Path, problem: Problem, setup: Setup) -> Path:
    """Return the folder of a run: that of its problem, and its label as a name."""
    return folder / problem.name / re.sub(r"[^\w.+-]+", "-", setup.label)


def _judge(
    problem: Problem, places: Sequence[tuple[str, Path]], figure: Path
) -> tuple[Check, ...]:
    """Check completed runs and draw them; on rank 0."""
    solved = [Solved(label, open_run(place)) for label, place in places]
    checks = tuple(problem.check(solved))
    problem.draw(solved, figure)
    return checks


def _breakdown(result: Result) -> str:
    """Return why a run is unstable."""
    assert result.reason is not None, "an unstable run has a reason"
    error = UnstableError(
        result.reason, result.step, result.time, result.particle, result.detail or ""
    )
    return str(error)


def _line(verdict: Verdict, wall: float) -> str:
    """Return how a problem ended."""
    particles = grouped(max(facts.particles for facts in verdict.runs))
    size = f"{counted(len(verdict.runs), 'run')} of up to {particles} particles"
    why = verdict.reason or "; ".join(verdict.failed)
    outcome = "pass" if verdict.passed else f"FAIL ({why})"
    return f"{verdict.problem.name}: {size}, {wall:.1f} s: {outcome}"
