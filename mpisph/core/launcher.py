"""Whether the launcher and the MPI library of this process belong together.

An mpirun of another MPI, or Slurm's srun without the MPI plugin, starts processes that
each find themselves alone: every one would run the whole case, into the same folder.
"""

from collections.abc import Mapping, MutableMapping
from typing import NamedTuple


class Launch(NamedTuple):
    """What a launcher has told a process in its environment.

    Attributes
    ----------
    launcher : str
        Its name, for people.
    size : int
        Number of processes started.
    rank : int
        Of this one.
    """

    launcher: str
    size: int
    rank: int


_VARIABLES = (
    ("Open MPI's mpirun", "OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
    ("MVAPICH's mpirun", "MV2_COMM_WORLD_SIZE", "MV2_COMM_WORLD_RANK"),
    ("the mpirun of MPICH or Intel MPI", "PMI_SIZE", "PMI_RANK"),
    ("srun", "SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
)
# An mpirun may itself have been started by srun: the last to speak comes first here.

_MEETING = ("PMIX_RANK", *(rank for *_, rank in _VARIABLES[:-1]))
# One of these is set where processes have been told how to find each other.

_STEP = ("SLURM_STEP_ID", "SLURM_STEPID")


def step_without_mpi(environment: MutableMapping[str, str]) -> str | None:
    """Return what is wrong where srun has started this process and no MPI plugin has.

    It is to be called before MPI starts: Open MPI ends such a process with a page on
    how to build it. A single process of a step, such as that in the shell of `salloc`
    or of ``srun --pty``, needs no plugin; it is taken out of the step.

    Parameters
    ----------
    environment : mutable mapping
        That of this process; of a single one the variables of the step are removed.

    Returns
    -------
    str or None
        For people, and empty on all tasks but one; None where nothing is wrong.
    """
    launch = launch_of(environment)
    if not launch or launch.launcher != "srun" or environment.keys() & set(_MEETING):
        return None
    if launch.size == 1 or "SLURM_PTY_PORT" in environment:
        for name in (*_STEP, "SLURM_STEP_NUM_TASKS"):
            environment.pop(name, None)
        return None
    return (
        f"srun has started {launch.size} tasks without MPI, so that each would run "
        f"alone. Use `srun --mpi=pmix` (`srun --mpi=list` shows what there is), or "
        "`mpirun` within the job."
        if launch.rank == 0
        else ""
    )


def launch_of(environment: Mapping[str, str]) -> Launch | None:
    """Return what a launcher has told this process; None where there was none."""
    for name, size, rank in _VARIABLES:
        if environment.get(size, "").isdecimal():
            number = environment.get(rank, "")
            return Launch(
                name, int(environment[size]), int(number) if number.isdecimal() else 0
            )
    return None


def banner_follows(environment: Mapping[str, str]) -> bool:
    """Say whether the launcher adds a page of its own to an exit code that is not 0.

    Open MPI's mpirun does, below what mpisph has said, unless it is told to be quiet.
    """
    return (
        "OMPI_COMM_WORLD_SIZE" in environment
        and environment.get("OMPI_MCA_orte_execute_quiet", "0") == "0"
    )


def library_name(version: str) -> str:
    """Return name and version of an MPI library from its long description."""
    return version.split("\n")[0].split(",")[0].strip("\0 ")


def mismatch(launch: Launch | None, size: int, library: str) -> str | None:
    """Return what is wrong where a launcher's processes do not find each other.

    Parameters
    ----------
    launch : Launch or None
    size : int
        Of the world communicator.
    library : str
        Description of the MPI library.

    Returns
    -------
    str or None
        For people; None where nothing is wrong.
    """
    if launch is None or launch.size == size or size > 1:
        return None
    return (
        f"{launch.launcher} has started {launch.size} processes, but each finds itself "
        f"alone: mpisph uses another MPI, {library_name(library)}. Start it with that "
        "MPI's own mpirun, or install mpi4py for the one at hand."
    )
