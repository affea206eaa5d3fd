"""The hole in the plate.

Between the plate's faces, and through its lips, the four shots give in mm, beside the
fits to experiments:

======  ===========  ===========  ===========  ===========  ==============
shot    npr 10       npr 10       npr 20       npr 20       Maiden,
        at 7 us      at 20 us     at 7 us      at 20 us     Nysmith
======  ===========  ===========  ===========  ===========  ==============
4-1283  26.8, 21.3   28.6, 26.3   19.4, 18.4   21.2, 20.1   14.8, 17.3
4-1291  27.2, 20.4   30.4, 27.1   20.8, 18.8   23.4, 21.1   17.1, 19.1
4-1352  25.3, 21.3   28.6, 25.1   22.0, 20.2   25.8, 23.9   19.3, 20.8
4-1353  24.3, 22.0   30.1, 28.1   23.7, 22.2   29.8, 27.1   24.7, 24.3
======  ===========  ===========  ===========  ===========  ==============

The hole of the paper's aluminium still grows at 20 us: a plate without fracture and
hardening is slow to stop. A thin plate of two or four rows of particles splits along
its middle plane, and its halves peel off; the hole of such a run says more of the rows
than of the plate. In a plate of 6061-T6, with the models of its card, it has stopped by
14 us; between the faces at npr 40, at 7, 14 and 20 us:

======  ================
4-1283  14.2, 14.7, 14.5
4-1291  16.8, 17.3, 17.1
4-1352  19.5, 20.6, 20.4
4-1353  24.1, 26.1, 26.5
======  ================
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.analysis.ring_sections import RingSections, ring_sections
from mpisph.case import Case, Sphere
from mpisph.case.bodies import Body
from mpisph.case.target import bodies_behind
from mpisph.core.particles import FloatArray
from mpisph.diagnostics.cloud import cloud_definition, target_plate


class Hole(NamedTuple):
    """The hole, by what is left of the plate.

    Attributes
    ----------
    diameter : float
        Between the plate's original faces [m]. Zero while the plate is whole; NaN
        where no plate stands.
    opening : float
        With lips that are bent out of the plate counted as plate: what one would see
        along the axis [m].
    grain : float
        One initial spacing of the particles, by which the edge may be off in either
        direction [m]. It is the resolution of the measure and no error bar: how far
        the run has converged is not in it, and weighs more (see the table above).
    """

    diameter: float
    opening: float
    grain: float


def measure_hole(arrays: Mapping[str, npt.NDArray[Any]], case: Case) -> Hole:
    """Measure the hole in a case's target plate.

    What is left of the plate is its own particles that are not faster along z than the
    cloud's least velocity. As mass per area it is compared, at every radius, with the
    original plate. The hole's edge is the radius that divides best: the sum of the mass
    left within it and the mass missing outside of it is least. There the mass per area
    passes half of the original; and neither a stray particle in the hole nor a gap in
    the plate moves it, since both are little beside what a wrong edge would leave or
    miss.

    It is taken twice: of what lies between the plate's original faces, and of all that
    is left. A lip that the shock has peeled from the plate makes the difference.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        ``body``, ``m``, ``r``, ``z``, ``u_z`` and ``rho``, each of shape (n,), in SI
        units, as in `Snapshot.arrays`.
    case : Case

    Returns
    -------
    Hole
        NaN where the case has no plate, or one that moves from the start, and where
        nothing is left of the plate.
    """
    plate = target_plate(case)
    if plate is None or plate.velocity != 0.0:
        return Hole(math.nan, math.nan, case.spacing)
    slow = np.abs(arrays["u_z"]) <= cloud_definition(case).min_velocity
    own = slow & (arrays["body"] == case.bodies.index(plate))
    ring = RingSections(*(x[own] for x in ring_sections(arrays)))
    z = arrays["z"][own]
    top = np.minimum(z + 0.5 * ring.side, plate.rear_face)
    height = np.maximum(top - np.maximum(z - 0.5 * ring.side, plate.position), 0.0)
    density = arrays["rho"][own] / case.body_models(plate).rest_density
    within, all_left = (
        2.0 * _edge(ring, density * x / plate.thickness, plate.radius)
        for x in (height, ring.side)
    )
    # A plate that has left its place, or has been shattered, has no edge.
    largest = 2.0 * plate.radius - case.spacing
    within, all_left = (x if x < largest else math.nan for x in (within, all_left))
    return Hole(within, all_left, case.spacing)


def _edge(ring: RingSections, share: FloatArray, largest: float) -> float:
    """Return the radius that divides hole and plate best [m].

    With ``a(r)`` the share of the original mass per area that is left, at most 1, the
    mass left within R and missing outside of it changes with R as ``(2a - 1) R``.

    Parameters
    ----------
    ring : RingSections, of n rings
    share : ndarray, shape (n,)
        What each adds to ``a`` between its radii.
    largest : float
        Radius of the plate [m].
    """
    places = np.concatenate([ring.inner, ring.outer, [0.0, largest]])
    steps = np.concatenate([share, -share, [0.0, 0.0]])
    order = np.argsort(places, kind="stable")
    radius = np.minimum(places[order], largest)
    left = np.minimum(np.cumsum(steps[order]), 1.0)
    change = (2.0 * left[:-1] - 1.0) * np.diff(radius**2)
    return float(radius[np.argmin(np.concatenate([[0.0], np.cumsum(change)]))])


FIT_VELOCITIES = 2e3, 8e3
"""Velocities [m/s] for which the fits are used: what guns of their time reached. The
bounds are chosen here, on the safe side."""

FIT_THICKNESSES = 0.05, 0.5
"""Thickness of the plate over the sphere's diameter for which they are used; chosen
here as well."""

_ALUMINIUM = 0.9
# Fraction of the mass that makes an alloy one of aluminium.


def fits_hold(case: Case) -> Sphere | None:
    """Return the sphere whose hole the fits to experiments describe, if any.

    Parameters
    ----------
    case : Case

    Returns
    -------
    Sphere or None
        One of aluminium that alone hits the target plate, of aluminium and at rest,
        within `FIT_VELOCITIES` and `FIT_THICKNESSES`. What stands behind the plate does
        not matter.
    """
    plate = target_plate(case)
    if plate is None or plate.velocity != 0.0:
        return None
    behind = bodies_behind(case.bodies, plate)
    others = [
        body
        for k, body in enumerate(case.bodies)
        if k not in behind and body is not plate
    ]
    if len(others) != 1 or not isinstance(others[0], Sphere):
        return None
    sphere = others[0]
    ratio = plate.thickness / (2.0 * sphere.radius)
    holds = (
        FIT_VELOCITIES[0] <= abs(sphere.velocity) <= FIT_VELOCITIES[1]
        and FIT_THICKNESSES[0] <= ratio <= FIT_THICKNESSES[1]
        and all(_is_aluminium(case, body) for body in (sphere, plate))
    )
    return sphere if holds else None


def _is_aluminium(case: Case, body: Body) -> bool:
    return case.body_material(body).composition.get("Al", 0.0) >= _ALUMINIUM


def maiden_diameter(
    sphere_diameter: float, thickness: float, velocity: float, sound_speed: float
) -> float:
    """Return the hole's diameter by Maiden's fit [m].

    ``D/d = 2.4 (V/c)(t/d)^(2/3) + 0.9``, for aluminium spheres on thin aluminium
    plates; experiments scatter about it by some 10 %. See `fits_hold`.

    References
    ----------
    Maiden, Gehring and McMillan (1963), GM Defense Research Laboratories TR 63-225.

    Parameters
    ----------
    sphere_diameter, thickness : float
        d of the sphere and t of the plate [m].
    velocity, sound_speed : float
        V of the sphere, and c, the bulk sound speed of the plate [m/s].
    """
    ratio = math.pow(thickness / sphere_diameter, 2.0 / 3.0)
    return sphere_diameter * (2.4 * velocity / sound_speed * ratio + 0.9)


def nysmith_diameter(
    sphere_diameter: float, thickness: float, velocity: float
) -> float:
    """Return the hole's diameter by Nysmith's fit [m].

    ``D/d = 0.88 V^0.5 (t/d)^0.45 + 1`` with V in km/s, for aluminium spheres on thin
    aluminium plates; experiments scatter about it by some 10 %. See `fits_hold`.

    References
    ----------
    Nysmith and Denardo (1969), NASA TN D-5492.

    Parameters
    ----------
    sphere_diameter, thickness : float
        d of the sphere and t of the plate [m].
    velocity : float
        V of the sphere [m/s].
    """
    ratio = math.pow(thickness / sphere_diameter, 0.45)
    return sphere_diameter * (0.88 * math.sqrt(velocity / 1e3) * ratio + 1.0)
