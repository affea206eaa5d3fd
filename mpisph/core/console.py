"""Consoles that know whether a person looks on."""

import os

from rich.console import Console

_LAUNCHERS = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "PMIX_RANK", "SLURM_PROCID")


def open_console(stderr: bool) -> Console:
    """Return a console on a standard stream that knows whether a person looks on.

    A launcher such as Open MPI's gives its ranks a pseudo-terminal as standard output
    even where its own goes to a file, and a pipe as standard error even on a desk. So
    below a launcher the launcher's own stream decides.

    Parameters
    ----------
    stderr : bool
        The standard error instead of the standard output.

    Returns
    -------
    rich.console.Console
        Plain and 100 wide where no person looks on.
    """
    console = Console(stderr=stderr)
    person = console.is_terminal
    if any(name in os.environ for name in _LAUNCHERS):
        person = _is_terminal_of_parent(2 if stderr else 1)
    elif person:
        return console
    return Console(stderr=stderr, force_terminal=person, width=100)


def _is_terminal_of_parent(descriptor: int) -> bool:
    """Say whether the parent process, the launcher, writes to a terminal."""
    try:
        target = os.readlink(f"/proc/{os.getppid()}/fd/{descriptor}")
    except OSError:  # another system, or a launcher on another machine
        return False
    return target.startswith(("/dev/pts/", "/dev/tty"))
