"""What a run follows besides the whole, and the tables that it writes of it."""

from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np
from mpi4py import MPI

from mpisph.diagnostics.probes import nearest_particles, note_peaks, read_probes
from mpisph.io.history import Table
from mpisph.io.probe_files import (
    BODIES_FILE,
    GAUGES_FILE,
    ProbeState,
    probe_cells,
    probe_headers,
)
from mpisph.parallel.collectives import from_root
from mpisph.solver.state import Simulation


class Probes:
    """Reads bodies and gauges and writes their tables; use it in a ``with`` statement.

    Parameters
    ----------
    sim : Simulation
    folder : Path
        Folder of the run.
    state : ProbeState, optional
        That of the checkpoint from which the run continues.
    kept : mapping of str to int, optional
        Size of what is kept of each table [bytes].
    """

    def __init__(
        self,
        sim: Simulation,
        folder: Path,
        state: ProbeState | None = None,
        kept: Mapping[str, int] | None = None,
    ) -> None:
        self._followed = (
            dict(state.followed)
            if state
            else nearest_particles(sim.comm, sim.everything, sim.case.gauges)
        )
        none = [-np.inf] * len(sim.case.bodies)
        self._peaks = np.array(state.peaks if state else none)
        self._stack = ExitStack()
        self._tables = {
            name: Table(folder / name, header, sim.comm, (kept or {}).get(name, 0))
            for name, header in probe_headers(sim.case).items()
        }

    def __enter__(self) -> Self:
        """Return the probes themselves."""
        for table in self._tables.values():
            self._stack.enter_context(table)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the tables."""
        self._stack.close()

    def note_step(self, sim: Simulation) -> None:
        """Note what a step has reached; in every one."""
        note_peaks(sim.particles, self._peaks)

    def add_row(self, sim: Simulation) -> None:
        """Write a line of each table; collective."""
        values = read_probes(
            sim.comm,
            (sim.particles, sim.retired),
            self._peaks,
            sim.case.gauges,
            self._followed,
            sim.scales,
            sim.scheme.kappa,
            sim.planes,
        )
        if sim.comm.rank == 0:
            rows = {BODIES_FILE: values.bodies, GAUGES_FILE: values.gauges}
            for name, table in self._tables.items():
                table.add_cells(probe_cells(sim.step, sim.time, rows[name]))

    def state(self, sim: Simulation) -> ProbeState:
        """Return what the probes need to go on; collective."""
        peaks = np.empty_like(self._peaks)
        sim.comm.Allreduce(self._peaks, peaks, MPI.MAX)
        tables = from_root(
            sim.comm, lambda: {name: t.saved() for name, t in self._tables.items()}
        )
        return ProbeState(
            followed=self._followed, peaks=tuple(peaks.tolist()), tables=tables
        )
