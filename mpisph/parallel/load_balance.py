"""How much work each rank has, and when to look for a better cut."""

from dataclasses import dataclass

import numpy as np

from mpisph.core.jit import EXACT
from mpisph.core.jitted import jitable, jitted
from mpisph.core.particles import FloatArray

PARTICLE_WORK = 14.0
"""Work of a particle besides its pairs, in units of a pair: in shot 4-1353 at NPR 40
all other phases took 200 ns a particle, and a pair 14 ns."""

FADING = 0.9
"""What a step leaves of the weight of earlier ones in a `PairCost`."""

LONGEST_BACKOFF = 31
"""Occasions that `Backoff` lets pass at most."""

NOTABLE_GROWTH = 0.02
"""Growth of the imbalance that ends a wait."""


@dataclass
class Backoff:
    """When to look for a better cut again, after looking for one in vain.

    Each time in vain twice as many further occasions are let pass, unless the imbalance
    has grown since. The same on all ranks.

    Attributes
    ----------
    imbalance : float
        At the last time in vain.
    wait : int
        Occasions that were to be let pass after it.
    left : int
        Of these, those to come.
    """

    imbalance: float = 0.0
    wait: int = 0
    left: int = 0

    def due(self, imbalance: float) -> bool:
        """Return whether to look on this occasion."""
        if self.left == 0 or imbalance > self.imbalance + NOTABLE_GROWTH:
            return True
        self.left -= 1
        return False

    def note(self, imbalance: float, in_vain: bool) -> None:
        """Take note of how the look went that was due."""
        self.imbalance = imbalance
        self.wait = min(2 * self.wait + 1, LONGEST_BACKOFF) if in_vain else 0
        self.left = self.wait


@dataclass
class PairCost:
    """Measured time of a pair on this rank, a mean over the last steps.

    Pairs take longer near the axis and where matter is disordered, and cores may
    differ: counted pairs alone left one of two ranks 15 % more time in the pair loop.

    Attributes
    ----------
    seconds : float
        Time spent, faded [s].
    pairs : float
        Pairs evaluated in it, faded.
    """

    seconds: float = 0.0
    pairs: float = 0.0

    def note(self, seconds: float, pairs: float) -> None:
        """Take note of the time that some pairs took."""
        self.seconds = FADING * self.seconds + seconds
        self.pairs = FADING * self.pairs + pairs

    @property
    def value(self) -> float:
        """Time of a pair [s]; zero where there was none."""
        return self.seconds / self.pairs if self.pairs > 0.0 else 0.0


@jitted(**EXACT)
def relative_pair_costs(pair_costs: FloatArray) -> FloatArray:
    """Return each rank's cost of a pair over their mean, in sixteenths.

    Parameters
    ----------
    pair_costs : ndarray, shape (ranks,)
        Zero where nothing was measured; such a rank is taken for an average one.
    """
    total, known = 0.0, 0
    for pair_cost in pair_costs:
        if pair_cost > 0.0:
            total += pair_cost
            known += 1
    relative = np.ones(pair_costs.size)
    for rank in range(pair_costs.size):
        if pair_costs[rank] > 0.0:
            sixteenths = np.rint(16.0 * pair_costs[rank] * known / total)
            relative[rank] = min(max(sixteenths / 16.0, 0.5), 2.0)
    return relative


@jitable
def work_of(neighbours: FloatArray) -> FloatArray:
    """Return the work of particles with so many neighbours, whole numbers."""
    return neighbours + PARTICLE_WORK


def imbalance(work: FloatArray) -> float:
    """Return the largest work of a rank over the mean, less 1.

    Parameters
    ----------
    work : ndarray, shape (ranks,)
    """
    each = work.tolist()  # so few numbers that numpy's own reductions take longer
    total = sum(each)
    return max(each) * len(each) / total - 1.0 if total > 0.0 else 0.0
