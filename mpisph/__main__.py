"""The program: ``mpisph``, or ``python -m mpisph``."""

import gc
import os
import sys
import warnings

from mpisph.core.held_signals import hold_signals
from mpisph.core.launcher import step_without_mpi


def main() -> None:
    """Run the command line, or say that there is no MPI to run it with."""
    hold_signals()
    # A start makes what stays: to look for garbage after 700 objects takes 0.1 s.
    gc.set_threshold(50_000, *gc.get_threshold()[1:])
    text = step_without_mpi(os.environ)
    if text is not None:
        sys.stderr.write(f"mpisph: {text}\n" * bool(text))
        sys.exit(2)
    # mpisph says the same, once and for people: see `launcher`.
    warnings.filterwarnings("ignore", "suspicious MPI execution environment")
    try:
        from mpi4py import MPI  # noqa: F401  it loads the library
    except (ImportError, RuntimeError) as error:
        reason = str(error).strip().replace("\n", "; ")
        sys.exit(f"mpisph: no MPI library could be loaded: {reason}")
    from mpisph.cli import main as cli

    cli.main()


if __name__ == "__main__":
    main()
