"""The exceptions that mpisph raises for people to read."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

__all__ = [
    "CaseError",
    "CollectiveError",
    "InputError",
    "MpisphError",
    "Problem",
    "UnstableError",
    "os_error_text",
]


class MpisphError(Exception):
    """Base of every error that is reported to the user without a traceback."""


class InputError(MpisphError):
    """What the user has named is not there, or is not what it should be."""


class CollectiveError(OSError):
    """An error of the file system that every rank of a run raises.

    Any other OSError may have met one rank alone, which must then end the others.
    """


def os_error_text(error: OSError) -> str:
    """Return an error of the file system for people: what, and where."""
    place = "" if error.filename is None else f": {error.filename}"
    return f"{error.strerror or error}{place}"


@dataclass(frozen=True)
class Problem:
    """One mistake in a case file, in a material card or in an override.

    Attributes
    ----------
    expected : str
        What is wrong and what was expected, as a phrase.
    file : str or None
        The file, or the override as the user typed it (``--set time.end=1``).
    line : int or None
        Line in the file, counted from 1.
    key : str
        Dotted key, such as ``bodies.0.radius``; empty where none is meant.
    value : str or None
        The offending value as it would be written in TOML.
    suggestion : str or None
        What the user probably meant.
    """

    expected: str
    file: str | None = None
    line: int | None = None
    key: str = ""
    value: str | None = None
    suggestion: str | None = None

    def __str__(self) -> str:
        """Return the problem on one line: place, key, value, expectation, hint."""
        place = self.file or ""
        if self.line is not None:
            place = f"{place}:{self.line}" if place else f"line {self.line}"
        subject = self.key
        if self.value is not None:
            subject = f"{subject} = {self.value}" if subject else self.value
        text = ": ".join(part for part in (place, subject, self.expected) if part)
        if self.suggestion is not None:
            text += f"; did you mean {self.suggestion}?"
        return text


class CaseError(InputError):
    """A case that cannot be run, with all of its problems.

    Parameters
    ----------
    problems : sequence of Problem
        Every problem found, in the order in which they are to be shown.
    """

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems: list[Problem] = list(problems)
        # The arguments go to Exception unchanged, so that the error can be
        # pickled and sent from one rank to the others.
        super().__init__(self.problems)

    def __str__(self) -> str:
        """Return all problems, one a line."""
        if len(self.problems) == 1:
            return str(self.problems[0])
        lines = [f"{len(self.problems)} problems:"]
        lines += [f"  {problem}" for problem in self.problems]
        return "\n".join(lines)


class UnstableError(MpisphError):
    """A run that broke down: its state passed one of the case's limits.

    Parameters
    ----------
    reason : str
        Short name of the limit, such as ``energy_drift``.
    step : int
        Step at which the breakdown was noticed.
    time : float
        Time of that step [s].
    particle : int or None
        Id of the offending particle, where there is one.
    detail : str
        The figures, as a sentence for the user.
    """

    def __init__(
        self, reason: str, step: int, time: float, particle: int | None, detail: str
    ) -> None:
        self.reason = reason
        self.step = step
        self.time = time
        self.particle = particle
        self.detail = detail
        super().__init__(reason, step, time, particle, detail)

    def __str__(self) -> str:
        """Return the breakdown as one line."""
        where = f"step {self.step}, t = {1e6 * self.time:.4f} µs"
        if self.particle is not None:
            where += f", particle {self.particle}"
        return f"unstable ({self.reason}) at {where}: {self.detail}"
