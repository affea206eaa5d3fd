"""Moving particles to the ranks that are to own them."""

from mpi4py import MPI

from mpisph.collectives import redistribute
from mpisph.decomposition import owners
from mpisph.particles import FloatArray, Particles


def migrate(comm: MPI.Intracomm, p: Particles, edges: FloatArray) -> Particles:
    """Send every particle to the rank in whose slab it lies.

    Parameters
    ----------
    comm : MPI.Intracomm
    p : Particles
        Owned particles.
    edges : ndarray, shape (ranks - 1,)
        Inner edges of the slabs [m].

    Returns
    -------
    Particles
        Those of this rank's slab, in no particular order.
    """
    return redistribute(comm, p, owners(p.z, edges))
