"""Cases of an elastic solid whose exact solutions are those of linear elasticity."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.spatial import KDTree

from mpisph.case.plausibility import LARGEST_CFL, LEAST_DAMPING
from mpisph.verify.exact.elasticity import Elastic
from mpisph.verify.problem import Array, Solved

ALUMINIUM = Elastic(2700.0, 76e9, 26e9)


def material_of(solid: Elastic, yield_strength: float | None = None) -> dict[str, Any]:
    """Return a material of a case that stays elastic, and carries any tension.

    Parameters
    ----------
    solid : Elastic
    yield_strength : float, optional
        [Pa]; by default so high that it never yields.
    """
    G = solid.shear_modulus
    return {
        "rho0": solid.density,
        "eos": "linear",
        "linear": {"bulk_modulus": solid.bulk_modulus},
        "elastic-plastic": {
            "shear_modulus": G,
            "yield_strength": G if yield_strength is None else yield_strength,
        },
        "minimum-pressure": {"value": "-inf", "mode": "off"},
    }


def solid_case(
    title: str,
    body: Mapping[str, Any],
    spacing: float,
    times: list[float],
    *,
    solid: Elastic = ALUMINIUM,
    yield_strength: float | None = None,
    viscosity: float = 1.0,
) -> dict[str, Any]:
    """Return the case of one body of an elastic solid, to be built.

    Parameters
    ----------
    title : str
    body : mapping
        Its shape and sizes.
    spacing : float
        Of the particles [m].
    times : list of float
        Of output [s].
    solid, yield_strength
        See `material_of`.
    viscosity : float, optional
        Both coefficients.
    """
    return {
        "title": title,
        "bodies": [{"name": "body", "material": "solid", "velocity": 0.0, **body}],
        "materials": {"solid": material_of(solid, yield_strength)},
        "resolution": {"spacing": spacing, "nph": 1.5},
        "scheme": {
            "viscosity": {"alpha": viscosity, "beta": viscosity},
            "heat": {"enabled": False},
        },
        "time": {"cfl": LARGEST_CFL if viscosity < LEAST_DAMPING else 0.3},
        "output": {"times": times, "figures": False},
    }


def ring_body(ring: float, section: float) -> dict[str, Any]:
    """Return the body whose particles are those of `round_section`.

    Parameters
    ----------
    ring, section : float
        Radii of the centre line of a ring and of its round section [m].
    """
    return {
        "shape": "cylinder",
        "radius": ring + section,
        "inner_radius": ring - section,
        "length": 2.0 * section,
        "position": -section,
    }


def round_section(
    ring: float, section: float, spacing: float, solid: Elastic = ALUMINIUM
) -> dict[str, Array]:
    """Return particles at rest that fill a ring with a round section.

    Parameters
    ----------
    ring, section
        See `ring_body`.
    spacing : float
        [m].
    """
    along = np.arange(-section + 0.5 * spacing, section, spacing)
    x, z = (each.ravel() for each in np.meshgrid(along, along))
    inside = np.hypot(x, z) < section
    x, z = x[inside], z[inside]
    r = ring + x
    return {
        "body": np.zeros(x.size, dtype=np.int64),
        "m": 2.0 * np.pi * r * solid.density * spacing**2,
        "r": r,
        "z": z,
        "u_r": np.zeros(x.size),
        "u_z": np.zeros(x.size),
    }


def lost_distance(solved: Solved) -> tuple[Array, Array]:
    """Return times [s] and by how much the closest particles have come closer.

    It is the largest part that any particle has lost of the distance to its nearest;
    mirror images beyond the axis are among these.
    """
    times, distances = [], []
    for at in solved.run.snapshots:
        r, z = at["r"], at["z"]
        points = np.column_stack([np.r_[r, -r], np.r_[z, z]])
        distance = KDTree(points).query(points[: r.size], k=2)[0][:, 1]
        times.append(at.time)
        distances.append(distance)
    return np.array(times), 1.0 - (np.array(distances) / distances[0]).min(axis=1)


def zero_crossings(times: Array, values: Array) -> list[float]:
    """Return the times at which values change their sign, interpolated between."""
    k = np.flatnonzero(np.signbit(values[:-1]) != np.signbit(values[1:]))
    parts = values[k] / (values[k] - values[k + 1])
    return [float(t) for t in times[k] + parts * (times[k + 1] - times[k])]
