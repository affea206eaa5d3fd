"""Exit codes, and the options and arguments that several commands share."""

import re
from pathlib import Path
from typing import Any

import click

import mpisph

BAD_INPUT = 2
UNSTABLE = 3
STOPPED = 75
"""The code EX_TEMPFAIL of sysexits.h: try again later."""

_DURATION = re.compile(r"(?:(\d+)d)?(?:(\d+)h)?(?:(\d+)m(?:in)?)?(?:(\d+)s)?")
_CLOCK = re.compile(r"(?:(\d+)-)?(\d+):(\d\d):(\d\d)")


class OutputPath(click.Path):
    """Where a command writes: a name that is not empty and fits on a line."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        """Return the path."""
        if not str(value) or not str(value).isprintable():
            self.fail("expected a name without control characters", param, ctx)
        return super().convert(value, param, ctx)


set_option = click.option(
    "--set",
    "overrides",
    metavar="KEY=VALUE",
    multiple=True,
    help="Override a key of the case, such as --set resolution.npr=20 (repeatable).",
)


def duration(
    _: click.Context, option: click.Parameter, text: str | None
) -> float | None:
    """Return a duration such as ``3h50m`` or ``1-12:00:00`` in seconds."""
    if text is None:
        return None
    found = _DURATION.fullmatch(text) or _CLOCK.fullmatch(text)
    days, hours, minutes, seconds = (
        (int(x or 0) for x in found.groups()) if found else (0,) * 4
    )
    total = seconds + 60 * (minutes + 60 * (hours + 24 * days))
    if total <= 0:
        wanted = "expected a duration such as 3h50m, 90s or 1-12:00:00"
        raise click.BadParameter(f"{text!r}: {wanted}", param=option)
    return float(total)


walltime_option = click.option(
    "--walltime",
    metavar="DURATION",
    callback=duration,
    help="Time that the program may take, such as 3h50m: before it is up, a run writes "
    "a checkpoint and stops.",
)
runs_argument = click.argument(
    "folders",
    metavar="RUN...",
    nargs=-1,
    required=True,
    type=click.Path(path_type=Path),
)


def shipped(name: str) -> Path:
    """Return a file of the folder ``cases`` that comes with the sources.

    Raises
    ------
    click.UsageError
        If the package was installed without them.
    """
    path = Path(mpisph.__file__).parents[1] / "cases" / name
    if not path.exists():
        raise click.UsageError(f"no {name} beside the package: name a file")
    return path
