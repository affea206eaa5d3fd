"""The command that lets one look into runs in a browser."""

import os
import sys
import webbrowser
from collections.abc import Sequence
from pathlib import Path

import click
from mpi4py import MPI

from mpisph.cli.options import OutputPath, runs_argument
from mpisph.cli.post import Ranges, field_options
from mpisph.core.errors import InputError
from mpisph.figures.fields import Chosen, choose_fields
from mpisph.parallel.collectives import on_root


@click.command("view")
@runs_argument
@field_options
@click.option(
    "-o",
    "--output",
    type=OutputPath(path_type=Path, dir_okay=False),
    help="The page.  [default: view.html in the folder RUN; in the current folder "
    "where there are several]",
)
@click.option(
    "--particles",
    "most",
    type=click.IntRange(min=1),
    help="Particles of a run that are shown at most; of larger runs some are chosen by "
    "chance.  [default: 100000]",
)
@click.option(
    "--serve",
    is_flag=True,
    help="Serve the page to browsers on this machine until Ctrl-C; it follows runs "
    "under way.",
)
@click.option(
    "--port",
    type=click.IntRange(1, 65535),
    help="Of --serve.  [default: a free one]",
)
@click.option("--no-browser", is_flag=True, help="Print where the page is, no more.")
def view_command(
    folders: tuple[Path, ...],
    fields: tuple[str, ...],
    ranges: Ranges,
    output: Path | None,
    most: int | None,
    serve: bool,
    port: int | None,
    no_browser: bool,
) -> None:
    """Play the runs in folders in a browser, side by side on one clock.

    One page shows the particles by field, with sliders for time and colours, their
    values under the pointer, and R_b and L_b. It is a file of its own that needs no
    network. Where there is a screen, a browser opens it.
    """
    from mpisph.viewer.data import MOST_PARTICLES
    from mpisph.viewer.page import VIEW_FILE, write_view

    if port is not None and not serve:
        raise InputError("--port: is for --serve")
    if serve and output is not None:
        raise InputError("--output: --serve writes no file")
    chosen, most = choose_fields(fields, ranges), most or MOST_PARTICLES
    if serve:
        on_root(
            MPI.COMM_WORLD, lambda: _serve(folders, port or 0, chosen, most, no_browser)
        )
        return
    out = output or (folders[0] if len(folders) == 1 else Path()) / VIEW_FILE

    def write() -> None:
        for note in write_view(folders, out, chosen, most):
            click.echo(note, err=True)
        click.echo(out)
        if not no_browser:
            _open(out.resolve().as_uri())

    on_root(MPI.COMM_WORLD, write)


def _serve(
    folders: tuple[Path, ...],
    port: int,
    chosen: Sequence[Chosen],
    most: int,
    no_browser: bool,
) -> None:
    """Serve the page until Ctrl-C."""
    from mpisph.viewer.serve import HOST, make_server

    with make_server(folders, port, chosen, most) as server:
        url = f"http://{HOST}:{server.server_address[1]}/"
        click.echo(f"{url} until Ctrl-C")
        sys.stdout.flush()
        if not no_browser:
            _open(url)
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            click.echo("ended", err=True)


def _open(url: str) -> None:
    """Open a page where there is a screen; not in a terminal's own browser."""
    screens = {"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()
    if screens or sys.platform in {"darwin", "win32"}:
        webbrowser.open(url)
