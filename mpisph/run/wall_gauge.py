"""Measures the wall of a shield while a run is under way."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from mpisph.case import Case
from mpisph.io.verdict import WallRecord
from mpisph.parallel.collectives import from_root
from mpisph.solver.state import Simulation

if TYPE_CHECKING:
    from mpisph.analysis.wall import Layout

__all__ = ["WallGauge"]

_FIELDS = ("id", "body", "m", "r", "z", "u_z", "damage")


class WallGauge:
    """Measures the last body of a case with a shield.

    Parameters
    ----------
    case : Case
    """

    def __init__(self, case: Case) -> None:
        self.case = case

    @cached_property
    def _layout(self) -> Layout:
        # Imported here: scipy takes a quarter of a second, and only shields need it.
        from mpisph.analysis.wall import wall_layout

        return wall_layout(self.case)

    def measure(self, sim: Simulation) -> WallRecord:
        """Return the wall as it is now; collective."""
        p = sim.everything
        wall = self.case.bodies[-1]
        near = (p.body == len(self.case.bodies) - 1) | (p.z > wall.section.ends[0])
        gathered = sim.comm.gather({name: getattr(p, name)[near] for name in _FIELDS})
        return from_root(sim.comm, lambda: self._measure(gathered or [], sim.time))

    def _measure(
        self, gathered: list[dict[str, np.ndarray]], time: float
    ) -> WallRecord:
        """Measure what all ranks have sent; on rank 0."""
        from mpisph.analysis.wall import measure_wall

        particles = {
            name: np.concatenate([part[name] for part in gathered]) for name in _FIELDS
        }
        order = np.argsort(particles["id"])  # sums in one order on any ranks
        ordered = {name: values[order] for name, values in particles.items()}
        return measure_wall(self._layout, ordered, time)
