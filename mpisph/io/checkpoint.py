"""Checkpoints: all that the next step depends on, bit by bit.

A checkpoint is an HDF5 file with every field of every particle in id order, whatever
the number of ranks, and the state of the run as JSON. Its first 512 bytes, HDF5's user
block, are a line of text with a SHA-256 digest of all that follows: a file that was cut
short or altered anywhere is recognised before HDF5 reads it.
"""

import errno
import hashlib
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import NamedTuple

import h5py
import numpy as np
from mpi4py import MPI

from mpisph.core.errors import MpisphError
from mpisph.core.particles import FIELDS, Particles
from mpisph.io.particle_file import (
    FileLayout,
    field_column,
    row_bytes,
    store_text,
    stored_text,
    write_particle_file,
)
from mpisph.parallel.collectives import caught, from_root, on_root, raise_together
from mpisph.parallel.redistribution import block_starts

CHECKPOINTS_FOLDER = "checkpoints"

KEPT = 2
"""Number of checkpoints kept: the last, and the one before it."""

FORMAT = 1
"""Number of the file format."""

_GROUP = "particles"
_COLUMNS = tuple(field_column(field) for field in FIELDS)
_HEADER = 512
# Size of the user block [bytes].
_CHUNK = 2**23
# Bytes that are hashed at a time. Chunks are dealt to the ranks.

PARTICLE_BYTES = row_bytes(_COLUMNS)
"""Size of a particle in a checkpoint [bytes]."""


class DamagedError(MpisphError):
    """A checkpoint that is not what was written."""


class Checkpoint(NamedTuple):
    """What a checkpoint holds.

    Attributes
    ----------
    particles : Particles
        A block of ids, the rank's share of all.
    n_total : int
        Number of particles on all ranks.
    state : str
        The text that was given.
    """

    particles: Particles
    n_total: int
    state: str


def write_checkpoint(
    comm: MPI.Intracomm,
    folder: Path,
    step: int,
    particles: Particles,
    n_total: int,
    state: str,
) -> Path:
    """Write ``checkpoints/checkpoint_<step>.h5``, and remove all but the last `KEPT`.

    Parameters
    ----------
    comm : MPI.Intracomm
    folder : Path
        Folder of the run; it must exist.
    step : int
        Steps made.
    particles : Particles
        Owned particles in any order; any rank may own none.
    n_total : int
        Their number on all ranks; their ids run from 0 to ``n_total - 1``.
    state : str
        The run's state; that of rank 0 is written.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        On all ranks, if any rank cannot write. Earlier checkpoints are then unharmed,
        and no partial file is left.
    """
    path = folder / CHECKPOINTS_FOLDER / f"checkpoint_{step:09d}.h5"
    write_rest = partial(_write_state, state)
    layout = FileLayout("checkpoint", _GROUP, _COLUMNS, write_rest, _HEADER)
    write_particle_file(
        comm, path, particles, n_total, layout, seal=partial(_seal, comm)
    )
    on_root(comm, lambda: _prune(path))
    return path


def find_checkpoints(folder: Path) -> list[Path]:
    """Return the checkpoints in the folder of a run, the last one first."""
    return sorted((folder / CHECKPOINTS_FOLDER).glob("checkpoint_*.h5"), reverse=True)


def read_checkpoint(comm: MPI.Intracomm, path: Path) -> Checkpoint:
    """Check and read a checkpoint, whatever the number of ranks that wrote it.

    Parameters
    ----------
    comm : MPI.Intracomm
    path : Path

    Returns
    -------
    Checkpoint
        With this rank's share of the particles.

    Raises
    ------
    DamagedError
        On all ranks, if the file is not what was written, byte by byte.
    OSError
        On all ranks, if it cannot be read.
    """
    on_root(comm, lambda: _check_kind(path))
    digest = _digest(comm, path)
    on_root(comm, lambda: _check_header(path, digest))
    found: list[Checkpoint] = []
    raise_together(comm, caught(lambda: found.append(_read_block(comm, path))))
    return found[0]


def read_state(path: Path) -> str:
    """Return the text in a checkpoint, without looking at the rest of the file.

    Raises
    ------
    DamagedError
        If there is none.
    OSError
        If the file cannot be read.
    """
    _check_kind(path)
    try:
        with h5py.File(path, "r") as file:
            return stored_text(file, "state")
    except (KeyError, ValueError, TypeError, RuntimeError) as error:
        raise DamagedError(f"{path}: no checkpoint") from error


def _check_kind(path: Path) -> None:
    """Raise where a name is that of a folder or a pipe, or of a link that is broken."""
    is_name = path.is_symlink() or path.exists()
    if is_name and not path.is_file():
        raise DamagedError(f"{path}: is no file")


def _write_state(state: str, file: h5py.File, _: int) -> None:
    store_text(file, "state", state)


def _seal(comm: MPI.Intracomm, part: Path) -> None:
    """Write the digest of a finished file into its user block."""
    digest = _digest(comm, part)

    def write() -> None:
        with part.open("r+b") as file:
            file.write(_header(digest))

    on_root(comm, write)


def _header(digest: str) -> bytes:
    """Return what the user block of a sound file holds."""
    line = f"mpisph checkpoint, format {FORMAT}, sha256 {digest}\n"
    return line.encode().ljust(_HEADER, b"\0")


def _check_header(path: Path, digest: str) -> None:
    """Raise where the user block is not that of a file with this digest."""
    with path.open("rb") as file:
        header = file.read(_HEADER)
    if header != _header(digest):
        raise DamagedError(f"{path}: damaged; it is not what was written")


def _digest(comm: MPI.Intracomm, path: Path) -> str:
    """Return the digest of all that follows the user block: of its chunks' digests."""
    mine: list[bytes] = []
    # Another machine may not yet know the size of a file that was just written.
    content = max(from_root(comm, lambda: path.stat().st_size) - _HEADER, 0)
    chunks = block_starts(-(-content // _CHUNK), comm.size)
    first, end = chunks[comm.rank : comm.rank + 2].tolist()

    def hash_chunks() -> None:
        with path.open("rb") as file:
            file.seek(_HEADER + first * _CHUNK)
            for k in range(first, end):
                chunk = file.read(_CHUNK)
                if len(chunk) < min(_CHUNK, content - k * _CHUNK):
                    raise OSError(errno.EIO, "cut short while it is read", str(path))
                mine.append(hashlib.sha256(chunk).digest())

    raise_together(comm, caught(hash_chunks))
    parts = comm.allgather(b"".join(mine))
    return hashlib.sha256(b"".join(parts)).hexdigest()


def _read_block(comm: MPI.Intracomm, path: Path) -> Checkpoint:
    """Read this rank's share of the rows."""
    try:
        with h5py.File(path, "r") as file:
            state = stored_text(file, "state")
            group = file[_GROUP]
            n_total = int(group["id"].shape[0])
            first, end = block_starts(n_total, comm.size)[comm.rank : comm.rank + 2]
            particles = Particles.zeros(int(end - first))
            for column in _COLUMNS:
                getattr(particles, column.name)[:] = group[column.name][first:end]
    except (KeyError, ValueError, TypeError) as error:
        raise MpisphError(f"{path}: written by another version of mpisph") from error
    if not np.array_equal(particles.id, np.arange(first, end)):
        raise MpisphError(f"{path}: its particles are not in the order of their ids")
    return Checkpoint(particles, n_total, state)


def _prune(newest: Path) -> None:
    """Remove all but the newest checkpoint and the last ones before it."""
    earlier = [path for path in find_checkpoints(newest.parents[1]) if path < newest]
    for path in earlier[KEPT - 1 :]:
        with suppress(OSError):  # the new one is good all the same
            path.unlink()


def keep_last_checkpoint(folder: Path) -> None:
    """Remove all checkpoints but the last, as far as that is possible.

    Call it on rank 0.
    """
    last = next((path for path in find_checkpoints(folder) if path.is_file()), None)
    for path in (folder / CHECKPOINTS_FOLDER).glob("checkpoint_*"):
        if path != last:
            with suppress(OSError):
                path.unlink()


def remove_checkpoints(folder: Path) -> None:
    """Remove the checkpoints in the folder of a run; call it on rank 0.

    Raises
    ------
    OSError
        If one cannot be removed.
    """
    place = folder / CHECKPOINTS_FOLDER
    for path in place.glob("checkpoint_*"):
        if path.is_symlink() or not path.is_dir():
            path.unlink()
    with suppress(OSError):  # other files in it, or a link instead of a folder
        place.rmdir()
