"""How a case would scale: what each part of a cut has to do, counted without a run.

Particles, ghosts and messages are counted exactly, by the functions that a run uses.
The time of a step follows from costs that were measured elsewhere; the slowest part
sets it.
"""

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.case import Case
from mpisph.case.discretise import discretise
from mpisph.case.initial import read_initial
from mpisph.core.particles import FloatArray, IntArray
from mpisph.parallel.decomposition import Cut, CutMode, equal_work_cut, owners
from mpisph.parallel.halo import NOTHING, boxes, hull, partners_of, reach, select
from mpisph.parallel.load_balance import work_of
from mpisph.solver.estimate import PAIR_TIME, PARTICLE_TIME, STEP_TIME
from mpisph.solver.setup import neighbours_inside
from mpisph.sph.sources import EXCHANGED

GHOST_BYTES = 8 * len(EXCHANGED)
"""Size of a ghost in a message."""


class Costs(NamedTuple):
    """What a step's operations cost.

    Attributes
    ----------
    interaction : float
        Of a directed interaction [s].
    particle : float
        Of an owned particle, besides its interactions [s].
    ghost : float
        Of a ghost received [s].
    latency : float
        Of a message to and from one other part [s].
    collective : float
        Of the step's one collective, times log2 of the number of parts [s].
    bandwidth : float
        Of the network, a part [bytes/s].
    step : float
        Of a step on any part, whatever it holds: Python's share [s].

    The first three and the last were measured on an EPYC (Zen 4) core in shot 4-1353 at
    NPR 10 to 200; the network's are those of a common cluster.
    """

    interaction: float = PAIR_TIME
    particle: float = PARTICLE_TIME
    ghost: float = 100e-9
    latency: float = 15e-6
    collective: float = 5e-6
    bandwidth: float = 5e9
    step: float = STEP_TIME


class PartCounts(NamedTuple):
    """What the parts of a cut hold and receive in a step; arrays of shape (parts,).

    Attributes
    ----------
    own : ndarray of int64
        Particles owned.
    interactions : ndarray
        Directed interactions of these.
    ghosts : ndarray of int64
        Particles received from other parts.
    messages : ndarray of int64
        Other parts that send a message to it, which are those that it sends one to.
    """

    own: IntArray
    interactions: FloatArray
    ghosts: IntArray
    messages: IntArray

    @property
    def bytes(self) -> IntArray:
        """Bytes received."""
        return self.ghosts * GHOST_BYTES


class Scaling(NamedTuple):
    """The modelled step on so many parts.

    Attributes
    ----------
    counts : PartCounts
    efficiency : float
        Time of one part alone over the time of the slowest part, over their number.
    """

    counts: PartCounts
    efficiency: float


class ParticleLayout(NamedTuple):
    """Particles as far as their sharing out needs them; arrays of shape (n,).

    Attributes
    ----------
    r, z : ndarray
        Positions [m].
    reach : ndarray
        How far each reaches (see `halo.reach`) [m].
    neighbours : ndarray
        Number of neighbours, whole numbers; 0 for one at rest that is left out.
    """

    r: FloatArray
    z: FloatArray
    reach: FloatArray
    neighbours: FloatArray


def initial_layout(case: Case, neighbours: FloatArray | None = None) -> ParticleLayout:
    """Return the particles of a case at the start.

    Parameters
    ----------
    case : Case
    neighbours : ndarray, shape (n,), optional
        In the order of the ids; by default all are active and have as many as inside
        a body.
    """
    initial = discretise(case) if case.initial is None else read_initial(case)
    kappa = case.scheme.kappa
    if neighbours is None:
        neighbours = np.full(initial.id.size, float(neighbours_inside(case)))
    return ParticleLayout(initial.r, initial.z, reach(initial.h, kappa), neighbours)


def count_parts(layout: ParticleLayout, cut: Cut, parts: int) -> PartCounts:
    """Count what each part of a cut holds and receives, exactly.

    Parameters
    ----------
    layout : ParticleLayout
    cut : Cut
    parts : int
    """
    owner = owners(cut, layout.r, layout.z)
    order = np.argsort(owner, kind="stable")
    own = np.bincount(owner, minlength=parts)
    ends = np.concatenate([[0], np.cumsum(own)])
    all_boxes = boxes(layout.r, layout.z, layout.reach, layout.reach)[:, order]
    of_part = [np.ascontiguousarray(all_boxes[:, a:b]) for a, b in pairwise(ends)]
    rank_boxes = np.array([hull(b) if b.size else NOTHING for b in of_part])
    ghosts = np.zeros(parts, np.int64)
    messages = np.zeros(parts, np.int64)
    for part in range(parts):
        partners = partners_of(part, rank_boxes)
        start, _ = select(of_part[part], rank_boxes[partners])
        ghosts[partners] += np.diff(start)
        messages[part] = partners.size
    pairs = np.bincount(owner, weights=layout.neighbours, minlength=parts)
    return PartCounts(own, pairs.astype(np.float64), ghosts, messages)


def step_times(counts: PartCounts, costs: Costs) -> FloatArray:
    """Return the modelled time of a step on each part, shape (parts,) [s]."""
    parts = counts.own.size
    return np.asarray(
        costs.interaction * counts.interactions
        + costs.particle * counts.own
        + costs.ghost * counts.ghosts
        + costs.latency * counts.messages
        + counts.bytes / costs.bandwidth
        + costs.collective * math.log2(parts)
        + costs.step
    )


def predict_scaling(
    layout: ParticleLayout,
    parts: int,
    mode: CutMode = "auto",
    costs: Costs | None = None,
) -> Scaling:
    """Return how a step scales to so many parts, with the cut that a run would make.

    Parameters
    ----------
    layout : ParticleLayout
    parts : int
    mode : {"auto", "z", "r"}, optional
    costs : Costs, optional
    """
    alone = MPI.COMM_SELF
    r, z, half, neighbours = layout
    work = work_of(neighbours)
    cut = equal_work_cut(alone, r, z, half, work, parts, mode)
    counts = count_parts(layout, cut, parts)
    costs = costs or Costs()
    slowest = float(step_times(counts, costs).max())
    pairs = costs.interaction * neighbours.sum()
    serial = pairs + costs.particle * r.size + costs.step
    return Scaling(counts, float(serial / (parts * slowest)))


_WAYS: dict[CutMode, str] = {"z": "along z", "auto": "along z or r"}


def scaling_table(
    layout: ParticleLayout,
    parts: Sequence[int] = (16, 64, 256),
    costs: Costs | None = None,
) -> list[str]:
    """Return a table in Markdown, both cuts for each number of parts, by lines.

    Counts are those of the part with most, and in brackets the mean.

    Parameters
    ----------
    layout : ParticleLayout
    parts : sequence of int, optional
    costs : Costs, optional
    """
    lines = [
        "| parts | cut | own particles | ghosts | messages | kB | efficiency |",
        "|---|---|---|---|---|---|---|",
    ]
    for number in parts:
        for mode, way in _WAYS.items():
            found = predict_scaling(layout, number, mode, costs)
            lines.append(_row(number, way, found))
    return lines


def _row(parts: int, way: str, found: Scaling) -> str:
    counts = found.counts
    columns = (counts.own, counts.ghosts, counts.messages, counts.bytes / 1e3)
    cells = [f"{column.max():.0f} ({column.mean():.0f})" for column in columns]
    counted = " | ".join(cells)
    return f"| {parts} | {way} | {counted} | {found.efficiency:.0%} |"
