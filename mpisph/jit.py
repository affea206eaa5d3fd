"""How the numeric functions are compiled, and where the compiled code is kept.

Numba's cache looks only at the file in which a function stands: editing a function
that it calls in another file would still run the old code. So the cache folder is
named by a digest of all sources, and a change anywhere starts a fresh one. It is set
when this module is imported, before any function is compiled.
"""

import hashlib
import os
import platform
from pathlib import Path

import numba

FASTMATH = {"reassoc", "contract", "arcp", "nsz"}
"""Sums may be reordered within one particle's list: the list and its order are the
same on any number of ranks, so the bits are too. NaN and infinity keep their meaning:
an unstable run must be seen as one."""

INLINE = {
    "cache": True,
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

EXACT = {"cache": True, "error_model": "numpy"}
"""Options of everything else: IEEE arithmetic in the order written."""


def source_digest() -> str:
    """Return a digest of all of mpisph's sources and of the versions that compile."""
    digest = hashlib.sha256()
    for part in (numba.__version__, platform.python_version(), platform.machine()):
        digest.update(part.encode())
    for path in sorted(Path(__file__).parent.rglob("*.py")):
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def use_cache_folder() -> Path:
    """Point Numba's disk cache at the folder of these sources, and return it."""
    base = os.environ.get("MPISPH_CACHE_DIR")
    if base is None:
        base = os.environ.get("XDG_CACHE_HOME", str(Path.home() / ".cache"))
        base = str(Path(base) / "mpisph")
    folder = Path(base) / source_digest()
    numba.config.CACHE_DIR = str(folder)
    return folder


CACHE_FOLDER = use_cache_folder()
