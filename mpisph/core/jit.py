"""How the numeric functions are compiled, and where the compiled code is kept.

Numba's cache looks only at the file in which a function stands: editing a function
that it calls in another file would still run the old code. So the cache folder is
named by a digest of all numeric sources, and a change there starts a fresh one. It is
set when this module is imported, before any function is compiled.

A full disk or a loss of power can leave half a file in the cache, which Numba would
fail on at every start. So what is damaged is removed on import, and is then compiled
again.
"""

import atexit
import hashlib
import importlib
import io
import json
import os
import pickle
import pickletools
import platform
import shutil
import stat
import string
import sys
import tempfile
import time
import zlib
from pathlib import Path

import llvmlite.binding
import numba

_BLAS = "scipy.linalg.cython_blas"


def load_without_blas() -> None:
    """Import what Numba loads before it first compiles, less what links to a BLAS.

    It would import scipy.linalg, in 0.24 s, to see whether `numpy.cov` can be compiled.
    """
    if _BLAS not in sys.modules:
        sys.modules[_BLAS] = None  # type: ignore[assignment]
        importlib.import_module("numba.np.arraymath")
        del sys.modules[_BLAS]


load_without_blas()

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be reordered within one particle's list: the list and its order are the
same on any number of ranks, so the bits are too. NaN and infinity keep their meaning:
an unstable run must be seen as one."""

INLINE = {
    "fastmath": FASTMATH,
    "error_model": "numpy",
    "forceinline": True,
}
"""Options of the pair loop and of the equations inside it.

A call would keep the compiler from vectorising the loop (80 ns a pair instead of 20).
And where the loop stood in a function of its own, a process that had compiled it and
one that had loaded it from the cache ran differently optimised copies, whose sums
differed in the last bit.
"""

ROUNDED = {**INLINE, "fastmath": FASTMATH - {"reassoc"}}
"""Options of an equation inside the pair loop that relies on how a sum is rounded."""

EXACT = {"error_model": "numpy"}
"""Options of everything else: IEEE arithmetic in the order written."""

NUMERIC_FOLDERS = ("core", "physics", "parallel", "sph", "diagnostics", "solver")
"""Folders of all that is compiled, or decides how. A change elsewhere, such as of a
report, asks for no compiling."""

ENTRY = {**EXACT, "forceinline": True}
"""Options of what is called with a tuple of arrays for each particle: not inlined, such
a call counts references to every array of it (350 ns instead of 15)."""

DIGITS = 16
"""Length of a digest's name."""


def numeric_sources() -> list[Path]:
    """Return the sources in `NUMERIC_FOLDERS`, sorted."""
    package = Path(__file__).parents[1]
    return sorted(p for name in NUMERIC_FOLDERS for p in (package / name).rglob("*.py"))


def source_digest() -> str:
    """Return a digest of the numeric sources and of the versions that compile."""
    digest = hashlib.sha256()
    for part in (numba.__version__, platform.python_version(), platform.machine()):
        digest.update(part.encode())
    for path in numeric_sources():
        digest.update(path.read_bytes())
    return digest.hexdigest()[:DIGITS]


def use_cache_folder() -> Path:
    """Point Numba's disk cache at the folder of these sources, and return it.

    Where the folder cannot be written, Numba would fall back to folders beside the
    sources, whose stamps see one file each, and could run an old equation. Then the
    process compiles into a folder of its own, which it removes when it ends.
    """
    base = os.environ.get("MPISPH_CACHE_DIR")
    if base is None:
        base = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
        base = str(Path(base) / "mpisph")
    folder = Path(base) / source_digest()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        tempfile.TemporaryFile(dir=folder).close()
        REMOVED.extend(remove_damaged(folder))
    except OSError:
        own = Path(tempfile.mkdtemp(prefix="mpisph-"))
        atexit.register(shutil.rmtree, own, ignore_errors=True)
        folder = own / folder.name
        folder.mkdir()
    numba.config.CACHE_DIR = str(folder)
    return folder


def source_stamp() -> str:
    """Return a digest of what makes Numba compile again although no source changed.

    That is the place of the sources, the times they were written, and the processor.
    """
    digest = hashlib.sha256(llvmlite.binding.get_host_cpu_name().encode())
    digest.update(llvmlite.binding.get_host_cpu_features().flatten().encode())
    for path in numeric_sources():
        found = path.stat()
        digest.update(f"{path} {found.st_mtime_ns} {found.st_size}\n".encode())
    return digest.hexdigest()[:DIGITS]


def is_compiled(form: str) -> bool:
    """Say whether the cache folder holds all that a run with a pair form calls."""
    return _mark(CACHE_FOLDER, form).exists()


def mark_compiled(form: str) -> None:
    """Take down that the cache folder holds all that such a run calls, and digests."""
    if numba.config.DISABLE_JIT:
        return
    contents = {name: _content(path) for name, path in _compiled(CACHE_FOLDER).items()}
    sums = {name: zlib.crc32(text) for name, text in contents.items() if text}
    CACHE_FOLDER.mkdir(parents=True, exist_ok=True)  # it may have been cleared
    part = tempfile.NamedTemporaryFile("w", dir=CACHE_FOLDER, delete=False)
    with part as file:
        json.dump(sums, file)
    Path(part.name).replace(_mark(CACHE_FOLDER, form))


def remove_damaged(folder: Path) -> list[Path]:
    """Remove damaged files of compiled code of these sources from a cache folder.

    The code of a function never changes once all is compiled; its index does where the
    function is compiled for further types. So a file that differs from what was taken
    down is damaged, except an index that can be read.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    list of Path
        Those that this process has removed; other ranks may look at the same time.

    Raises
    ------
    OSError
        If one cannot be removed.
    """
    marks, found = list(folder.glob(_mark(folder, "*").name)), _compiled(folder)
    known: dict[str, int] = {}
    for mark in marks:
        known |= _known_sums(mark)
    damaged = []
    for name, path in found.items():
        content = _content(path)
        if content and known.get(name) == zlib.crc32(content):
            continue
        if (name in known and path.suffix == ".nbc") or not _is_pickled(content):
            damaged.append(path)
    removed = []
    if damaged or known.keys() - found.keys():
        for mark in marks:  # what is missing is then compiled before a run
            mark.unlink(missing_ok=True)
    for path in damaged:
        try:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
            removed.append(path)
        except FileNotFoundError:  # another rank was faster
            continue
    return removed


def _compiled(folder: Path) -> dict[str, Path]:
    """Return the files of compiled code of these sources, by their name in a folder."""
    found = {}
    for source in sorted({path.parent for path in numeric_sources()}):
        # As Numba names the folder of a source's.
        name = f"{source.name}_{hashlib.sha1(str(source).encode()).hexdigest()}"
        for path in (folder / name).glob("*.nb[ci]"):
            found[f"{name}/{path.name}"] = path
    return found


def _content(path: Path) -> bytes | None:
    """Return the bytes of a regular file; None where it cannot be read."""
    try:
        return path.read_bytes() if stat.S_ISREG(path.stat().st_mode) else None
    except OSError:
        return None


def _is_pickled(content: bytes | None) -> bool:
    """Say whether bytes are whole pickles, as in Numba's files; it loads none."""
    if not content or not content.startswith(pickle.PROTO):
        return False
    stream = io.BytesIO(content)
    try:
        while stream.tell() < len(content):
            for _ in pickletools.genops(stream):
                pass
    except Exception:  # whatever it makes of garbage
        return False
    return True


def _known_sums(mark: Path) -> dict[str, int]:
    """Return the digests taken down; none where that file is missing or damaged."""
    try:
        found = json.loads(_content(mark) or b"")
    except ValueError:
        found = None
    if not isinstance(found, dict):
        mark.unlink(missing_ok=True)
        return {}
    return found


def _mark(folder: Path, form: str) -> Path:
    return folder / f"complete-{source_stamp()}-{form}"


def cache_size() -> int:
    """Return the size of the compiled code kept for these sources [bytes]."""
    return sum(path.stat().st_size for path in CACHE_FOLDER.rglob("*"))


def clear_cache() -> None:
    """Remove the compiled code of these and of all other sources."""
    for path in CACHE_FOLDER.parent.iterdir():
        if _is_digest(path.name):
            shutil.rmtree(path, ignore_errors=True)


IN_USE = 2 * 86400.0
"""Time from its start on in which a process is taken to need its folder [s]."""


def prune_cache(keep: int = 8) -> None:
    """Remove the cache folders of older sources but for the `keep` last used.

    Those that a process began to use within `IN_USE` stay too: it may still run, and
    compiles what it needs when it needs it.
    """
    digests = [path for path in CACHE_FOLDER.parent.iterdir() if _is_digest(path.name)]
    digests.sort(key=_last_used, reverse=True)
    for path in digests[keep:]:
        if path != CACHE_FOLDER and time.time() - _last_used(path) > IN_USE:
            shutil.rmtree(path, ignore_errors=True)


def _last_used(path: Path) -> float:
    return path.stat().st_mtime


def _is_digest(name: str) -> bool:
    return len(name) == DIGITS and set(name) <= set(string.hexdigits)


REMOVED: list[Path] = []
"""Damaged files of compiled code that this process has found and removed."""

CACHE_FOLDER = use_cache_folder()
