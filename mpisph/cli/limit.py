"""The command ``mpisph limit``: the ballistic limit of a shield."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from mpi4py import MPI

from mpisph.case import CaseSource
from mpisph.cli.options import STOPPED, OutputPath, set_option, walltime_option
from mpisph.cli.study import ranks_option
from mpisph.core.console import open_console
from mpisph.core.held_signals import release_signals
from mpisph.core.words import counted
from mpisph.inputs.folder_name import folder_name
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.signals import SignalHandler

if TYPE_CHECKING:
    from mpisph.study.limit.plan import Plan
    from mpisph.study.limit.run import Search

_LEAST_TOLERANCE = 0.5
# Per cent; values are tried to four digits.


def _tolerance(_: click.Context, option: click.Parameter, text: str) -> float:
    """Return a relative width, given as 5% or 0.05."""
    number = text.strip().removesuffix("%")
    try:
        value = float(number)
    except ValueError:
        value = -1.0
    percent = value if text.strip().endswith("%") else 100.0 * value
    if not _LEAST_TOLERANCE <= percent <= 100.0:
        wanted = f"expected {_LEAST_TOLERANCE:g}% to 100%, such as 5%"
        raise click.BadParameter(f"{text!r}: {wanted}", param=option)
    return percent / 100.0


def _parsed(option: str, parse: Callable[..., Any], *words: Any) -> Any:
    try:
        return parse(*words)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint=f"'{option}'") from None


@click.command("limit")
@click.argument("case_file", metavar="CASE", type=click.Path(path_type=Path))
@click.option(
    "--find",
    type=click.Choice(["diameter", "velocity", "thickness"]),
    default="diameter",
    show_default=True,
    help="What is sought: the projectile's diameter, its velocity, or the wall's "
    "thickness.",
)
@click.option(
    "--at",
    metavar="NAME=VALUES",
    help="Points of the limit: velocity=2,3,4km/s, or diameter, thickness or "
    "standoff.  [default: one point, of the case]",
)
@click.option(
    "--between",
    metavar="LOW,HIGH",
    help="Values to begin with, such as 2,6mm.  [default: about the equation's limit]",
)
@click.option(
    "--tolerance",
    metavar="PERCENT",
    default="5%",
    show_default=True,
    callback=_tolerance,
    help="Width of what remains between holds and fails.",
)
@click.option(
    "--tests",
    "tests_file",
    metavar="FILE",
    type=click.Path(path_type=Path),
    help="Published tests (CSV, as `mpisph assess` takes them): those of this shield "
    "are drawn.",
)
@click.option(
    "-o",
    "--output",
    "root",
    type=OutputPath(path_type=Path, file_okay=False),
    help="Folder of runs, tables and figure.  [default: runs/limit-<name of CASE>]",
)
@set_option
@ranks_option
@click.option(
    "--collect-only",
    is_flag=True,
    help="Run nothing; write tables and figure, as far as the runs have come.",
)
@walltime_option
@click.pass_obj
def limit_command(
    signals: SignalHandler,
    case_file: Path,
    find: str,
    at: str | None,
    between: str | None,
    tolerance: float,
    tests_file: Path | None,
    root: Path | None,
    overrides: tuple[str, ...],
    ranks_per_case: int,
    collect_only: bool,
    walltime: float | None,
) -> None:
    """Find the ballistic limit of the shield of CASE by bisection.

    At each point runs go on until what holds and what fails are near enough. The ranks
    of mpirun are divided among the points. A search that was stopped continues, and no
    run is repeated.
    """
    from mpisph.study.limit.plan import QUANTITIES, parse_between, parse_points
    from mpisph.study.limit.run import search

    comm = MPI.COMM_WORLD
    quantity = QUANTITIES[find]
    along = _parsed("--at", parse_points, at) if at is not None else None
    ends = _parsed("--between", parse_between, between, quantity) if between else None
    folder = root or Path("runs") / f"limit-{folder_name(case_file)}"
    if collect_only:
        release_signals()
    if walltime is not None:
        signals.limit(walltime)
    plan = from_root(comm, lambda: _plan(case_file, overrides, quantity, along, ends))
    tests = from_root(comm, lambda: _tests(tests_file, plan))
    with signals.catching_signals(comm):
        found = search(
            plan,
            comm,
            folder,
            open_console(stderr=True),
            tolerance,
            ranks_per_case=ranks_per_case,
            signals=signals,
            collect_only=collect_only,
        )
    on_root(comm, lambda: _finish(plan, found, tests, folder))
    if found.stopped or (found.left and not collect_only):
        raise click.exceptions.Exit(STOPPED)


def _plan(
    path: Path, overrides: tuple[str, ...], find: Any, along: Any, between: Any
) -> "Plan":
    from mpisph.study.limit.plan import make_plan

    return make_plan(CaseSource(path), overrides, find, along, between)


def _tests(path: Path | None, plan: "Plan") -> list[Any]:
    """Return the published tests of the plan's shield."""
    if path is None:
        return []
    from mpisph.study.assess.published import read_tests
    from mpisph.study.limit.figure import alike

    return alike(plan, read_tests(path))


def _finish(plan: "Plan", found: "Search", tests: list[Any], folder: Path) -> None:
    """Write tables and figure; say what was found; on rank 0."""
    from mpisph.study.limit.figure import FIGURE_FILE, draw_limits
    from mpisph.study.limit.outcome import (
        LIMIT_FILE,
        TRIES_FILE,
        limit_rows,
        limit_table,
        limits,
    )
    from mpisph.study.table import write_rows

    listed = limits(plan, found)
    rows, tries = limit_rows(plan, listed)
    write_rows(folder / LIMIT_FILE, rows)
    write_rows(folder / TRIES_FILE, tries)
    files = [folder / LIMIT_FILE, folder / TRIES_FILE]
    if found.runs():
        draw_limits(plan, listed, tests, folder / FIGURE_FILE)
        files.append(folder / FIGURE_FILE)
    open_console(stderr=False).print(limit_table(plan, listed))
    click.echo(
        f"{counted(found.runs(), 'run')}; {counted(found.left, 'run')} left\n"
        + "\n".join(map(str, files))
    )
