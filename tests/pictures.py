"""Snapshots to be drawn, and what is drawn of them, read back from the axes."""

import numpy as np
from mpi4py import MPI

from mpisph.io.snapshot import write_snapshot


def store(folder, case, index, particles):
    """Write particles as a snapshot at so many microseconds; return its path."""
    return write_snapshot(
        MPI.COMM_SELF,
        folder,
        index,
        particles,
        time=1e-6 * index,
        step=index,
        metadata={"case": case.to_toml()},
        n_total=particles.n,
    )


def dots_by_colour(axes):
    """Colours of single-coloured dots, each with z, r [mm] and size [pt] of its dots.

    Those of a legend are left out.
    """
    found = {}
    for line in axes.lines:
        if line.get_marker() == "o" and line.get_rasterized() and len(line.get_xdata()):
            z, r = line.get_data()
            rows = np.column_stack([z, r, np.full(len(z), line.get_markersize())])
            found.setdefault(line.get_color(), []).append(rows)
    return {colour: np.concatenate(rows) for colour, rows in found.items()}


def points_per_mm(axes):
    """Scale of axes [pt/mm]."""
    low, high = axes.get_xlim()
    return axes.bbox.width / axes.figure.dpi * 72.0 / (high - low)
