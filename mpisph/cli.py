"""The command line: ``mpisph run``, ``mpisph bench`` and smaller commands.

Every rank runs the same commands; rank 0 alone speaks. Exit codes: 0 done, 2 bad
input, 3 unstable run, 1 anything else. An unforeseen exception on one rank ends all.
"""

import json
import os
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NoReturn, TypeVar

import click
from mpi4py import MPI

import mpisph
from mpisph import __version__
from mpisph.bench import PARTS
from mpisph.case import Case, case_schema, load_case
from mpisph.collectives import on_root
from mpisph.errors import CaseError, CollectiveError, MpisphError
from mpisph.estimate import estimate
from mpisph.jit import CACHE_FOLDER, cache_size, clear_cache, is_compiled
from mpisph.materials.quantities import si_value
from mpisph.progress import open_console

BAD_INPUT = 2
UNSTABLE = 3

T = TypeVar("T")

set_option = click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Override a key of the case, such as --set resolution.npr=20 (repeatable).",
)


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="mpisph")
def cli() -> None:
    """Axisymmetric SPH for hypervelocity impact; mpirun starts it on many ranks."""


@cli.command("run")
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
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder of the run, or of the runs' folders where there are several CASEs; "
    "files of an earlier run are replaced.  [default: runs/<name of the case file>]",
)
@set_option
@click.option("--dry-run", is_flag=True, help="Check the case, print its size, stop.")
def run_command(
    case_files: tuple[Path, ...],
    output: Path | None,
    overrides: tuple[str, ...],
    dry_run: bool,
) -> None:
    """Run case files (TOML), one after the other, and write a folder for each."""
    comm = MPI.COMM_WORLD
    folders = _run_folders(case_files, output)
    cases = on_root_or_raise(comm, lambda: _load_cases(case_files, overrides))
    if dry_run:
        for case in cases:
            click.echo(estimate(case, comm.size).text())
        return
    stable = [run_case(c, comm, f) for c, f in zip(cases, folders, strict=True)]
    if not all(stable):
        raise click.exceptions.Exit(UNSTABLE)


def _run_folders(case_files: Sequence[Path], output: Path | None) -> list[Path]:
    """Return a folder for each case; no two cases may share one."""
    if output is not None and len(case_files) == 1:
        return [output]
    folders = [(output or Path("runs")) / path.stem for path in case_files]
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


def run_case(case: Case, comm: MPI.Intracomm, folder: Path) -> bool:
    """Run a case, print how it ended, and return whether it was stable."""
    from mpisph.result import comparison_table
    from mpisph.run import run

    result = run(case, comm, folder)
    if comm.rank == 0:
        console = open_console(stderr=False)
        if result.comparisons:
            console.print(comparison_table(result))
        c, t = result.conservation, result.timing
        console.print(
            f"{result.status}: {result.particles} particles, {t.steps} steps in "
            f"{t.wall:.2f} s on {t.ranks} rank{'s' if t.ranks > 1 else ''}; energy "
            f"error {c.energy_error_max:.1e}, axial momentum "
            f"{abs(c.momentum_z_error):.1e}\nfiles in {folder}",
            highlight=False,
            soft_wrap=True,
        )
        if result.status == "unstable":
            text = f"unstable ({result.reason}) at step {result.step}: {result.detail}"
            click.echo(text, err=True)
    return result.status != "unstable"


@cli.command("schema")
def schema_command() -> None:
    """Print the JSON schema of the case file."""
    click.echo(json.dumps(case_schema(), indent=2))


@cli.command("figures")
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
def figures_command(folder: Path) -> None:
    """Draw the figures of the run folder RUN again."""
    from mpisph.figures import draw_run

    comm = MPI.COMM_WORLD
    paths = on_root_or_raise(comm, lambda: draw_run(folder))
    if not paths:
        raise MpisphError(f"{folder}: no snapshots to draw; is it a run's folder?")
    for path in paths:
        click.echo(path)


@cli.command("clock")
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
def clock_command(folder: Path) -> None:
    """Fit the experiment's clock offset on the run folder RUN.

    The offset makes R_b and L_b at all measured exposures fit best. The run must have
    gone on for some microseconds after the last exposure.
    """
    text = on_root_or_raise(MPI.COMM_WORLD, lambda: _clock_text(folder))
    click.echo(text)


def _clock_text(folder: Path) -> str:
    from mpisph.clock import fit_clock
    from mpisph.history import HISTORY_FILE, read_history
    from mpisph.run import CASE_FILE

    if not (folder / CASE_FILE).exists():
        raise MpisphError(f"{folder}: no {CASE_FILE}; is it a run's folder?")
    case = load_case(folder / CASE_FILE)
    try:
        fit = fit_clock(read_history(folder / HISTORY_FILE), case)
    except ValueError as error:
        raise MpisphError(f"{folder}: {error}") from error
    lines = [f"clock offset {fit.offset * 1e6:.2f} us"]
    for name, left, alone in zip(fit.names, fit.errors, fit.separate, strict=True):
        lines.append(
            f"  {name:16} error {100 * left:+5.1f} %, alone {alone * 1e6:5.2f} us"
        )
    return "\n".join(lines)


def _positive_time(_: click.Context, option: click.Parameter, text: str) -> float:
    """Return a time with its unit, such as ``4us``, in seconds."""
    try:
        seconds = si_value(text, "s")
    except ValueError as error:
        raise click.BadParameter(f"{text}: {error}", param=option) from error
    if seconds <= 0.0:
        raise click.BadParameter(f"{text}: expected more than 0 s", param=option)
    return seconds


@cli.command("bench")
@click.argument(
    "case_file", metavar="[CASE]", required=False, type=click.Path(path_type=Path)
)
@click.option(
    "--npr",
    type=click.IntRange(min=2),
    default=40,
    show_default=True,
    help="Particles along the radius of the shot's sphere.",
)
@click.option(
    "--late",
    metavar="TIME",
    callback=_positive_time,
    default="4us",
    show_default=True,
    help="The shot's late time.",
)
@click.option(
    "--store",
    type=click.Path(path_type=Path, file_okay=False),
    help="Folder that keeps the shot at its late time.  [default: in the code cache]",
)
@click.option(
    "--repeats",
    type=click.IntRange(min=1),
    default=5,
    show_default=True,
    help="How often each scene is timed; the median and the extremes are said.",
)
@click.option(
    "--steps",
    type=click.IntRange(min=1),
    default=10,
    show_default=True,
    help="Steps of one repeat.",
)
@click.option(
    "--only",
    type=click.Choice(PARTS),
    multiple=True,
    help="Measure this alone (repeatable).",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    default="bench.json",
    show_default=True,
    help="JSON file of all figures.",
)
def bench_command(
    case_file: Path | None,
    npr: int,
    late: float,
    store: Path | None,
    repeats: int,
    steps: int,
    only: tuple[str, ...],
    output: Path,
) -> None:
    """Measure the speed of this program on this machine.

    A block of particles, the shot CASE (4-1353 by default) at impact and at a late
    time, on one rank and on more, up to those that mpirun started; then the start-up.
    """
    from mpisph.bench.bench import Options, bench
    from mpisph.bench.record import write_bench
    from mpisph.bench.tables import tables

    comm = MPI.COMM_WORLD
    options = Options(
        npr, late, store or CACHE_FOLDER.parent / "bench", steps, repeats, only or PARTS
    )
    record = bench(
        case_file or _shipped_case(), comm, options, open_console(stderr=True)
    )
    on_root(comm, lambda: write_bench(output, record))
    if comm.rank == 0:
        console = open_console(stderr=False)
        for table in tables(record):
            console.print(table)
        m = record.machine
        console.print(
            f"{m.cpu}, {m.cores} logical cores, load average {m.load[0]:.2f} at the "
            f"start\nfigures in {output}",
            highlight=False,
            soft_wrap=True,
        )


def _shipped_case() -> Path:
    """Return the case to measure where none is given."""
    path = Path(mpisph.__file__).parents[1] / "cases" / "piekutowski-4-1353.toml"
    if not path.exists():
        raise click.UsageError("no case files beside the package: give a CASE")
    return path


@cli.command("scaling")
@click.argument("case_file", metavar="CASE", type=click.Path(path_type=Path))
@click.option(
    "--parts",
    type=click.IntRange(min=2, max=65536),
    multiple=True,
    default=(16, 64, 256),
    show_default=True,
    help="Numbers of ranks (repeatable).",
)
@set_option
def scaling_command(
    case_file: Path, parts: tuple[int, ...], overrides: tuple[str, ...]
) -> None:
    """Count what many ranks would do in a step of CASE, without running it.

    Own and ghost particles, messages and kB of the fullest rank, in brackets the mean,
    and the parallel efficiency modelled from them, for both cuts.
    """
    from mpisph.scaling import initial_layout, scaling_table

    comm = MPI.COMM_WORLD
    case = on_root_or_raise(comm, lambda: load_case(case_file, overrides))
    lines = on_root_or_raise(comm, lambda: scaling_table(initial_layout(case), parts))
    click.echo("\n".join(lines))


@cli.group("cache")
def cache_group() -> None:
    """Compile beforehand; look after the compiled code."""


@cache_group.command("warm")
def cache_warm_command() -> None:
    """Compile all that a run calls, and say where the code is kept."""
    from mpisph.compiled import warm_up

    warm_up(MPI.COMM_WORLD)
    _say_cache()


@cache_group.command("show")
def cache_show_command() -> None:
    """Say where compiled code is kept, and whether a run must compile first."""
    _say_cache()


def _say_cache() -> None:
    state = "compiled" if is_compiled() else "not compiled yet"
    click.echo(f"{CACHE_FOLDER}: {state}, {cache_size() / 1e6:.1f} MB")


@cache_group.command("clear")
def cache_clear_command() -> None:
    """Remove all compiled code, of these and of other sources."""
    MPI.COMM_WORLD.Barrier()  # a rank that starts makes its folder in the cache
    on_root(MPI.COMM_WORLD, clear_cache)
    click.echo(f"removed from {CACHE_FOLDER.parent}")


def on_root_or_raise(comm: MPI.Intracomm, action: Callable[[], T]) -> T:
    """Do something on rank 0 and hand its result, or its error, to all ranks.

    Raises
    ------
    CollectiveError, MpisphError, RuntimeError
        On all ranks, if the action failed; see `collectives.raise_together`.
    """
    results: list[T] = []
    on_root(comm, lambda: results.append(action()))
    results = comm.bcast(results)
    return results[0]


def _end_all_ranks(
    kind: type[BaseException], error: BaseException, trace: object
) -> None:
    """Print the traceback and end every rank: the others would wait for ever."""
    text = "".join(traceback.format_exception(error))
    sys.stderr.write(f"rank {MPI.COMM_WORLD.rank}:\n{text}")
    sys.stderr.flush()
    MPI.COMM_WORLD.Abort(1)


def main() -> NoReturn:
    """Run the command line; the entry point of ``mpisph``."""
    sys.excepthook = _end_all_ranks
    first = MPI.COMM_WORLD.rank == 0
    if not first:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")
    sys.exit(_run(first))


def _run(first: bool) -> int:
    """Run the command line and return its exit code, the same on all ranks."""
    try:
        code = cli.main(prog_name="mpisph", standalone_mode=False)
    except click.ClickException as error:
        if first:
            error.show()
        return error.exit_code
    except CaseError as error:
        if first:
            click.echo(f"mpisph: {error}", err=True)
        return BAD_INPUT
    except (MpisphError, CollectiveError) as error:
        if first:
            click.echo(f"mpisph: {error}", err=True)
        return 1
    except OSError as error:  # the other ranks know nothing of it
        click.echo(f"mpisph: rank {MPI.COMM_WORLD.rank}: {error}", err=True)
        MPI.COMM_WORLD.Abort(1)
    return code if isinstance(code, int) else 0
