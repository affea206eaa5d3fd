"""How many particles the bodies hold, without making them."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

from mpisph.case.bodies import Annulus, Body, Rectangle

__all__ = ["Grid", "body_count", "grid", "particle_count"]


class Grid(NamedTuple):
    """Cells of a rectangle: numbers along z and r, and sizes [m]."""

    nz: int
    nr: int
    dz: float
    dr: float


def grid(region: Rectangle, spacing: float) -> Grid:
    """Return the whole cells into which a rectangle is divided.

    Parameters
    ----------
    region : Rectangle
        Section of a plate or cylinder [m].
    spacing : float
        Size that the cells should have [m].

    Returns
    -------
    Grid
    """
    width, height = region.outer - region.inner, region.high - region.low
    nr = max(1, round(width / spacing))
    nz = max(1, round(height / spacing))
    return Grid(nz=nz, nr=nr, dz=height / nz, dr=width / nr)


def particle_count(bodies: Iterable[Body], spacing: float) -> int:
    """Estimate the number of particles of all bodies.

    Parameters
    ----------
    bodies : iterable of Body
    spacing : float
        Particle spacing [m].

    Returns
    -------
    int
        Exact for plates and cylinders; for spheres and shells the section over
        the area of a cell, which is nearly exact.
    """
    return sum(body_count(body, spacing) for body in bodies)


def body_count(body: Body, spacing: float) -> int:
    """Estimate the number of particles of one body; see `particle_count`."""
    region = body.region
    if isinstance(region, Annulus):
        section = 0.5 * math.pi * (region.outer**2 - region.inner**2)
        return round(section / spacing**2)
    cells = grid(region, spacing)
    return cells.nz * cells.nr
