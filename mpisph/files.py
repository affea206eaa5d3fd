"""Files that appear whole or not at all."""

import os
from pathlib import Path


def replace_file(part: Path, path: Path) -> None:
    """Give the finished file `part` its name, surviving a loss of power.

    Parameters
    ----------
    part : Path
        A closed file beside `path`.
    path : Path
        The name it gets; what had that name is replaced.

    Raises
    ------
    OSError
        If the file cannot be brought to the disk or renamed.
    """
    sync(part)
    part.replace(path)
    sync(path.parent)


def write_text(path: Path, text: str) -> None:
    """Write a text file aside and rename it, so that no reader sees half of it.

    Parameters
    ----------
    path : Path
    text : str

    Raises
    ------
    OSError
        If the file cannot be written. What had the name is then unharmed.
    """
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8")
        replace_file(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk.

    Raises
    ------
    OSError
        If they cannot be brought there.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
