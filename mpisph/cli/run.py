"""The commands that make runs: run, resume, status."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click
from mpi4py import MPI

from mpisph.case import Case, load_case
from mpisph.case.plausibility import find_warnings
from mpisph.cli.options import (
    BAD_INPUT,
    STOPPED,
    UNSTABLE,
    OutputPath,
    runs_argument,
    set_option,
    walltime_option,
)
from mpisph.core.console import open_console
from mpisph.core.errors import CaseError
from mpisph.core.held_signals import release_signals
from mpisph.core.words import counted
from mpisph.inputs.folder_name import folder_name
from mpisph.parallel.collectives import from_root
from mpisph.run.signals import STOP_FILE, SignalHandler
from mpisph.solver.estimate import estimate

if TYPE_CHECKING:
    from mpisph.io.result import Result
    from mpisph.io.standing import Standing


@click.command("run")
@click.argument(
    "case_files",
    metavar="CASE...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
)
@click.option(
    "-o",
    "--output",
    type=OutputPath(path_type=Path, file_okay=False),
    help="Folder of the run, or of the runs' folders where there are several CASEs.  "
    "[default: runs/<name of the case file>]",
)
@set_option
@walltime_option
@click.option("--force", is_flag=True, help="Start over; remove the folder's old run.")
@click.option("--dry-run", is_flag=True, help="Check the case, print its size, stop.")
@click.pass_obj
def run_command(
    signals: SignalHandler,
    case_files: tuple[Path, ...],
    output: Path | None,
    overrides: tuple[str, ...],
    walltime: float | None,
    force: bool,
    dry_run: bool,
) -> None:
    """Run case files (TOML), one after the other, and write a folder for each.

    A run that was stopped or killed continues from its last checkpoint. One that has
    ended is not repeated.
    """
    comm = MPI.COMM_WORLD
    folders = _run_folders(case_files, output)
    cases = from_root(comm, lambda: _load_cases(case_files, overrides))
    if dry_run:
        from mpisph.solver.start import check_expressions

        release_signals()
        for case in cases:
            check_expressions(case, comm)
            click.echo(estimate(case, comm.size).text())
            for text in find_warnings(case):
                click.echo(f"warning: {text}")
        return
    from mpisph.run.session import run

    pairs = list(zip(cases, folders, strict=True))
    _finish_runs(
        signals,
        walltime,
        folders,
        [partial(run, c, comm, f, force=force, signals=signals) for c, f in pairs],
    )


@click.command("resume")
@runs_argument
@set_option
@walltime_option
@click.pass_obj
def resume_command(
    signals: SignalHandler,
    folders: tuple[Path, ...],
    overrides: tuple[str, ...],
    walltime: float | None,
) -> None:
    """Continue the runs in folders, on any number of ranks.

    A run continues from its last sound checkpoint, or from the beginning where there
    is none. One that has ended is not repeated, but one that has completed can be made
    longer: --set time.end=30us.
    """
    from mpisph.run.session import resume

    comm = MPI.COMM_WORLD
    runs = [
        partial(resume, comm, folder, overrides=overrides, signals=signals)
        for folder in folders
    ]
    _finish_runs(signals, walltime, folders, runs)


def _finish_runs(
    signals: SignalHandler,
    walltime: float | None,
    folders: Sequence[Path],
    runs: Sequence[Callable[[], "Result"]],
) -> None:
    """Make runs one after the other, until one is stopped; say how each ended."""
    if walltime is not None:
        signals.limit(walltime)
    stable = True
    with signals.catching_signals(MPI.COMM_WORLD):
        for folder, make in zip(folders, runs, strict=True):
            result = make()
            _say_ending(folder, result)
            if result.status == "stopped":
                raise click.exceptions.Exit(STOPPED)
            stable = stable and result.status == "completed"
    if not stable:
        raise click.exceptions.Exit(UNSTABLE)


def _run_folders(case_files: Sequence[Path], output: Path | None) -> list[Path]:
    """Return a folder for each case; no two cases may share one."""
    if output is not None and len(case_files) == 1:
        return [output]
    folders = [(output or Path("runs")) / folder_name(path) for path in case_files]
    for k, folder in enumerate(folders):
        if folder in folders[:k]:
            raise click.UsageError(f"two of the cases would be run in {folder}")
    return folders


def _load_cases(case_files: Sequence[Path], overrides: Sequence[str]) -> list[Case]:
    """Read all case files; their problems are reported together."""
    cases, problems = [], []
    for path in case_files:
        try:
            cases.append(load_case(path, overrides))
        except CaseError as error:
            problems += error.problems
    if problems:
        raise CaseError(problems)
    return cases


def _say_ending(folder: Path, result: "Result") -> None:
    """Print how a run ended, on rank 0."""
    from mpisph.io.result import bodies_table, comparison_table, verdict_table

    if MPI.COMM_WORLD.rank != 0:
        return
    if result.status == "stopped":
        after = f" once {folder / STOP_FILE} is gone" * (folder / STOP_FILE).exists()
        click.echo(
            f"stopped ({result.reason}) at step {result.step}, t = "
            f"{result.time * 1e6:.4f} us; `mpisph resume {folder}` continues it{after}",
            err=True,
        )
        return
    console = open_console(stderr=False)
    if result.comparisons:
        console.print(comparison_table(result))
    if result.bodies:
        console.print(bodies_table(result))
    if result.verdict:
        console.print(verdict_table(result))
        text = f"verdict: {result.verdict.outcome}: {result.verdict.reason}"
        console.print(text, highlight=False, markup=False, soft_wrap=True)
    c, t = result.conservation, result.timing
    momentum = ""
    if c.momentum_z_error is not None:
        momentum = f", axial momentum {abs(c.momentum_z_error):.1g}"
    console.print(
        f"{result.status}: {counted(result.particles, 'particle')}, "
        f"{counted(t.steps, 'step')} in {t.wall:.2f} s on {counted(t.ranks, 'rank')}; "
        f"relative errors: energy {c.energy_error_max:.1e}{momentum}\n"
        f"files in {folder}",
        highlight=False,
        soft_wrap=True,
    )
    for text in result.damage:
        click.echo(f"warning: {folder}/{text}", err=True)
    if result.status == "unstable":
        text = f"unstable ({result.reason}) at step {result.step}: {result.detail}"
        click.echo(text, err=True)


@click.command("status")
@runs_argument
def status_command(folders: tuple[Path, ...]) -> None:
    """Say how the runs in folders stand; exit code 2 where there is none."""
    from mpisph.io.standing import standing

    found = from_root(MPI.COMM_WORLD, lambda: [standing(f) for f in folders])
    for folder, each in zip(folders, found, strict=True):
        click.echo(_status_line(folder, each))
    if any(each.state == "to do" for each in found):
        raise click.exceptions.Exit(BAD_INPUT)


def _status_line(folder: Path, standing: "Standing") -> str:
    state, reason, status = standing
    if status is None:
        return f"{folder}: {'no run' if state == 'to do' else state}"
    because = f" ({reason})" if reason else ""
    reached, end = status.time * 1e6, status.end_time * 1e6
    ranks = counted(status.ranks, "rank")
    return (
        f"{folder}: {state}{because}, step {status.step}, t = {reached:.4f} of "
        f"{end:.4f} us, {ranks}, {status.host}, {status.updated}"
    )
