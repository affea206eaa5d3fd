"""How large a run will be: particles, memory and steps, before it is started."""

import math
from typing import NamedTuple

from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.bodies import particle_count
from mpisph.case.partial_case import spacing_key
from mpisph.core.errors import CaseError, Problem
from mpisph.core.memory import total_memory
from mpisph.core.particles import INTEGRATED, LABELS, VALUES
from mpisph.core.words import counted
from mpisph.parallel.collectives import raise_together
from mpisph.solver.setup import neighbours_inside
from mpisph.sph.pair_records import RECORD_FIELDS
from mpisph.sph.sources import EXCHANGED
from mpisph.sph.timestep import VISCOUS_SHARE

COMPRESSION = 0.83
"""An automatic step is this much shorter than the first: sound is faster and h smaller
behind the shock. Measured on the four shots: 0.80 to 0.87."""

RANK_BYTES = 2.0e8
"""Memory of a rank before its first particle: the interpreter, its libraries and the
compiled code (measured). Compiling takes 3.6e8."""

PARTICLE_BYTES = 8.0 * (
    len(LABELS) + len(VALUES) + len(INTEGRATED) + 3 * len(EXCHANGED) + RECORD_FIELDS
)
"""Memory of a particle at the peak, in the pair loop: its state, what is predicted,
exchanged and sorted, and its record. Measured: 950 to 980 bytes. Filling the bodies and
sharing them out takes 520."""


PAIR_TIME = 13.5e-9
"""Time of a directed interaction [s]; this and the next two were measured on an EPYC
(Zen 4) core in shot 4-1353 at NPR 10 to 200."""

PARTICLE_TIME = 250e-9
"""Time of a particle besides its interactions [s]."""

STEP_TIME = 0.25e-3
"""Time of a step, whatever it holds [s]."""


class Estimate(NamedTuple):
    """Size of a run.

    Attributes
    ----------
    particles : int
    neighbours : float
        Of a particle inside a body.
    steps : int
    memory : float
        Of all ranks [bytes].
    ranks : int
    wall : float
        Time on the wall clock [s], on processors like that of the measurements.
    """

    particles: int
    neighbours: float
    steps: int
    memory: float
    ranks: int
    wall: float

    def text(self) -> str:
        """Return the estimate for people."""
        return (
            f"particles  about {self.particles}\n"
            f"neighbours about {self.neighbours:.0f} each\n"
            f"steps      about {self.steps}\n"
            f"memory     about {self.memory / 2**30:.2f} GiB on "
            f"{counted(self.ranks, 'rank')}\n"
            f"wall time  {self.duration()}"
        )

    def duration(self) -> str:
        """Return the expected wall time for people."""
        for unit, seconds in (("days", 86400.0), ("h", 3600.0), ("min", 60.0)):
            if self.wall >= 2.0 * seconds:
                return f"about {self.wall / seconds:.2g} {unit}{_OF_OTHERS}"
        return f"about {math.ceil(self.wall)} s{_OF_OTHERS}"


_OF_OTHERS = ", an estimate good to a factor of two"
# Matter at rest costs less, and fine runs take more steps than is foreseen. Shot 4-1353
# to 6 us took 71 s at NPR 40 on one rank, where this gives 53; 635 s at NPR 100 on two,
# where it gives 422.


def estimate(case: Case, ranks: int) -> Estimate:
    """Estimate the size of a run without starting it.

    Parameters
    ----------
    case : Case
    ranks : int
        Number of ranks that are to run it.

    Returns
    -------
    Estimate
    """
    own = case.initial
    n = particle_count(case.bodies, case.spacing) if own is None else own.count
    neighbours = neighbours_inside(case)
    steps = math.ceil(case.end_time / _typical_step(case))
    work = n * (neighbours * PAIR_TIME + PARTICLE_TIME)
    return Estimate(
        particles=n,
        neighbours=neighbours,
        steps=steps,
        memory=ranks * RANK_BYTES + n * PARTICLE_BYTES,
        ranks=ranks,
        wall=steps * (STEP_TIME + work / ranks),
    )


def check_memory(case: Case, comm: MPI.Intracomm) -> None:
    """Refuse a case that the nodes' memory could not hold; collective.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
        The ranks that are to run it.

    Raises
    ------
    CaseError
        On all ranks, if any node has too little memory for its share.
    """
    node = comm.Split_type(MPI.COMM_TYPE_SHARED)
    ranks = node.size
    node.Free()
    needed = estimate(case, comm.size).memory * ranks / comm.size
    available = total_memory()
    error = None
    if needed > available:
        problem = Problem(
            f"about {_gibibytes(needed)} would be needed on a node of "
            f"{_gibibytes(available)}; take more nodes or a coarser resolution",
            key=".".join(map(str, spacing_key(case.resolution))),
        )
        error = CaseError([problem])
    raise_together(comm, error)


def _gibibytes(memory: float) -> str:
    """Return a memory [bytes] as text of three digits."""
    return f"{memory / 2**30:.3g} GiB"


def _typical_step(case: Case) -> float:
    """Return the fixed step, or about what the limits will allow [s]."""
    t, viscosity = case.time, case.scheme.viscosity
    if t.step == "fixed" and t.dt is not None:
        return t.dt
    fastest = max(entry.bulk_sound_speed for entry in case.material_table)
    signal = fastest * (1.0 + VISCOUS_SHARE * viscosity.alpha)
    step = COMPRESSION * t.cfl * case.smoothing_length / signal
    return step if t.dt is None else min(step, t.dt)
