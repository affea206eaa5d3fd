"""The folder that is named after a case or study file."""

from pathlib import Path

from mpisph.core.errors import CaseError, Problem
from mpisph.inputs.printing import printable

_LONGEST_SHOWN = 80


def folder_name(path: Path) -> str:
    """Return the name of a file without its ending, where a folder may be called so.

    Parameters
    ----------
    path : Path
        It need not exist.

    Raises
    ------
    CaseError
        If the name would leave the folder it is to lie in, hide there, be taken for an
        option, or steer a terminal.
    """
    name = path.stem
    if name and name[0] not in ".-" and name.isprintable():
        return name
    shown = printable(name, _LONGEST_SHOWN)
    text = (
        f"'{shown}' cannot be the name of a folder; rename the file so that its name "
        "begins with a letter or a digit and has no control characters"
    )
    raise CaseError([Problem(text, file=printable(str(path), _LONGEST_SHOWN))])
