"""What a bench measures: a block of particles, and a shot at two times."""

import hashlib
import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
from mpi4py import MPI

from mpisph.bench.record import SceneName
from mpisph.case import Case, case_from_dict
from mpisph.case.discretise import InitialParticles, discretise, initial_count
from mpisph.core.particles import INITIAL
from mpisph.io.snapshot import SNAPSHOTS_FOLDER, read_snapshot, write_snapshot
from mpisph.parallel.collectives import from_root, on_root
from mpisph.run.loop import make_step
from mpisph.solver.setup import step_rule
from mpisph.solver.start import id_block, start, start_from
from mpisph.solver.state import Simulation
from mpisph.solver.step import reduce_state
from mpisph.sph.timestep import allowed_step, step_to

BLOCK_SPACING = 1e-4
"""Particle spacing of the block [m]."""

BLOCK_SIDE = 3
"""Cells along the block's side for each of NPR: about as many particles as a shot."""

BLOCK_RADIUS = 1000
"""Spacings from the axis to the block."""


class Scene(NamedTuple):
    """Something to measure.

    Attributes
    ----------
    name : {"block", "impact", "late", "small"}
    npr : int
        Its resolution.
    start : callable
        Returns a simulation on a communicator.
    """

    name: SceneName
    npr: int
    start: Callable[[MPI.Intracomm], Simulation]


def block_case(npr: int) -> Case:
    """Return the case of a square block far from the axis, at rest."""
    side = BLOCK_SIDE * npr * BLOCK_SPACING
    inner = BLOCK_RADIUS * BLOCK_SPACING
    block = {
        "name": "block",
        "shape": "plate",
        "material": "al-lee2003",
        "thickness": side,
        "inner_radius": inner,
        "radius": inner + side,
    }
    return case_from_dict(
        {
            "title": "a block far from the axis",
            "bodies": [block],
            "resolution": {"spacing": BLOCK_SPACING, "nph": 2.0},
            "time": {"end": 1e-6},
        }
    )


def start_block(npr: int, comm: MPI.Intracomm) -> Simulation:
    """Start a block whose velocity and density are slightly disturbed.

    No particle is then exactly at rest, where a step would have nothing to do.
    """
    case = block_case(npr)
    first, end = id_block(case, comm)
    quiet = discretise(case, first, end)
    # The same on any number of ranks, so drawn for all particles.
    noise = np.random.default_rng(1).normal(size=(3, initial_count(case)))
    u_r, u_z, change = noise[:, first:end]
    rho = quiet.rho * (1.0 + 1e-4 * change)
    return start_from(case, comm, quiet._replace(u_r=u_r, u_z=u_z, rho=rho), 0.0)


def keep_late_start(case: Case, comm: MPI.Intracomm, time: float, store: Path) -> Path:
    """Return the snapshot of a case at `time`; run the case there if it is not stored.

    What older sources have stored serves as well: their speed and that of newer ones
    are then measured on the same particles.

    Parameters
    ----------
    case : Case
    comm : MPI.Intracomm
        Collective over it.
    time : float
        [s].
    store : Path
        Folder of the snapshots, by digests of their cases and times.

    Raises
    ------
    OSError
        On all ranks, if the snapshot cannot be written.
    """
    text = case.to_toml()
    key = hashlib.sha256(f"{text}\n{time!r}".encode()).hexdigest()[:16]
    path = store / key / SNAPSHOTS_FOLDER / "snapshot_00000.vtkhdf"
    if comm.bcast(path.exists()):
        return path
    on_root(comm, lambda: path.parents[1].mkdir(parents=True, exist_ok=True))
    sim = start(case, comm)
    rule = step_rule(case)
    while sim.time < time:
        found = reduce_state(sim)
        make_step(sim, found, step_to(time - sim.time, allowed_step(rule, found.limit)))
    return write_snapshot(
        comm,
        store / key,
        0,
        sim.everything,
        time=sim.time,
        step=sim.step,
        metadata={"case": text},
        n_total=sim.n_total,
        fields=case.saved_fields,
    )


def start_late(case: Case, path: Path, comm: MPI.Intracomm) -> Simulation:
    """Continue a case from one of its snapshots.

    Raises
    ------
    OSError, RuntimeError
        On all ranks, if the snapshot cannot be read.
    """
    snapshot = from_root(comm, lambda: read_snapshot(path))
    first, end = id_block(case, comm)
    saved = snapshot.arrays
    share = {name: saved[name][first:end] for name in INITIAL if name in saved}
    return start_from(case, comm, InitialParticles.of(share), snapshot.time)


def scaled_npr(npr: int, ranks: int) -> int:
    """Return the resolution with `ranks` times the particles of `npr`."""
    return round(npr * math.sqrt(ranks))
