"""The command ``mpisph assess``: published tests of shields, computed and compared."""

from pathlib import Path
from typing import TYPE_CHECKING

import click
from mpi4py import MPI

from mpisph.cli.options import STOPPED, OutputPath, set_option, walltime_option
from mpisph.cli.study import ranks_option
from mpisph.core.console import open_console
from mpisph.core.held_signals import release_signals
from mpisph.core.words import counted
from mpisph.inputs.folder_name import folder_name
from mpisph.parallel.collectives import from_root
from mpisph.run.signals import SignalHandler

if TYPE_CHECKING:
    from mpisph.study.assess.cases import Assessment

_SHOWN = 20
# Misses that the terminal names.

_LONGEST = 200
# Letters of a title.


@click.command("assess")
@click.argument(
    "tests_file",
    metavar="TESTS",
    required=False,
    type=click.Path(path_type=Path),
)
@click.option(
    "-o",
    "--output",
    "root",
    type=OutputPath(path_type=Path, file_okay=False),
    help="Folder of runs, tables and page.  [default: runs/assess-<name of TESTS>]",
)
@click.option(
    "--rows",
    metavar="NUMBERS",
    help="Tests to compute, by the column row: 2,4,13 or 10-20.  [default: all]",
)
@set_option
@ranks_option
@click.option(
    "--collect-only",
    is_flag=True,
    help="Run nothing; write tables and page, as far as the runs have come.",
)
@walltime_option
@click.option(
    "--alloys", is_flag=True, help="Print which card stands for which alloy, and why."
)
@click.pass_obj
def assess_command(
    signals: SignalHandler,
    tests_file: Path | None,
    root: Path | None,
    rows: str | None,
    overrides: tuple[str, ...],
    ranks_per_case: int,
    collect_only: bool,
    walltime: float | None,
    alloys: bool,
) -> None:
    """Compute published tests of Whipple shields and say how many come out right.

    TESTS is a CSV file with a test in each row. Each becomes a case with a [shield];
    the ranks of mpirun take one after the other, the longest first. Christiansen's
    equation is judged beside the verdicts. Started again, it continues.
    """
    from mpisph.study.assess.summary import alloy_sheet, as_text

    if alloys:
        release_signals()
        click.echo(as_text(alloy_sheet()))
        return
    if tests_file is None:
        raise click.UsageError("expected TESTS, a CSV file of tests, or --alloys")
    comm, path = MPI.COMM_WORLD, tests_file
    folder = root or Path("runs") / f"assess-{folder_name(path)}"
    if collect_only:
        release_signals()
    if walltime is not None:
        signals.limit(walltime)
    made = from_root(comm, lambda: _plan(path, folder, rows, overrides))
    stopped, missing = False, False
    if not collect_only:
        stopped, missing = _run(made, folder, ranks_per_case, signals)
    click.echo(from_root(comm, lambda: _finish(made, folder)))
    if stopped or missing:
        raise click.exceptions.Exit(STOPPED)


def _plan(
    path: Path, folder: Path, rows: str | None, overrides: tuple[str, ...]
) -> "Assessment":
    """Read the tests and write their study; on rank 0."""
    from mpisph.study.assess.cases import plan
    from mpisph.study.assess.published import chosen_tests, read_tests

    tests = chosen_tests(read_tests(path), rows)
    title = f"Do the walls hold? Tests in {path.name}"[:_LONGEST]
    return plan(tests, folder, title, overrides)


def _run(
    made: "Assessment", folder: Path, ranks_per_case: int, signals: SignalHandler
) -> tuple[bool, bool]:
    """Run what has not ended; return whether it was stopped, and whether any is left.

    A run that fails or breaks down is a test without a verdict.
    """
    from mpisph.study.runner import run_study

    comm = MPI.COMM_WORLD
    with signals.catching_signals(comm):
        outcome = run_study(
            made.study,
            comm,
            folder,
            open_console(stderr=True),
            ranks_per_case=ranks_per_case,
            signals=signals,
        )
    return outcome.stopped, outcome.left > 0


def _finish(made: "Assessment", folder: Path) -> str:
    """Write table, figure and page; return what the terminal shows; on rank 0."""
    from mpisph.report.assess_page import PAGE_FILE, write_page
    from mpisph.study.assess.outcome import TABLE_FILE, assess, table_rows
    from mpisph.study.assess.scatter import FIGURE_FILE, can_draw, draw_scatter
    from mpisph.study.assess.summary import summary_text
    from mpisph.study.table import write_rows

    tests = assess(made, folder)
    write_rows(folder / TABLE_FILE, table_rows(tests))
    files = [folder / TABLE_FILE, folder / PAGE_FILE]
    if can_draw(tests):
        draw_scatter(tests, folder / FIGURE_FILE)
        files.append(folder / FIGURE_FILE)
    write_page(made, tests, folder)
    ended = sum(test.ended for test in tests)
    head = f"{ended} of {counted(len(tests), 'test')} computed, in {folder}"
    return "\n\n".join(
        [head, summary_text(tests, _SHOWN), *["\n".join(map(str, files))]]
    )
