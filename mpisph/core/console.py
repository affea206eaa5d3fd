"""Consoles for people: a bar and colours on a terminal, plain lines elsewhere."""

import os

from rich.console import Console

from mpisph.core.launcher import launch_of

WIDTH = 100
"""Width of plain text [characters]."""


def open_console(stderr: bool) -> Console:
    """Return a console on a standard stream.

    A launcher such as Open MPI's gives its ranks a pseudo-terminal as standard output
    even where its own goes to a file. So below a launcher a console is plain, unless
    ``TTY_COMPATIBLE=1`` says otherwise, as `scripts/run` does on a terminal.

    Parameters
    ----------
    stderr : bool
        The standard error instead of the standard output.

    Returns
    -------
    rich.console.Console
        Plain and `WIDTH` wide where there is no terminal.
    """
    console = Console(stderr=stderr)
    if launch_of(os.environ):
        terminal = os.environ.get("TTY_COMPATIBLE") == "1"
        return Console(stderr=stderr, force_terminal=terminal, width=WIDTH)
    return console if console.is_terminal else Console(stderr=stderr, width=WIDTH)
