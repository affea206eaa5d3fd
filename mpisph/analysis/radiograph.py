"""A synthetic flash radiograph of a snapshot.

The rays run along x, the third direction, onto a film in the z-y plane; y is the
lateral coordinate, and the picture is symmetric about ``y = 0``. Rays are parallel and
the source is a point: neither the divergence of a real tube's rays nor the blur of its
focus is in the picture.
"""

import math
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array

from mpisph.analysis.ring_sections import RingSections, ring_sections
from mpisph.case import Case
from mpisph.core.particles import FloatArray

PHOTON_ENERGY = 80e3
"""Energy of the photons [eV]. Flash tubes of 150 to 300 kV send a continuous spectrum;
80 keV stands for it."""

ALUMINIUM = (("Al", 1.0),)
"""What stands for a material whose composition is not known."""

_CHUNK = 8192
# Particles at a time: their profiles take some tens of MB.


class Radiograph(NamedTuple):
    """Areal density on the film.

    Attributes
    ----------
    z_edges : ndarray, shape (nz + 1,)
        Edges of the pixels along the axis [m].
    y_edges : ndarray, shape (ny + 1,)
        And across it, symmetric about zero [m].
    areal_density : ndarray, shape (ny, nz)
        Mass along the ray over the pixel's area, its mean over the pixel [kg/m2].
    """

    z_edges: FloatArray
    y_edges: FloatArray
    areal_density: FloatArray


def areal_density(
    arrays: Mapping[str, npt.NDArray[Any]],
    z_range: tuple[float, float],
    y_max: float,
    pixel: float,
    widen: float = 1.0,
    weights: FloatArray | None = None,
) -> Radiograph:
    """Project the particles onto the film.

    Every particle is a ring of its own density with a square section (see
    `rings.sections`); the integral of its chords over a pixel is analytic. So the mass
    in a view that holds all is exact, whatever the size of the pixels. Where debris has
    spread until its rings stand apart, they show one by one: stripes across the axis
    are the resolution's, not the cloud's.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        ``m`` [kg], ``r``, ``z`` [m] and ``rho`` [kg/m3], each of shape (n,), as in
        `Snapshot.arrays`.
    z_range : tuple of float
        Least and greatest z of the view [m].
    y_max : float
        The view reaches from ``-y_max`` to ``y_max`` [m].
    pixel : float
        Side of a pixel [m]. The view is extended to whole pixels.
    widen : float, optional
        Factor on the sides of the sections, at the same mass. The kernel spreads a
        particle as much as a section of ``sqrt(6) h`` does, which is a factor of 4.9
        for a smoothing length of 2 spacings.
    weights : ndarray, shape (n,), optional
        Factor on the mass of each particle, such as its attenuation relative to that of
        a reference material.

    Returns
    -------
    Radiograph

    Raises
    ------
    ValueError
        If the view, the pixel or the factor is not positive and finite.
    """
    z_low, z_high = z_range
    sizes = (z_high - z_low, y_max, pixel, widen)
    if not all(math.isfinite(size) and size > 0.0 for size in sizes):
        raise ValueError(
            f"a view of {sizes[0]:g} by {y_max:g} m in pixels of {pixel:g} m, widen = "
            f"{widen:g}: expected positive sizes"
        )
    z_edges = z_low + _multiples(pixel, z_high - z_low)
    y_half = _multiples(pixel, y_max)
    ring, z = _widened(ring_sections(arrays), widen), arrays["z"]
    volume = np.pi * (ring.outer**2 - ring.inner**2) * ring.side
    density = arrays["m"] / volume
    if weights is not None:
        density = density * weights
    seen = (z + 0.5 * ring.side > z_edges[0]) & (z - 0.5 * ring.side < z_edges[-1])
    shown = np.flatnonzero(seen)
    half = np.zeros((len(z_edges) - 1, len(y_half) - 1))
    for start in range(0, len(shown), _CHUNK):
        part = shown[start : start + _CHUNK]
        of_part = RingSections(*(x[part] for x in ring))
        heights = _heights(z[part], of_part.side, z_edges)
        half += heights @ (_chord_areas(of_part, y_half) * density[part, None])
    half = half.T / pixel**2
    return Radiograph(
        z_edges,
        np.concatenate([-y_half[:0:-1], y_half]),
        np.concatenate([half[::-1], half]),
    )


def _widened(ring: RingSections, factor: float) -> RingSections:
    side = factor * ring.side
    middle = np.maximum(0.5 * (ring.inner + ring.outer), 0.5 * side)
    return RingSections(middle - 0.5 * side, middle + 0.5 * side, side)


def _multiples(pixel: float, length: float) -> FloatArray:
    """Return the edges of as many pixels as cover a length, from 0 on [m]."""
    # A length that is a whole number of pixels but for rounding gets none more.
    n = max(math.ceil(length / pixel * (1.0 - 1e-12)), 1)
    return np.asarray(pixel * np.arange(n + 1), np.float64)


def _heights(z: FloatArray, side: FloatArray, edges: FloatArray) -> csr_array:
    """Return how much of each ring's height lies in each row of pixels.

    Returns
    -------
    csr_array, shape (nz, n)
        [m].
    """
    low, high = z - 0.5 * side, z + 0.5 * side
    last = len(edges) - 2
    first_row = np.clip(np.searchsorted(edges, low, side="right") - 1, 0, last)
    last_row = np.clip(np.searchsorted(edges, high, side="left") - 1, 0, last)
    counts = last_row - first_row + 1
    particle = np.repeat(np.arange(len(z)), counts)
    before = np.repeat(np.cumsum(counts) - counts, counts)
    row = first_row[particle] + np.arange(len(particle)) - before
    top = np.minimum(high[particle], edges[row + 1])
    overlap = np.maximum(top - np.maximum(low[particle], edges[row]), 0.0)
    return csr_array((overlap, (row, particle)), shape=(last + 1, len(z)))


def _chord_areas(ring: RingSections, edges: FloatArray) -> FloatArray:
    """Return the area of each ring, seen along the axis, between lines ``y = edge``.

    Returns
    -------
    ndarray, shape (n, len(edges) - 1)
        [m2].
    """
    areas = _disc_area(ring.outer, edges) - _disc_area(ring.inner, edges)
    return np.diff(areas, axis=1)


def _disc_area(radius: FloatArray, y: FloatArray) -> FloatArray:
    """Return the area of discs between the lines 0 and `y`, shape (n, len(y)) [m2].

    The chord at y is ``2 sqrt(R^2 - y^2)``; its integral is
    ``y sqrt(R^2 - y^2) + R^2 asin(y/R)``.
    """
    R = np.maximum(radius, np.finfo(float).tiny)[:, None]
    share = np.minimum(y / R, 1.0)
    share_area = share * np.sqrt(1.0 - share * share) + np.arcsin(share)
    return np.asarray(R * R * share_area)


def material_attenuations(case: Case, energy: float = PHOTON_ENERGY) -> FloatArray:
    """Return the mass attenuation coefficient of every material of a case [m2/kg].

    Parameters
    ----------
    case : Case
    energy : float, optional
        Of the photons [eV].

    Returns
    -------
    ndarray, shape (materials,)
        In the order of ``case.material_table``. A material without a composition is
        taken for aluminium.
    """
    materials = (case.materials[models.material] for models in case.material_table)
    parts = (tuple(material.composition.items()) for material in materials)
    return np.array([mass_attenuation(each or ALUMINIUM, energy) for each in parts])


@lru_cache(maxsize=256)
def mass_attenuation(
    composition: tuple[tuple[str, float], ...], energy: float = PHOTON_ENERGY
) -> float:
    """Return a mass attenuation coefficient, coherent scattering included [m2/kg].

    Parameters
    ----------
    composition : tuple of (str, float)
        Elements with their fractions by mass.
    energy : float, optional
        Of the photons [eV].

    References
    ----------
    Elam, Ravel and Sieber (2002), Radiat. Phys. Chem. 63, 121, as in xraydb.
    """
    # Imported here: it takes two seconds to load.
    from xraydb import mu_elam

    cm2_per_g = 0.1
    return float(sum(w * mu_elam(name, energy) for name, w in composition)) * cm2_per_g


def transmission(areal_density: FloatArray, mass_attenuation: float) -> FloatArray:
    """Return the share of the rays that pass, by Lambert and Beer's law.

    Parameters
    ----------
    areal_density : ndarray
        [kg/m2].
    mass_attenuation : float
        Of the material for the photons' energy [m2/kg]. Photons of one energy, and none
        that are scattered onto the film.

    Returns
    -------
    ndarray
        ``exp(-mass_attenuation * areal_density)``, of the same shape.
    """
    return np.asarray(np.exp(-mass_attenuation * areal_density))
