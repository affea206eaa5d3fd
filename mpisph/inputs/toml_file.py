"""Reading a TOML file, with its mistakes named by their place."""

from __future__ import annotations

import os
import re
import stat
import tomllib
from pathlib import Path
from typing import Any

from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.findings import BEYOND_64_BITS
from mpisph.inputs.printing import printable
from mpisph.inputs.spelling import nearest
from mpisph.inputs.toml_lines import deep_line

_LARGEST_FILE = 1_000_000
_LONGEST_SHOWN = 80

_TOO_DEEP = "arrays, tables or keys are nested too deeply"

# What Python does not convert, for it takes a time that grows as the square.
_LONG_INTEGER = re.compile(r"[0-9_]{4300}")

_TOML_PLACE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Return the text of a TOML file, and what it says.

    Parameters
    ----------
    path : Path

    Raises
    ------
    CaseError
        If the file cannot be read or is no TOML.
    """
    text = _read(path)
    return text, _parse(text, str(path))


def _read(path: Path) -> str:
    try:
        # A pipe would keep its reader for ever, a device would have no end.
        with open(path, "rb", opener=_open_at_once) as file:
            kind = os.fstat(file.fileno()).st_mode
            if not stat.S_ISREG(kind):
                text = "is no regular file; expected a TOML file"
                raise CaseError([Problem(text, file=str(path))])
            content = file.read(_LARGEST_FILE + 1)
    except FileNotFoundError:
        raise CaseError([_missing_file(path)]) from None
    except IsADirectoryError:
        problem = Problem("is a directory; expected a TOML file", file=str(path))
        raise CaseError([problem]) from None
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        problem = Problem(f"cannot be read: {reason}", file=str(path))
        raise CaseError([problem]) from None
    if len(content) > _LARGEST_FILE:
        text = f"is larger than {_LARGEST_FILE} bytes; expected a TOML file"
        raise CaseError([Problem(text, file=str(path))])
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        problem = Problem(
            f"byte 0x{content[error.start]:02x} is no UTF-8; save the file as UTF-8",
            file=str(path),
            line=line,
        )
        raise CaseError([problem]) from None


def _open_at_once(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK)


def _missing_file(path: Path) -> Problem:
    others: list[str] = []
    if path.parent.is_dir():
        others = [other.name for other in path.parent.glob("*.toml")]
    guess = nearest(path.name, others)
    suggestion = str(path.with_name(guess)) if guess else None
    return Problem("no such file", file=str(path), suggestion=suggestion)


def _parse(text: str, file: str) -> dict[str, Any]:
    line = deep_line(text)
    if line is not None:
        raise CaseError([Problem(_TOO_DEEP, file=file, line=line)])
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise CaseError([_syntax_problem(str(error), text, file)]) from None
    except RecursionError:  # of a text that is no TOML, which `deep_line` forgives
        raise CaseError([Problem(_TOO_DEEP, file=file)]) from None
    except ValueError:
        raise CaseError([_long_integer(text, file)]) from None


def _long_integer(text: str, file: str) -> Problem:
    place = _LONG_INTEGER.search(text)
    line = text.count("\n", 0, place.start()) + 1 if place else None
    return Problem(BEYOND_64_BITS, file=file, line=line)


def _syntax_problem(message: str, text: str, file: str) -> Problem:
    """Return the problem of a TOML syntax error, with the line as its value."""
    place = _TOML_PLACE.search(message)
    reason = _TOML_PLACE.sub("", message)
    reason = reason[:1].lower() + reason[1:]
    lines = text.removesuffix("\n").split("\n")
    number, column = len(lines), None
    if place is not None and place.group(1):
        number, column = int(place.group(1)), place.group(2)
    number = min(number, len(lines))
    shown = printable(lines[number - 1].strip(), _LONGEST_SHOWN)
    where = f" at column {column}" if column else " at the end of the file"
    return Problem(
        f"this is not valid TOML: {printable(reason, _LONGEST_SHOWN)}{where}",
        file=file,
        line=number,
        value=f"`{shown}`" if shown else None,
    )
