"""The initial particles of a case: every body on its own lattice of rings."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case import Body, Case, Sphere, SphericalShell
from mpisph.case.bodies import Annulus, Rectangle
from mpisph.errors import CaseError, Problem

__all__ = ["InitialParticles", "check_count", "discretise", "particle_count"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

_MOST_PARTICLES = 1_000_000_000


class InitialParticles(NamedTuple):
    """The particles of a case at the start, in the order of their ids.

    Attributes
    ----------
    id : ndarray of int64, shape (n,)
        0 .. n-1: body by body, along z, and within a row along r.
    body : ndarray of int64, shape (n,)
        Index in ``case.bodies``.
    material : ndarray of int64, shape (n,)
        Index in ``case.material_table``.
    m : ndarray, shape (n,)
        Mass of the whole ring [kg].
    r, z : ndarray, shape (n,)
        Position [m].
    u_z : ndarray, shape (n,)
        Axial velocity [m/s].
    rho : ndarray, shape (n,)
        Density [kg/m^3].
    h : ndarray, shape (n,)
        Smoothing length [m].
    u_r, E, S_rr, S_zz, S_rz : ndarray, shape (n,), or None
        Radial velocity [m/s], energy [J/kg] and stress [Pa]; None is zero, as at the
        start of every case.
    """

    id: IntArray
    body: IntArray
    material: IntArray
    m: FloatArray
    r: FloatArray
    z: FloatArray
    u_z: FloatArray
    rho: FloatArray
    h: FloatArray
    u_r: FloatArray | None = None
    E: FloatArray | None = None
    S_rr: FloatArray | None = None
    S_zz: FloatArray | None = None
    S_rz: FloatArray | None = None


class _Lattice(NamedTuple):
    """Particle centres of one body [m] and the section of one particle [m^2]."""

    r: FloatArray
    z: FloatArray
    area: float


class _Grid(NamedTuple):
    """Cells of a rectangle: numbers along z and r, and sizes [m]."""

    nz: int
    nr: int
    dz: float
    dr: float


def particle_count(case: Case) -> int:
    """Estimate the number of particles without making them.

    Parameters
    ----------
    case : Case
        The case.

    Returns
    -------
    int
        Exact for plates and cylinders; for spheres and shells the section over
        the area of a cell, which is nearly exact.
    """
    return sum(_body_count(body, case.spacing) for body in case.bodies)


def _body_count(body: Body, spacing: float) -> int:
    if isinstance(body, Sphere | SphericalShell):
        inner, outer, _ = body.region
        return round(0.5 * math.pi * (outer**2 - inner**2) / spacing**2)
    grid = _grid(body.region, spacing)
    return grid.nz * grid.nr


def discretise(case: Case) -> InitialParticles:
    """Fill the bodies with particles.

    Spheres and shells take a square lattice that has the axis between two
    columns; plates and cylinders are divided into whole cells, so that their mass
    is exact.

    Parameters
    ----------
    case : Case
        The case.

    Returns
    -------
    InitialParticles
        All particles; the same on every rank that asks.

    Raises
    ------
    CaseError
        If there would be more than 10^9 particles.
    """
    check_count(case)
    lattices = [_lattice(body, case.spacing) for body in case.bodies]
    counts = np.array([lattice.r.size for lattice in lattices])
    density = [case.body_material(body).rho0 for body in case.bodies]
    area = np.array([lattice.area for lattice in lattices])
    body = np.repeat(np.arange(len(case.bodies), dtype=np.int64), counts)
    r = np.concatenate([lattice.r for lattice in lattices])
    rho = np.array(density)[body]
    return InitialParticles(
        id=np.arange(r.size, dtype=np.int64),
        body=body,
        material=np.array(case.material_indices, dtype=np.int64)[body],
        m=2.0 * np.pi * r * rho * area[body],
        r=r,
        z=np.concatenate([lattice.z for lattice in lattices]),
        u_z=np.array([each.velocity for each in case.bodies], dtype=np.float64)[body],
        rho=rho,
        h=np.full(r.size, case.smoothing_length),
    )


def check_count(case: Case) -> None:
    """Refuse a case of absurdly many particles, before any is made.

    Parameters
    ----------
    case : Case

    Raises
    ------
    CaseError
        If there would be more than 10^9 particles.
    """
    count = particle_count(case)
    if count > _MOST_PARTICLES:
        problem = Problem(
            f"a spacing of {case.spacing:g} m makes about {count:.1e} particles; "
            f"expected at most {_MOST_PARTICLES:.0e}",
            key="resolution",
        )
        raise CaseError([problem])


def _lattice(body: Body, spacing: float) -> _Lattice:
    if isinstance(body, Sphere | SphericalShell):
        return _round_lattice(body.region, spacing)
    return _cell_lattice(body.region, spacing)


def _round_lattice(region: Annulus, spacing: float) -> _Lattice:
    """Return the lattice points (i + 1/2, j + 1/2) dx between the two radii."""
    n = math.ceil(region.outer / spacing)
    i = np.arange(n, dtype=np.float64) + 0.5
    j = np.arange(-n, n, dtype=np.float64) + 0.5
    squared = (j**2)[:, np.newaxis] + i**2
    inside = (squared >= (region.inner / spacing) ** 2) & (
        squared <= (region.outer / spacing) ** 2
    )
    rows, columns = np.nonzero(inside)
    return _Lattice(
        r=i[columns] * spacing,
        z=region.centre + j[rows] * spacing,
        area=spacing**2,
    )


def _cell_lattice(region: Rectangle, spacing: float) -> _Lattice:
    """Return the centres of the cells that divide a rectangle evenly."""
    grid = _grid(region, spacing)
    r = region.inner + (np.arange(grid.nr, dtype=np.float64) + 0.5) * grid.dr
    z = region.low + (np.arange(grid.nz, dtype=np.float64) + 0.5) * grid.dz
    return _Lattice(
        r=np.tile(r, grid.nz), z=np.repeat(z, grid.nr), area=grid.dr * grid.dz
    )


def _grid(region: Rectangle, spacing: float) -> _Grid:
    width, height = region.outer - region.inner, region.high - region.low
    nr = max(1, round(width / spacing))
    nz = max(1, round(height / spacing))
    return _Grid(nz=nz, nr=nr, dz=height / nz, dr=width / nr)
