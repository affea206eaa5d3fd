"""The program: all commands, and what happens to their errors.

Every rank runs the same commands; rank 0 alone prints. Exit codes: 0 done, 2 bad input,
3 unstable run, 75 stopped and to be continued, 128 + N ended by signal N where there is
no run to stop, 1 anything else. An error that one rank
meets alone, and the death of a rank, end all.
"""

import os
import signal
import sys
from typing import NoReturn

import click
from mpi4py import MPI

from mpisph import __version__
from mpisph.cli import assess, limit, machine, post, prepare, run, study, verify, view
from mpisph.cli.options import BAD_INPUT
from mpisph.core.errors import (
    CollectiveError,
    InputError,
    MpisphError,
    os_error_text,
)
from mpisph.core.held_signals import held, ignore_signals, release_signals
from mpisph.core.jit import CACHE_FOLDER, REMOVED
from mpisph.core.launcher import banner_follows, launch_of, mismatch
from mpisph.run.signals import SignalHandler


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="mpisph")
@click.pass_context
def cli(context: click.Context) -> None:
    """Axisymmetric SPH for hypervelocity impact; mpirun starts it on many ranks."""
    if context.invoked_subcommand not in {"run", "resume", "study", "assess"}:
        release_signals()


for command in (
    run.run_command,
    run.resume_command,
    run.status_command,
    post.figures_command,
    post.report_command,
    post.animate_command,
    view.view_command,
    post.clock_command,
    verify.verify_command,
    machine.bench_command,
    machine.scaling_command,
    machine.cache_group,
    prepare.init_command,
    prepare.materials_command,
    prepare.schema_command,
    study.study_group,
    assess.assess_command,
    limit.limit_command,
):
    cli.add_command(command)


def main() -> NoReturn:
    """Run the command line; the entry point of ``mpisph``."""
    signals = SignalHandler()
    sys.excepthook = signals.end_all_ranks
    first = MPI.COMM_WORLD.rank == 0
    launch = launch_of(os.environ)
    text = mismatch(launch, MPI.COMM_WORLD.size, MPI.Get_library_version())
    if text is not None:
        if launch and launch.rank == 0:
            click.echo(f"mpisph: {text}", err=True)
        sys.exit(BAD_INPUT)
    if REMOVED:
        click.echo(
            f"mpisph: compiled code in {CACHE_FOLDER} was damaged; removed "
            f"{', '.join(path.name for path in REMOVED)}, to be compiled again",
            err=True,
        )
    if not first:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")
    code = _run(signals, first)
    if code and first and banner_follows(os.environ):
        click.echo("(mpirun adds a banner; `mpirun --quiet` leaves it out)", err=True)
    ignore_signals()
    sys.exit(code)


def _run(signals: SignalHandler, first: bool) -> int:
    """Run the command line and return its exit code, the same on all ranks."""
    try:
        code = cli.main(prog_name="mpisph", standalone_mode=False, obj=signals)
    except click.exceptions.Abort as error:  # a signal, where no run catches it
        if isinstance(error.__cause__, EOFError):  # click takes it for Ctrl-D
            raise error.__cause__ from None
        number = signal.Signals(held[-1] if held else signal.SIGINT)
        click.echo(f"mpisph: interrupted ({number.name})", err=True)
        if MPI.COMM_WORLD.size > 1:  # the others may know of nothing
            MPI.COMM_WORLD.Abort(128 + number)
        return 128 + number
    except click.ClickException as error:
        if first:
            error.show()
        return error.exit_code
    except (MpisphError, CollectiveError) as error:
        if first:
            text = os_error_text(error) if isinstance(error, OSError) else error
            notes = getattr(error, "__notes__", ())
            click.echo("\n".join((f"mpisph: {text}", *notes)), err=True)
        return BAD_INPUT if isinstance(error, InputError) else 1
    return code if isinstance(code, int) else 0
