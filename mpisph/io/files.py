"""Files that appear whole or not at all, and files that grow line by line."""

import errno
import os
import stat
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self


class LineFile:
    """A text file to which whole lines are added, to be followed while it grows.

    Parameters
    ----------
    path : Path or None
        None for a rank that writes nothing.

    Raises
    ------
    OSError
        If the file cannot be opened.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._descriptor = -1
        if path is not None:
            flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
            self._descriptor = os.open(path, flags, 0o666)

    def __enter__(self) -> Self:
        """Return the file itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the file."""
        self.close()

    def write(self, text: str) -> None:
        """Add a text that ends with the end of a line.

        Raises
        ------
        OSError
            If it cannot be written; the error names the file.
        """
        rest = text.encode("utf-8")
        while self._path is not None and rest:
            with naming(self._path):
                rest = rest[os.write(self._descriptor, rest) :]

    def save(self) -> int:
        """Bring all lines to the disk and return their size [bytes]; 0 without a file.

        Raises
        ------
        OSError
            If they cannot be brought there.
        """
        if self._path is None:
            return 0
        with naming(self._path):
            os.fsync(self._descriptor)
        return os.fstat(self._descriptor).st_size

    def close(self) -> None:
        """Close the file; a second call does nothing."""
        if self._path is not None:
            os.close(self._descriptor)
            self._path = None


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Return a context whose errors of the file system name a file.

    The system names a file that cannot be opened, but not one that cannot be written.
    """
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno is not None:
            error.filename = str(path)
        raise


def read_text(path: Path) -> str:
    """Return the text of a file.

    Raises
    ------
    OSError
        If it cannot be read, or is no file: a pipe would keep its reader for ever.
    ValueError
        If it is no UTF-8.
    """
    check_regular(path)
    return path.read_text(encoding="utf-8")


def check_regular(path: Path) -> None:
    """Raise where a name is not that of a file, but of a folder or a pipe.

    Raises
    ------
    OSError
        Also where there is nothing, as behind a link that leads nowhere.
    """
    if not stat.S_ISREG(path.stat().st_mode):
        raise OSError(errno.EINVAL, "is not a file", str(path))


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
    """Write a text file, in UTF-8; see `write_bytes`.

    Parameters
    ----------
    path : Path
    text : str

    Raises
    ------
    OSError
        If the file cannot be written. What had the name is then unharmed.
    """
    write_bytes(path, text.encode("utf-8"))


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file aside and rename it, so that no reader sees half of it.

    Parameters
    ----------
    path : Path
    content : bytes

    Raises
    ------
    OSError
        If the file cannot be written. What had the name is then unharmed.
    """
    # Several processes and threads may write one file: none into the part of another.
    who = f"{os.uname().nodename}-{os.getpid()}-{threading.get_ident()}"
    part = path.with_name(f"{path.name}.{who}.part")
    try:
        with naming(path), part.open("xb") as file:
            file.write(content)
        replace_file(part, path)
    except OSError:
        part.unlink(missing_ok=True)
        raise


def set_aside(path: Path) -> Path:
    """Rename a damaged file, so that it is not taken for a sound one.

    Parameters
    ----------
    path : Path
        It may be a folder or a link that leads nowhere.

    Returns
    -------
    Path
        Its new name.

    Raises
    ------
    OSError
        If it cannot be renamed.
    """
    aside = path.with_name(f"{path.name}.damaged")
    while os.path.lexists(aside):
        aside = aside.with_name(f"{aside.name}.damaged")
    return path.replace(aside)


def sync(path: Path) -> None:
    """Wait until a file, or the names in a folder, are on the disk.

    Raises
    ------
    OSError
        If they cannot be brought there.
    """
    descriptor = os.open(path, os.O_RDONLY)
    try:
        with naming(path):
            os.fsync(descriptor)
    finally:
        os.close(descriptor)
