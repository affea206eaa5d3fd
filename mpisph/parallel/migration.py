"""Moving particles to the ranks that are to own them."""

from mpi4py import MPI

from mpisph.core.particles import Particles
from mpisph.parallel.decomposition import Cut, owners
from mpisph.parallel.redistribution import redistribute


def migrate(comm: MPI.Intracomm, p: Particles, cut: Cut) -> Particles:
    """Send every particle to the rank in whose part it lies.

    Parameters
    ----------
    comm : MPI.Intracomm
    p : Particles
        Owned particles.
    cut : Cut

    Returns
    -------
    Particles
        Those of this rank's part, in no particular order; `p` itself where none left
        and none came.
    """
    return redistribute(comm, p, owners(cut, p.r, p.z))
