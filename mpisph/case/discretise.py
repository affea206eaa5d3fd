"""The initial particles of a case: every body on its own lattice of rings."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case import Body, Case, Sphere, SphericalShell
from mpisph.case.bodies import Annulus, Rectangle
from mpisph.case.counts import grid

__all__ = ["InitialParticles", "discretise"]

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]


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
    """
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


def _lattice(body: Body, spacing: float) -> _Lattice:
    if isinstance(body, Sphere | SphericalShell):
        return _round_lattice(body.region, spacing)
    return _cell_lattice(body.region, spacing)


def _round_lattice(region: Annulus, spacing: float) -> _Lattice:
    """Return the lattice points (i + 1/2, j + 1/2) dx between the two radii."""
    inner2, outer2 = (region.inner / spacing) ** 2, (region.outer / spacing) ** 2
    n = math.ceil(region.outer / spacing)
    j = np.arange(-n, n, dtype=np.float64) + 0.5
    # Only what may lie within: of the square around a thin shell that is little.
    first: FloatArray = np.maximum(np.floor(_half_chord(inner2, j) - 0.5) - 1.0, 0.0)
    last = np.ceil(_half_chord(outer2, j) - 0.5) + 1.0
    length = (last - first + 1.0).astype(np.int64)
    rows = np.repeat(np.arange(2 * n), length)
    before = np.repeat(np.cumsum(length) - length, length)
    i = first[rows] + (np.arange(rows.size) - before) + 0.5
    squared = (j**2)[rows] + i**2
    inside = (squared >= inner2) & (squared <= outer2)
    return _Lattice(
        r=i[inside] * spacing,
        z=region.centre + j[rows[inside]] * spacing,
        area=spacing**2,
    )


def _half_chord(radius2: float, j: FloatArray) -> FloatArray:
    """Return the half width of a circle at heights `j`; zero beyond it."""
    width: FloatArray = np.sqrt(np.maximum(radius2 - j**2, 0.0))
    return width


def _cell_lattice(region: Rectangle, spacing: float) -> _Lattice:
    """Return the centres of the cells that divide a rectangle evenly."""
    nz, nr, dz, dr = grid(region, spacing)
    r = region.inner + (np.arange(nr, dtype=np.float64) + 0.5) * dr
    z = region.low + (np.arange(nz, dtype=np.float64) + 0.5) * dz
    return _Lattice(r=np.tile(r, nz), z=np.repeat(z, nr), area=dr * dz)
