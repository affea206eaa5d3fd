"""Signals that come while the program loads, or while it ends.

A run that is asked to stop writes a checkpoint and returns 75. That must not depend on
the moment: a signal that comes before a run can answer it is held until then, and one
that comes after it, with the process about to end, changes nothing.
"""

import signal
from types import FrameType

SIGNALS = (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT)
"""Signals that ask a run to stop."""

held: list[int] = []
"""Those that have come and that nobody has answered, in their order."""


def hold_signals() -> None:
    """Keep the signals of this process for later; for the main thread."""
    for number in SIGNALS:
        signal.signal(number, _hold)


def release_signals() -> None:
    """Let signals that are held end this process, those that have come and others.

    Raises
    ------
    KeyboardInterrupt
        Now, or when a signal comes.
    """
    for number in SIGNALS:
        if signal.getsignal(number) is _hold:
            signal.signal(number, _end)
    if held:
        _end(held.pop(0), None)


def ignore_signals() -> None:
    """Let signals do nothing more; the interpreter leaves it so while it ends."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN)


def _hold(number: int, _: FrameType | None) -> None:
    held.append(number)


def _end(number: int, _: FrameType | None) -> None:
    """End what is being done; a second signal ends the process at once."""
    for each in SIGNALS:
        signal.signal(each, signal.SIG_DFL)
    held.append(number)
    raise KeyboardInterrupt
