"""The command that compares the program with exact solutions."""

from pathlib import Path

import click
from mpi4py import MPI

from mpisph.cli.options import OutputPath
from mpisph.core.console import open_console
from mpisph.parallel.collectives import on_root


@click.command("verify")
@click.argument("names", metavar="[NAME]...", nargs=-1)
@click.option(
    "--quick", is_flag=True, help="Coarser and fewer runs, in a minute altogether."
)
@click.option("--list", "only_list", is_flag=True, help="Say which problems there are.")
@click.option(
    "-o",
    "--output",
    type=OutputPath(path_type=Path, file_okay=False),
    help="Folder of runs, tables, figures and page.  [default: runs/verify, or "
    "runs/verify-quick]",
)
def verify_command(
    names: tuple[str, ...], quick: bool, only_list: bool, output: Path | None
) -> None:
    """Run problems with known solutions and compare with these: all, or each NAME.

    Prints what was measured, the exact value, the bound and the order of convergence,
    and writes tables, figures and one HTML page. The exit code is 1 if a check fails.
    """
    from mpisph.verify.page import PAGE_FILE, write_page
    from mpisph.verify.problems import find_problems
    from mpisph.verify.record import write_record
    from mpisph.verify.runner import verify
    from mpisph.verify.tables import problem_table, summary, verdict_table

    comm = MPI.COMM_WORLD
    problems = find_problems(names)
    console = open_console(stderr=False)
    if only_list:
        if comm.rank == 0:
            console.print(problem_table(problems))
        return
    folder = output or Path("runs/verify-quick" if quick else "runs/verify")
    on_root(comm, lambda: folder.mkdir(parents=True, exist_ok=True))
    verdicts = verify(problems, comm, folder, open_console(stderr=True), quick)
    on_root(comm, lambda: write_record(folder, verdicts))
    on_root(comm, lambda: write_page(folder, verdicts))
    if comm.rank == 0:
        console.print(verdict_table(verdicts))
        click.echo(f"{summary(verdicts)}; page in {folder / PAGE_FILE}")
    if not all(verdict.passed for verdict in verdicts):
        raise click.exceptions.Exit(1)
