"""HDF5 files with one row per particle, the same for any number of ranks.

Rows are in id order, in whole columns. A file is written aside, brought to the disk and
renamed, so that what bears its name is complete.
"""

import errno
import io
import os
import secrets
import signal
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any, Literal, NamedTuple

import h5py
import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from mpisph.core.particles import Field, Particles
from mpisph.io.files import replace_file
from mpisph.parallel.collectives import caught, on_root, raise_together
from mpisph.parallel.redistribution import by_id_blocks, gather_all

Writer = Literal["auto", "parallel", "gather"]

LONGEST_NAME = 240
"""Bytes of a file's name that every MPI takes; Open MPI 4.1 aborts with 250."""

CLOSING_TIME = 3
"""How long closing a file may take after an error [s]."""

_RESERVE = 2**20
# Room for what a file holds besides columns [bytes].


class Block(NamedTuple):
    """The particles that one process writes, from row `offset` of `n_total`.

    Only the block of the last process is `last`; it may hold no particle.
    """

    particles: Particles
    offset: int
    n_total: int
    last: bool


class Column(NamedTuple):
    """One dataset with a row per particle.

    Attributes
    ----------
    name : str
        Below the layout's group.
    dtype : str
    width : int
        Numbers in a row.
    symbol, unit, meaning : str
        Its attributes in the file.
    rows : callable
        Returns a block's rows.
    closed : bool, optional
        Whether the column has a row more than there are particles, which the last
        block holds.
    """

    name: str
    dtype: str
    width: int
    symbol: str
    unit: str
    meaning: str
    rows: Callable[[Block], npt.NDArray[Any]]
    closed: bool = False


class FileLayout(NamedTuple):
    """What a kind of file holds.

    Attributes
    ----------
    what : str
        Name of the kind, for people.
    group : str
        Group of the columns.
    columns : sequence of Column
    write_rest : callable
        Writes everything but the columns into the open file, given the number of
        rows; called on rank 0.
    user_block : int, optional
        Bytes that HDF5 leaves alone at the beginning: 0, or a power of two from 512 on.
    """

    what: str
    group: str
    columns: Sequence[Column]
    write_rest: Callable[[h5py.File, int], None]
    user_block: int = 0


def write_particle_file(
    comm: MPI.Intracomm,
    path: Path,
    particles: Particles,
    n_total: int,
    layout: FileLayout,
    *,
    writer: Writer = "auto",
    seal: Callable[[Path], None] | None = None,
) -> None:
    """Write the particles of all ranks into one file.

    Parameters
    ----------
    comm : MPI.Intracomm
    path : Path
        The file gets this name only when it is complete and on the disk. Its folder is
        made where missing, but not the folder above.
    particles : Particles
        Owned particles in any order; any rank may own none.
    n_total : int
        Ids run from 0 to ``n_total - 1``.
    layout : FileLayout
    writer : {"auto", "parallel", "gather"}, optional
        ``parallel`` writes from all ranks at once and needs an h5py built for
        MPI; ``gather`` sends everything to rank 0 first; ``auto`` picks.
    seal : callable, optional
        Called on all ranks with the closed file, before it is renamed.

    Raises
    ------
    OSError
        On all ranks, if any rank cannot write. No partial file is left.
    ValueError
        On all ranks, if an id lies outside its range, or if `writer` is
        ``parallel`` and h5py was built without MPI.
    """
    # A name of its own: Open MPI takes a semaphore of the whole machine that bears the
    # name of the file, and one that a killed process held stays taken for ever.
    part = path.with_suffix(f".{comm.bcast(secrets.token_hex(4))}.part")
    write = _write_parallel if _is_parallel(writer) else _write_gathered
    mine = by_id_blocks(comm, particles, n_total)
    on_root(comm, lambda: _prepare(part, n_total, layout))
    try:
        write(comm, part, mine, layout)
        if seal is not None:
            seal(part)
        on_root(comm, lambda: replace_file(part, path))
    except OSError:
        if comm.rank == 0:
            part.unlink(missing_ok=True)
        raise


def row_bytes(columns: Sequence[Column]) -> int:
    """Return the size of a particle in a file of these columns [bytes]."""
    return sum(np.dtype(column.dtype).itemsize * column.width for column in columns)


def field_column(field: Field) -> Column:
    """Return the column of a scalar field."""
    return Column(
        field.name,
        "i8" if field.role == "label" else "f8",
        1,
        field.symbol,
        field.unit,
        field.meaning,
        lambda block: getattr(block.particles, field.name),
    )


def store_text(group: h5py.Group, name: str, text: str) -> None:
    """Store a text of any length; an attribute would hold 64 kB."""
    content = text.encode("utf-8")
    kind = h5py.string_dtype("utf-8", max(len(content), 1))
    group.create_dataset(name, data=np.array(content, kind), dtype=kind)


def stored_text(group: h5py.Group, name: str) -> str:
    """Return a text that `store_text` stored."""
    return bytes(group[name][()]).decode("utf-8")


def _prepare(part: Path, n_total: int, layout: FileLayout) -> None:
    """Write everything but the columns, and set aside the room for these.

    Where the disk turns out to be full while HDF5 writes or closes a file, it hangs or
    crashes. So it is given a file that has all of its room already: opening a file that
    is there keeps the room, creating one would give it back.
    """
    rest = io.BytesIO()
    with h5py.File(rest, "w", userblock_size=layout.user_block or None) as file:
        layout.write_rest(file, n_total)
    needed = rest.getbuffer().nbytes + row_bytes(layout.columns) * n_total + _RESERVE
    part.parent.mkdir(exist_ok=True)
    try:
        with part.open("xb") as out:
            out.write(rest.getvalue())
            out.flush()
            os.posix_fallocate(out.fileno(), 0, needed)
    except OSError as error:
        part.unlink(missing_ok=True)
        msg = f"{error.strerror} for a {layout.what} of {needed} bytes"
        raise OSError(error.errno, msg, str(part.parent)) from error


def _is_parallel(writer: Writer) -> bool:
    built_for_mpi = bool(h5py.get_config().mpi)
    if writer == "parallel" and not built_for_mpi:
        msg = "writer = 'parallel': this h5py was built without MPI; use 'gather'"
        raise ValueError(msg)
    return built_for_mpi and writer != "gather"


def _write_parallel(
    comm: MPI.Intracomm, part: Path, mine: Particles, layout: FileLayout
) -> None:
    """Write blocks of ids from all ranks at once."""
    offset, last = comm.scan(mine.n) - mine.n, comm.rank == comm.size - 1
    block = Block(mine, offset, comm.allreduce(mine.n), last)
    transfer = h5py.h5p.create(h5py.h5p.DATASET_XFER)
    transfer.set_dxpl_mpio(h5py.h5fd.MPIO_COLLECTIVE)

    def write() -> None:
        with _opened(short, driver="mpio", comm=comm) as file:
            _write_columns(file, block, transfer, layout)

    with _folder_opened(comm, part) as short:
        error = caught(write)
        if isinstance(error, OSError):
            text = (error.strerror or str(error)).replace(str(short), str(part))
            error = OSError(error.errno or errno.EIO, text)
        raise_together(comm, error)


def _write_gathered(
    comm: MPI.Intracomm, part: Path, mine: Particles, layout: FileLayout
) -> None:
    """Send everything to rank 0 and write there."""
    everything = gather_all(comm, mine)
    transfer = h5py.h5p.create(h5py.h5p.DATASET_XFER)

    def write() -> None:
        assert everything is not None, "on_root calls this on rank 0 only"
        block = Block(everything, 0, everything.n, last=True)
        with _opened(part) as file:
            _write_columns(file, block, transfer, layout)

    on_root(comm, write)


@contextmanager
def _folder_opened(comm: MPI.Intracomm, path: Path) -> Iterator[Path]:
    """Yield a name of some 40 characters for a file, good in this process and block.

    Open MPI aborts in the C library where a name has more than `LONGEST_NAME` bytes.
    """
    opened: list[int] = []
    try:
        # Together: a rank that left alone would leave the others opening the file.
        raise_together(comm, caught(lambda: opened.append(_open_folder(path))))
        short = _short_name(opened[0], path)
        yield short if short.exists() else path
    finally:
        for folder in opened:
            os.close(folder)


def _open_folder(path: Path) -> int:
    """Open the folder of a file; refuse one whose name MPI would not take."""
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    is_long = len(os.fsencode(path)) > LONGEST_NAME
    if is_long and not _short_name(folder, path).exists():
        os.close(folder)
        text = f"longer than the {LONGEST_NAME} bytes that MPI takes here"
        raise OSError(errno.ENAMETOOLONG, text, str(path))
    return folder


def _short_name(folder: int, path: Path) -> Path:
    return Path(f"/proc/self/fd/{folder}", path.name)


@contextmanager
def _opened(part: Path, **how: Any) -> Iterator[h5py.File]:
    """Open a file for writing, and close it at the end of the block."""
    file = h5py.File(part, "r+", **how)
    try:
        yield file
    except BaseException:
        # Closing a file that could not be written may hang, where no other rank and no
        # handler can help: then the system is to end this process, and with it all.
        signal.alarm(CLOSING_TIME)
        with suppress(Exception):  # the first error counts
            file.close()
        signal.alarm(0)
        raise
    file.close()


def _write_columns(
    file: h5py.File, block: Block, transfer: h5py.h5p.PropDXID, layout: FileLayout
) -> None:
    """Write all columns, and go on after an error so that no rank waits.

    A rank that left at its first error would leave the others in the next
    collective write.

    Raises
    ------
    OSError
        The first error this rank met.
    """
    group = file.require_group(layout.group)
    errors = [
        caught(partial(_write_column, group, column, block, transfer))
        for column in layout.columns
    ]
    for error in filter(None, errors):
        raise error


def _write_column(
    group: h5py.Group, column: Column, block: Block, transfer: h5py.h5p.PropDXID
) -> None:
    """Create a dataset and write this process's rows of it."""
    tail = () if column.width == 1 else (column.width,)
    total = block.n_total + column.closed
    dataset = group.create_dataset(
        column.name, (total, *tail), column.dtype, fill_time="never"
    )
    dataset.attrs["symbol"] = column.symbol
    dataset.attrs["unit"] = column.unit
    dataset.attrs["meaning"] = column.meaning
    if total == 0:
        return
    n = block.particles.n + (column.closed and block.last)
    in_file = dataset.id.get_space()
    in_memory = h5py.h5s.create_simple((n, *tail))
    if n:
        in_file.select_hyperslab((block.offset, *(0 for _ in tail)), (n, *tail))
    else:
        # h5py's own slicing deadlocks on an empty collective selection.
        in_file.select_none()
        in_memory.select_none()
    rows = np.ascontiguousarray(column.rows(block), column.dtype)
    dataset.id.write(in_memory, in_file, rows, dxpl=transfer)
