"""What happened in a run, and when: ``log.txt``."""

from pathlib import Path

from mpi4py import MPI

from mpisph.io.files import LineFile

LOG_FILE = "log.txt"


class RunLog(LineFile):
    """Adds lines to ``log.txt``, on rank 0 alone; other ranks do nothing.

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
        super().__init__(folder / LOG_FILE if comm.rank == 0 else None)

    def say(self, text: str) -> None:
        """Write one or more lines to the log."""
        self.write(text.rstrip("\n") + "\n")
