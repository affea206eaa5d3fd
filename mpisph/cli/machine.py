"""The commands that need no run: speed, scaling, the code cache, the schema."""

from pathlib import Path

import click
from mpi4py import MPI

from mpisph.bench import PARTS
from mpisph.case import load_case
from mpisph.cli.options import set_option, shipped
from mpisph.core.console import open_console
from mpisph.core.jit import CACHE_FOLDER, cache_size, clear_cache, is_compiled
from mpisph.inputs.quantities import si_value
from mpisph.parallel.collectives import from_root, on_root


def _positive_time(_: click.Context, option: click.Parameter, text: str) -> float:
    """Return a time with its unit, such as ``4us``, in seconds."""
    try:
        seconds = si_value(text, "s")
    except ValueError as error:
        raise click.BadParameter(f"{text}: {error}", param=option) from error
    if seconds <= 0.0:
        raise click.BadParameter(f"{text}: expected more than 0 s", param=option)
    return seconds


@click.command("bench")
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
@set_option
@click.option(
    "--against",
    metavar="OLD",
    help="Compare with OLD, in turns: a revision of the sources, a folder of others, "
    "or a setting KEY=VALUE of the case. Prints the ratio of step times.",
)
@click.option(
    "--pairs",
    type=click.IntRange(min=1),
    default=5,
    show_default=True,
    help="How often each is started, with --against.",
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
    overrides: tuple[str, ...],
    against: str | None,
    pairs: int,
    output: Path,
) -> None:
    """Measure the speed of this program on this machine.

    A block of particles, the shot CASE (4-1353 by default) at impact and at a late
    time, and with some thousand particles, on one rank and on more, up to those that
    mpirun started; then the start-up.
    """
    from mpisph.bench.bench import Options, bench, bench_against
    from mpisph.bench.record import write_bench
    from mpisph.bench.tables import tables

    comm = MPI.COMM_WORLD
    options = Options(
        npr,
        late,
        store or CACHE_FOLDER.parent / "bench",
        steps,
        repeats,
        only or PARTS,
        overrides,
    )
    shot = case_file or shipped("piekutowski-4-1353.toml")
    console = open_console(stderr=True)
    if against is None:
        record = bench(shot, comm, options, console)
    else:
        record = bench_against(shot, comm, options, console, against, pairs)
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


@click.command("scaling")
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


@click.group("cache")
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
    from mpisph.case.sections import PAIR_FORMS

    found = [form for form in PAIR_FORMS if is_compiled(form)]
    state = f"compiled for {' and '.join(found)}" if found else "not compiled yet"
    click.echo(f"{CACHE_FOLDER}: {state}, {cache_size() / 1e6:.1f} MB")


@cache_group.command("clear")
def cache_clear_command() -> None:
    """Remove all compiled code, of these and of other sources."""
    MPI.COMM_WORLD.Barrier()  # a rank that starts makes its folder in the cache
    on_root(MPI.COMM_WORLD, clear_cache)
    click.echo(f"removed from {CACHE_FOLDER.parent}")
