"""The command line: ``mpisph run``, ``mpisph bench`` and smaller commands.

Every rank runs the same commands; rank 0 alone speaks. Exit codes: 0 done, 2 bad
input, 3 unstable run, 75 stopped and to be resumed, 1 anything else. An error that one
rank meets alone, and the death of a rank, end all.
"""

import json
import os
import sys
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click
from mpi4py import MPI

from mpisph import __version__
from mpisph.bench import PARTS
from mpisph.case import Case, case_schema, load_case
from mpisph.cli.options import (
    BAD_INPUT,
    STOPPED,
    UNSTABLE,
    runs_argument,
    set_option,
    shipped,
    walltime_option,
)
from mpisph.cli.study import study_group
from mpisph.core.console import open_console
from mpisph.core.errors import CaseError, CollectiveError, MpisphError
from mpisph.core.jit import CACHE_FOLDER, cache_size, clear_cache, is_compiled
from mpisph.core.launcher import launch_of, mismatch
from mpisph.inputs.quantities import si_value
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.signals import STOP_FILE, SignalHandler
from mpisph.solver.estimate import estimate

if TYPE_CHECKING:
    from mpisph.io.result import Result


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="mpisph")
def cli() -> None:
    """Axisymmetric SPH for hypervelocity impact; mpirun starts it on many ranks."""


cli.add_command(study_group)


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
    help="Folder of the run, or of the runs' folders where there are several CASEs.  "
    "[default: runs/<name of the case file>]",
)
@set_option
@walltime_option
@click.option("--force", is_flag=True, help="Start anew; remove the folder's old run.")
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

    A run that was stopped or killed goes on from its last checkpoint. One that has
    ended is not repeated.
    """
    comm = MPI.COMM_WORLD
    folders = _run_folders(case_files, output)
    cases = from_root(comm, lambda: _load_cases(case_files, overrides))
    if dry_run:
        for case in cases:
            click.echo(estimate(case, comm.size).text())
        return
    from mpisph.run.session import run

    pairs = list(zip(cases, folders, strict=True))
    _finish_runs(
        signals,
        walltime,
        folders,
        [partial(run, c, comm, f, force=force, signals=signals) for c, f in pairs],
    )


@cli.command("resume")
@runs_argument
@walltime_option
@click.pass_obj
def resume_command(
    signals: SignalHandler, folders: tuple[Path, ...], walltime: float | None
) -> None:
    """Go on with the runs in folders, on any number of ranks.

    A run goes on from its last sound checkpoint, or from the beginning where there is
    none. One that has ended is not repeated.
    """
    from mpisph.run.session import resume

    comm = MPI.COMM_WORLD
    runs = [partial(resume, comm, folder, signals=signals) for folder in folders]
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
    with signals.heeding_signals(MPI.COMM_WORLD):
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


def _say_ending(folder: Path, result: "Result") -> None:
    """Print how a run ended, on rank 0."""
    from mpisph.io.result import comparison_table

    if MPI.COMM_WORLD.rank != 0:
        return
    if result.status == "stopped":
        after = f" once {folder / STOP_FILE} is gone" * (folder / STOP_FILE).exists()
        click.echo(
            f"stopped ({result.reason}) at step {result.step}, "
            f"t = {result.time * 1e6:.4f} us; `mpisph resume {folder}` goes on{after}",
            err=True,
        )
        return
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


@cli.command("status")
@runs_argument
def status_command(folders: tuple[Path, ...]) -> None:
    """Say how the runs in folders stand."""
    lines = from_root(MPI.COMM_WORLD, lambda: [_status_line(f) for f in folders])
    click.echo("\n".join(lines))


def _status_line(folder: Path) -> str:
    from mpisph.io.lock import in_use
    from mpisph.io.status import read_status

    status = read_status(folder)
    if status is None:
        return f"{folder}: no run"
    state, reason = status.state, f" ({status.reason})" if status.reason else ""
    if state == "running":
        used = in_use(folder)
        if used is None:
            reason = " or killed, this file system does not tell"
        elif not used:
            state, reason = "failed", " (killed)"
    reached, end = status.time * 1e6, status.end_time * 1e6
    return (
        f"{folder}: {state}{reason}, step {status.step}, t = {reached:.4f} of "
        f"{end:.4f} us, {status.ranks} ranks, {status.host}, {status.updated}"
    )


@cli.command("schema")
def schema_command() -> None:
    """Print the JSON schema of the case file."""
    click.echo(json.dumps(case_schema(), indent=2))


@cli.command("figures")
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
def figures_command(folder: Path) -> None:
    """Draw the figures of the run folder RUN again."""
    from mpisph.figures.cloud import draw_run

    comm = MPI.COMM_WORLD
    paths = from_root(comm, lambda: draw_run(folder))
    if not paths:
        raise MpisphError(f"{folder}: no snapshots to draw; is it a run's folder?")
    for path in paths:
        click.echo(path)


@cli.command("report")
@click.argument(
    "paths",
    metavar="RUN_OR_STUDY...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="The page.  [default: report.html in the folder RUN, or in the study's folder "
    "studies/<name> below --runs; in the current folder where there are several]",
)
@click.option(
    "--runs",
    "root",
    type=click.Path(path_type=Path, file_okay=False),
    default="runs",
    show_default=True,
    help="Folder of the runs and tables of all studies, the -o of `mpisph study`.",
)
def report_command(paths: tuple[Path, ...], output: Path | None, root: Path) -> None:
    """Write one HTML page on runs and studies: results, pictures, set-up.

    RUN is a run's folder; STUDY is a study file, which ends in .toml. Of a study the
    page shows figures, the paper's ranges and claims beside ours, and the table, as far
    as its runs have come. It holds all of its pictures and needs no network.
    """
    from mpisph.report.run_page import REPORT_FILE, write_report
    from mpisph.study.store import STUDIES_FOLDER

    studies = [p for p in paths if p.suffix == ".toml" and not p.is_dir()]
    folders = [p for p in paths if p not in studies]
    home = Path()
    if len(paths) == 1:
        home = root / STUDIES_FOLDER / paths[0].stem if studies else paths[0]
    page = output or home / REPORT_FILE
    click.echo(
        from_root(MPI.COMM_WORLD, lambda: write_report(folders, page, studies, root))
    )


@cli.command("animate")
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="The film.  [default: film.mp4 in the folder RUN]",
)
@click.option(
    "--fps",
    type=click.FloatRange(min=0.1, max=120),
    help="Frames a second.  [default: a film of some seconds]",
)
def animate_command(folder: Path, output: Path | None, fps: float | None) -> None:
    """Make a film (MP4) of the run folder RUN, a frame for each snapshot.

    More frames need more snapshots: `mpisph run CASE --set output.every=0.1us`. The
    program ffmpeg comes with `pip install "mpisph[animate]"`.
    """
    from mpisph.figures.movie import FILM_FILE, animate

    film = output or folder / FILM_FILE
    click.echo(from_root(MPI.COMM_WORLD, lambda: animate(folder, film, fps)))


@cli.command("clock")
@runs_argument
@click.option(
    "--npr",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Take the offset of the run at this resolution.  [default: the finest]",
)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    help="The figure.  [default: clock.png, in the folder of a single run, else in the "
    "current one]",
)
def clock_command(
    folders: tuple[Path, ...], npr: float | None, output: Path | None
) -> None:
    """Fit the experiment's clock offset on completed runs of one shot.

    The offset makes R_b and L_b at all measured exposures fit best. A run must have
    gone on for some microseconds after the last exposure. Several RUNs, which may
    differ in resolution alone, give the numerical uncertainty.
    """
    out = output or (folders[0] if len(folders) == 1 else Path()) / "clock.png"
    on_root(MPI.COMM_WORLD, lambda: _say_clock(folders, npr, out))


def _say_clock(folders: Sequence[Path], npr: float | None, out_png: Path) -> None:
    """Print the fits and what they come to; draw them."""
    from mpisph.analysis.clock_offset import (
        clock_run,
        clock_table,
        conclude,
        conclusion_text,
    )
    from mpisph.figures.clock import draw_clock
    from mpisph.io.run_folder import case_in

    runs = [clock_run(folder, case_in(folder)) for folder in folders]
    conclusion = conclude(runs, npr)
    draw_clock(*runs, out_png=out_png, conclusion=conclusion)
    console = open_console(stderr=False)
    console.print(clock_table(runs))
    text = f"{conclusion_text(conclusion)}\nfigure in {out_png}"
    console.print(text, highlight=False, soft_wrap=True)


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
        case_file or shipped("piekutowski-4-1353.toml"),
        comm,
        options,
        open_console(stderr=True),
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
    from mpisph.bench.scaling import initial_layout, scaling_table

    comm = MPI.COMM_WORLD
    case = from_root(comm, lambda: load_case(case_file, overrides))
    lines = from_root(comm, lambda: scaling_table(initial_layout(case), parts))
    click.echo("\n".join(lines))


@cli.group("cache")
def cache_group() -> None:
    """Compile beforehand; look after the compiled code."""


@cache_group.command("warm")
def cache_warm_command() -> None:
    """Compile all that a run calls, and say where the code is kept."""
    from mpisph.solver.warmup import warm_up

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


def main() -> NoReturn:
    """Run the command line; the entry point of ``mpisph``."""
    signals = SignalHandler()
    sys.excepthook = signals.end_all_ranks
    first = MPI.COMM_WORLD.rank == 0
    launch = launch_of(os.environ)
    text = mismatch(launch, MPI.COMM_WORLD.size, MPI.Get_library_version())
    if text is not None:
        sys.exit(f"mpisph: {text}" if launch and launch.rank == 0 else 1)
    if not first:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")
    sys.exit(_run(signals, first))


def _run(signals: SignalHandler, first: bool) -> int:
    """Run the command line and return its exit code, the same on all ranks."""
    try:
        code = cli.main(prog_name="mpisph", standalone_mode=False, obj=signals)
    except click.exceptions.Abort:  # Ctrl-C where no run heeds it
        click.echo("mpisph: interrupted", err=True)
        MPI.COMM_WORLD.Abort(130)
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
            notes = getattr(error, "__notes__", ())
            click.echo("\n".join((f"mpisph: {error}", *notes)), err=True)
        return 1
    return code if isinstance(code, int) else 0
