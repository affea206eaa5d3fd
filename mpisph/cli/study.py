"""The commands of a study: ``mpisph study run`` and its companions."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from mpi4py import MPI

from mpisph.cli.options import STOPPED, OutputPath, shipped, walltime_option
from mpisph.core.console import open_console
from mpisph.core.errors import MpisphError
from mpisph.core.held_signals import release_signals
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.signals import SignalHandler

if TYPE_CHECKING:
    from mpisph.study.model import Study

_SHOWN = 20
# Rows of a status that are named one by one.

study_argument = click.argument(
    "study_file", metavar="STUDY", type=click.Path(path_type=Path)
)
root_option = click.option(
    "-o",
    "--output",
    "root",
    type=OutputPath(path_type=Path, file_okay=False),
    default="runs",
    show_default=True,
    help="Folder of the runs and tables of all studies.",
)
ranks_option = click.option(
    "--ranks-per-case",
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    help="Ranks that share one case.",
)


@click.group("study")
@click.pass_context
def study_group(context: click.Context) -> None:
    """Vary a case over a grid of settings: run, collect and draw it."""
    if context.invoked_subcommand != "run":
        release_signals()


def _part(
    _: click.Context, option: click.Parameter, text: str | None
) -> tuple[int, int]:
    """Return ``2/8`` as numbers."""
    if text is None:
        return 0, 1
    number, _slash, of = text.partition("/")
    if number.isdecimal() and of.isdecimal() and int(number) < int(of):
        return int(number), int(of)
    wanted = "expected K/N with K from 0 to N-1, such as 0/8"
    raise click.BadParameter(f"{text!r}: {wanted}", param=option)


@study_group.command("run")
@study_argument
@root_option
@ranks_option
@click.option(
    "--part",
    metavar="K/N",
    callback=_part,
    help="Begin with every N-th case, from the K-th on; then help with the others.",
)
@walltime_option
@click.pass_obj
def study_run_command(
    signals: SignalHandler,
    study_file: Path,
    root: Path,
    ranks_per_case: int,
    part: tuple[int, int],
    walltime: float | None,
) -> None:
    """Run all cases of STUDY that have not ended yet, then write its tables and figure.

    The ranks of mpirun are divided into groups, each of which takes the next case.
    Runs are kept by what they compute: a study continues where it was stopped, and
    studies share runs.
    """
    from mpisph.study.runner import Part, run_study
    from mpisph.study.store import study_folder

    comm = MPI.COMM_WORLD
    study = _load(study_file)
    if walltime is not None:
        signals.limit(walltime)
    with signals.catching_signals(comm):
        outcome = run_study(
            study,
            comm,
            root,
            open_console(stderr=True),
            ranks_per_case=ranks_per_case,
            part=Part(*part),
            signals=signals,
        )
    on_root(comm, lambda: _finish(study, root))
    elsewhere = f", {outcome.elsewhere} at work elsewhere" * (outcome.elsewhere > 0)
    click.echo(
        f"{study.name}: {outcome.completed} completed, {outcome.unstable} unstable, "
        f"{outcome.failed} failed, {outcome.left} left{elsewhere}\n"
        f"table and figure in {study_folder(root, study)}"
    )
    if outcome.stopped or outcome.left:
        raise click.exceptions.Exit(STOPPED)
    if outcome.failed:
        raise click.exceptions.Exit(1)


def _load(study_file: Path) -> "Study":
    """Return a study, read on rank 0."""
    from mpisph.study.model import load_study

    return from_root(MPI.COMM_WORLD, lambda: load_study(study_file))


def _finish(study: "Study", root: Path, parquet: bool = False) -> Path:
    """Write the tables of a study, and draw its figure; on rank 0."""
    from mpisph.study.paper.best import write_best
    from mpisph.study.paper.ranges import write_ranges
    from mpisph.study.plots.draw import draw_study
    from mpisph.study.table import collect, write_table

    rows = collect(study, root)
    table = write_table(study, root, rows, parquet)
    write_ranges(study, root, rows)
    write_best(study, root, rows)
    draw_study(study, rows, root)
    return table


@study_group.command("collect")
@study_argument
@root_option
@click.option("--parquet", is_flag=True, help="Write a Parquet file as well.")
def study_collect_command(study_file: Path, root: Path, parquet: bool) -> None:
    """Write the tables of STUDY (CSV) and its figure, as far as its runs have come."""
    study = _load(study_file)
    click.echo(from_root(MPI.COMM_WORLD, lambda: _finish(study, root, parquet)))


@study_group.command("draw")
@study_argument
@root_option
def study_draw_command(study_file: Path, root: Path) -> None:
    """Draw the figure of STUDY, as far as its runs have come."""
    study = _load(study_file)
    click.echo(from_root(MPI.COMM_WORLD, lambda: _draw(study, root)))


def _draw(study: "Study", root: Path) -> Path:
    """Draw the figure of a study; on rank 0."""
    from mpisph.study.plots.draw import draw_study
    from mpisph.study.table import collect

    figure = draw_study(study, collect(study, root), root)
    if figure is None:
        described = study.file.figure is not None
        why = f"no run is complete in {root}" if described else "expected [figure]"
        raise MpisphError(f"{study.path}: nothing to draw: {why}")
    return figure


@study_group.command("status")
@study_argument
@root_option
@click.option("--all", "everything", is_flag=True, help="Name every case.")
def study_status_command(study_file: Path, root: Path, everything: bool) -> None:
    """Say how the cases of STUDY stand."""
    lines = from_root(MPI.COMM_WORLD, lambda: _status(study_file, root, everything))
    click.echo("\n".join(lines))


def _status(path: Path, root: Path, everything: bool) -> Sequence[str]:
    from mpisph.study.keys import keyed_cases
    from mpisph.study.store import case_folder, counts, look_up_all

    cases = keyed_cases(path, root)
    places = look_up_all(root, cases)
    numbers = ", ".join(f"{n} {name}" for name, n in counts(places).items() if n)
    lines = [f"{path.stem}: {len(cases)} cases: {numbers}"]
    quiet = {"completed", "to do"}
    named = [
        f"  {case_folder(root, case)}  {place.standing}"
        f"{f' ({place.reason})' if place.reason else ''}: {case.name()}"
        for case, place in zip(cases, places, strict=True)
        if everything or place.standing not in quiet
    ]
    if not everything and len(named) > _SHOWN:
        more = f"  and {len(named) - _SHOWN} more: see --all"
        named = [*named[:_SHOWN], more]
    return lines + named


@study_group.command("script")
@study_argument
@root_option
@ranks_option
@click.option("--slurm", "system", flag_value="slurm", help="For Slurm.")
@click.option("--pbs", "system", flag_value="pbs", help="For PBS.")
@click.option(
    "--jobs",
    type=click.IntRange(min=1, max=10_000),
    default=4,
    show_default=True,
    help="Elements of the job array.",
)
@click.option(
    "--ranks",
    type=click.IntRange(min=1),
    default=16,
    show_default=True,
    help="Ranks of each element.",
)
@click.option(
    "--time",
    "minutes",
    metavar="MINUTES",
    type=click.IntRange(min=5),
    default=240,
    show_default=True,
    help="Longest time of one start of an element.",
)
def study_script_command(
    study_file: Path,
    root: Path,
    ranks_per_case: int,
    system: str | None,
    jobs: int,
    ranks: int,
    minutes: int,
) -> None:
    """Print a batch script that runs STUDY in a job array.

    Each element begins with its share of the cases and then helps the others; before
    its time is up it stops and queues itself again, until nothing is left.
    """
    from mpisph.study.script import Job, batch_script

    if system is None:
        raise click.UsageError("expected --slurm or --pbs")
    if ranks_per_case > ranks:
        raise MpisphError(f"{ranks_per_case} ranks for each case, but --ranks {ranks}")
    study = _load(study_file)
    job = Job(study.name, study_file, root, jobs, ranks, ranks_per_case, minutes)
    click.echo(batch_script(job, system), nl=False)


@study_group.command("claims")
@click.argument(
    "claims_file",
    metavar="[CLAIMS]",
    required=False,
    type=click.Path(path_type=Path),
)
@root_option
@click.option("--markdown", is_flag=True, help="Print a table in Markdown.")
def study_claims_command(claims_file: Path | None, root: Path, markdown: bool) -> None:
    """Say which claims of the paper the studies' runs support.

    CLAIMS is cases/studies/claims.toml by default. Claims whose studies have not been
    run are named as such.
    """
    from mpisph.study.paper.claims import answer_claims, as_markdown, as_table

    path = claims_file or shipped("studies/claims.toml")
    answers = from_root(MPI.COMM_WORLD, lambda: answer_claims(path, root))
    if markdown:
        click.echo(as_markdown(answers), nl=False)
    elif MPI.COMM_WORLD.rank == 0:
        open_console(stderr=False).print(as_table(answers))
