"""What happened in a run, and when: ``log.txt``."""

from pathlib import Path

from mpi4py import MPI

from mpisph.io.files import LineFile, set_aside

LOG_FILE = "log.txt"


class RunLog(LineFile):
    """Adds lines to ``log.txt``, on rank 0 alone; other ranks do nothing.

    A folder or a pipe of that name is renamed: a pipe would keep its writer for ever.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    comm : MPI.Intracomm

    Raises
    ------
    OSError
        On rank 0, if the file cannot be written.
    """

    def __init__(self, folder: Path, comm: MPI.Intracomm) -> None:
        path = folder / LOG_FILE if comm.rank == 0 else None
        if path is not None and (path.is_dir() or path.is_fifo()):
            set_aside(path)
        super().__init__(path)

    def say(self, text: str) -> None:
        """Write one or more lines to the log."""
        self.write(text.rstrip("\n") + "\n")
