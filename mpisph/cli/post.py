"""The commands that look at runs: figures, report, animate, clock.

What draws is imported by the command that does: it takes long to load.
"""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

import click
from mpi4py import MPI

from mpisph.cli.options import OutputPath, runs_argument
from mpisph.core.console import open_console
from mpisph.figures.fields import BODY, SHOWN_FIELDS, choose_fields
from mpisph.inputs.folder_name import folder_name
from mpisph.parallel.collectives import from_root, on_root

Command = TypeVar("Command", bound=Callable[..., Any])

Ranges = tuple[tuple[str, str], ...]


def field_options(command: Command) -> Command:
    """Add the options that say what pictures of particles show."""
    field = click.option(
        "--field",
        "fields",
        multiple=True,
        type=click.Choice(list(SHOWN_FIELDS)),
        help="What the colours show.  Given twice: above the axis, and below it.  "
        f"[default: {BODY.field.name}]",
    )
    limits = click.option(
        "--range",
        "ranges",
        nargs=2,
        multiple=True,
        metavar="LOW HIGH",
        help="Where the colours of --field begin and end, such as 0 5GPa; a plain "
        "number is in SI.  Given twice: of both fields.  [default: where the values of "
        "the whole run do, but for 1 % at each end]",
    )
    zoom = click.option(
        "--zoom",
        metavar="BODY",
        help="Show the body of this name close by, in one view that holds it at all "
        "times.",
    )
    return field(limits(zoom(command)))


@click.command("figures")
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
@field_options
def figures_command(
    folder: Path, fields: tuple[str, ...], ranges: Ranges, zoom: str | None
) -> None:
    """Draw the figures of the run folder RUN again, or those of fields or a body."""
    from mpisph.figures.cloud import draw_run
    from mpisph.io.run_folder import no_run

    comm, chosen = MPI.COMM_WORLD, choose_fields(fields, ranges)
    paths = from_root(comm, lambda: draw_run(folder, chosen, zoom))
    if not paths:
        raise no_run(folder, "snapshots to draw")
    for path in paths:
        click.echo(path)


@click.command("report")
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
    type=OutputPath(path_type=Path, dir_okay=False),
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
        home = paths[0]
        if studies:
            home = root / STUDIES_FOLDER / folder_name(paths[0])
    page = output or home / REPORT_FILE
    click.echo(
        from_root(MPI.COMM_WORLD, lambda: write_report(folders, page, studies, root))
    )


@click.command("animate")
@click.argument("folder", metavar="RUN", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    type=OutputPath(path_type=Path, dir_okay=False),
    help="The film.  [default: film.mp4 in the folder RUN, or "
    "film_<fields>_<body>.mp4]",
)
@click.option(
    "--fps",
    type=click.FloatRange(min=0.1, max=120),
    help="Frames a second.  [default: a film of some seconds]",
)
@field_options
def animate_command(
    folder: Path,
    output: Path | None,
    fps: float | None,
    fields: tuple[str, ...],
    ranges: Ranges,
    zoom: str | None,
) -> None:
    """Make a film (MP4) of the run folder RUN, a frame for each snapshot.

    More frames need more snapshots: `mpisph run CASE --set output.every=0.1us`. The
    program ffmpeg comes with `pip install "mpisph[animate]"`.
    """
    from mpisph.figures.movie import FILM_FILE, animate

    chosen = choose_fields(fields, ranges)
    parts = ("film", *fields) if zoom is None else ("film", *fields, zoom)
    film = output or (folder / FILM_FILE).with_stem("_".join(parts))
    draw = partial(animate, folder, film, fps, chosen or (BODY,), zoom)
    click.echo(from_root(MPI.COMM_WORLD, draw))


@click.command("clock")
@runs_argument
@click.option(
    "--npr",
    type=click.FloatRange(min=0.0, min_open=True),
    help="Take the offset of the run at this resolution.  [default: the finest]",
)
@click.option(
    "-o",
    "--output",
    type=OutputPath(path_type=Path, dir_okay=False),
    help="The figure.  [default: clock.png, in the folder of a single run, else in the "
    "current one]",
)
def clock_command(
    folders: tuple[Path, ...], npr: float | None, output: Path | None
) -> None:
    """Fit the experiment's clock offset on completed runs of one shot.

    The offset makes R_b and L_b at all measured exposures fit best. A run must
    continue for some microseconds after the last exposure. Several RUNs, which may
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
