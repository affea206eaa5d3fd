"""The state of a run: everything that a step reads or changes."""

from dataclasses import dataclass, field

from mpi4py import MPI

from mpisph.case import Case
from mpisph.core.particles import FloatArray, Particles
from mpisph.core.timers import Timers
from mpisph.core.workspace import Workspace
from mpisph.diagnostics.cloud import CloudDefinition
from mpisph.diagnostics.series import Parts, Scales
from mpisph.diagnostics.stability import Bounds
from mpisph.parallel.decomposition import Cut
from mpisph.parallel.halo import Halo
from mpisph.parallel.load_balance import Backoff, PairCost
from mpisph.physics.response import MaterialTable
from mpisph.physics.scheme import SchemeConstants
from mpisph.sph.neighbours import Lattice
from mpisph.sph.planes import Planes
from mpisph.sph.retirement import Retirement
from mpisph.sph.timestep import StepRule


@dataclass
class Simulation:
    """Everything that a step reads or changes.

    Attributes
    ----------
    case : Case
    comm : MPI.Intracomm
    particles : Particles
        Owned by this rank, less those that have left the game.
    n_total : int
        Number of particles on all ranks.
    scheme, table, lattice, bounds, scales, sum_bounds, cloud
        Constants of the run, derived from the case.
    rule : StepRule
        How the case's steps follow from the limits.
    cut : Cut
        Of the domain, one part a rank.
    planes : Planes
        Rigid planes between which the matter lies.
    backoff : Backoff
        With an imbalance that no other cut could lessen.
    pair_cost : PairCost
        Measured time of this rank's pairs.
    relative_pair_cost : float
        That over the mean of all ranks, at the last reduction.
    halo : Halo
        Buffers of the exchange, and what this rank has sent.
    time : float
        [s].
    step : int
        Steps made.
    dt : float
        Length of the last step [s].
    first_dt : float
        Length that the limits allowed for the first step [s]; 0 before it.
    interactions : int
        Directed interactions evaluated by this rank.
    next_migration : int
        Step from which on particles that have left their part change their owner.
    next_sort : int
        Step from which on this rank's particles are put into cell order again.
    timers : Timers
        Time spent in each phase of the step.
    skip_quiescent : bool
        Whether matter at rest is left out of the pair loop; no bit depends on it.
    workspace : Workspace
        Arrays that a step fills anew.
    retirement : Retirement, optional
        When matter leaves the game.
    retired : Particles
        What has left the game on this rank.
    retired_parts : Parts, optional
        What that adds to the sums of the run; it stays the same.
    """

    case: Case
    comm: MPI.Intracomm
    particles: Particles
    n_total: int
    scheme: SchemeConstants
    table: MaterialTable
    lattice: Lattice
    bounds: Bounds
    scales: Scales
    sum_bounds: FloatArray
    cloud: CloudDefinition
    rule: StepRule
    cut: Cut
    planes: Planes
    time: float = 0.0
    step: int = 0
    dt: float = 0.0
    first_dt: float = 0.0
    interactions: int = 0
    next_migration: int = 0
    next_sort: int = 0
    backoff: Backoff = field(default_factory=Backoff)
    pair_cost: PairCost = field(default_factory=PairCost)
    relative_pair_cost: float = 1.0
    halo: Halo = field(default_factory=Halo)
    timers: Timers = field(default_factory=Timers)
    skip_quiescent: bool = True
    workspace: Workspace = field(default_factory=Workspace)
    retirement: Retirement | None = None
    retired: Particles = field(default_factory=lambda: Particles.zeros(0))
    retired_parts: Parts | None = None

    @property
    def everything(self) -> Particles:
        """All that this rank owns, what has left the game too."""
        if self.retired.n == 0:
            return self.particles
        return Particles.unpack([self.particles.pack(), self.retired.pack()])
