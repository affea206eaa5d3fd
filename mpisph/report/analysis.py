"""The analyses of the debris that a run's page shows, of one snapshot at a time."""

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy.typing as npt

from mpisph.analysis.fragments import find_fragments
from mpisph.analysis.hole import (
    FIT_VELOCITIES,
    fits_hold,
    maiden_diameter,
    measure_hole,
    nysmith_diameter,
)
from mpisph.case import Case, Plate
from mpisph.diagnostics.cloud import (
    cloud_definition,
    in_cloud,
    target_plate,
)
from mpisph.figures.debris import draw_fragments, draw_radiograph, draw_spray
from mpisph.figures.style import Out
from mpisph.io.snapshot import Snapshot
from mpisph.report.page import NONE, Table

HEAVIEST = 10
"""Fragments listed."""

SCATTER = 0.1
"""Of experiments about the fits to holes."""

Arrays = dict[str, npt.NDArray[Any]]


class AnalysisFigure(NamedTuple):
    """A figure made of one snapshot.

    Attributes
    ----------
    title : str
        What it shows.
    caption : str
        How to read it.
    draw : callable
        Draws a snapshot of a case into a file or memory.
    """

    title: str
    caption: str
    draw: Callable[[Snapshot, Case, Out], None]


ANALYSES: tuple[AnalysisFigure, ...] = (
    AnalysisFigure(
        "Radiograph",
        "What X-rays across the axis would show, above the particles at the same "
        "scale. A particle is a ring: where the debris has spread out, stripes are "
        "single rings.",
        draw_radiograph,
    ),
    AnalysisFigure(
        "Spray",
        "Everything that moves, by the angle between its velocity and the axis: mass, "
        "axial and radial momentum per degree. The cloud is below 90 degrees, the "
        "ejecta above.",
        draw_spray,
    ),
    AnalysisFigure(
        "Fragments",
        "Mass against axial velocity, and the number of fragments at least as heavy. A "
        "fragment is a ring of touching particles, without those that a model has "
        "broken. Their number depends on the resolution, and without such a model on "
        "the distance that counts as touching.",
        draw_fragments,
    ),
)
"""The figures, in the order in which they are shown."""


def has_debris(arrays: Arrays, case: Case) -> bool:
    """Say whether something has gone through a plate and left a cloud behind it.

    Where a plate hits a plate, what lies behind the rear face is no debris.

    Parameters
    ----------
    arrays : dict of str to ndarray
        As in `Snapshot.arrays`.
    case : Case
    """
    if all(isinstance(body, Plate) for body in case.bodies):
        return False
    return bool(
        in_cloud(
            arrays["body"], arrays["z"], arrays["u_z"], cloud_definition(case)
        ).any()
    )


def analysis_tables(snapshot: Snapshot, case: Case) -> list[Table]:
    """Return what the analyses say in numbers.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case

    Returns
    -------
    list of Table
        The heaviest fragments, and the hole where there is a plate at rest.
    """
    tables = [fragments_table(snapshot, case), hole_table(snapshot, case)]
    return [table for table in tables if table.rows]


def fragments_table(snapshot: Snapshot, case: Case) -> Table:
    """Return the heaviest fragments of the cloud.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case

    Returns
    -------
    Table
        Without rows where there is no cloud.
    """
    found = find_fragments(snapshot.arrays, cloud_definition(case))
    names = [case.bodies[k].name for k in found.body_mass.argmax(axis=1)[:HEAVIEST]]
    whole = found.mass.sum() + found.broken
    rows: list[tuple[str, ...]] = [
        (
            name,
            _mg(found.mass[index]),
            f"{100 * found.mass[index] / whole:.1f}",
            str(found.particles[index]),
            f"{1e-3 * found.u_z[index]:.2f}",
            f"{1e-3 * found.u_r[index]:.2f}",
            f"{1e3 * found.z[index]:.1f}",
            f"{1e3 * found.r[index]:.1f}",
        )
        for index, name in enumerate(names)
    ]
    if found.broken:
        share = f"{100 * found.broken / whole:.1f}"
        rows.append(("broken, in none", _mg(found.broken), share, *[NONE] * 5))
    heads = (
        "mostly", "mass [mg]", "share [%]", "particles", "u_z [km/s]", "u_r [km/s]",
        "z [mm]", "r [mm]",
    )  # fmt: skip
    title = f"The heaviest fragments, of {len(found.mass)}" if names else "Fragments"
    caption = "Share: of the cloud's mass. Positions and velocities are means by mass."
    return Table(title, heads, list(rows), caption, numbers=True)


def _mg(mass: float) -> str:
    """Return a mass [kg] in mg, with three digits or more."""
    return f"{1e6 * mass:.3g}" if mass < 1e-3 else f"{1e6 * mass:.0f}"


def hole_table(snapshot: Snapshot, case: Case) -> Table:
    """Return the hole's diameter, and what fits to experiments give.

    Parameters
    ----------
    snapshot : Snapshot
    case : Case

    Returns
    -------
    Table
        Without rows where no plate stands. The fits stand there where they hold.
    """
    hole = measure_hole(snapshot.arrays, case)
    plate = target_plate(case)
    title, heads = "Hole in the plate", ("", "diameter [mm]")
    if plate is None or math.isnan(hole.diameter):
        return Table(title, heads, [])
    rows: list[tuple[str, ...]] = [
        ("computed, between the faces", f"{1e3 * hole.diameter:.1f}"),
        ("computed, through the lips", f"{1e3 * hole.opening:.1f}"),
        ("grain of the measure", f"{1e3 * hole.grain:.1f}"),
        *_fits(case, plate),
    ]
    caption = (
        "Grain: one initial particle spacing, within which the edge is found. It is no "
        "error bar: on the four shots the hole changes by 0.6 to 7.4 mm from NPR 10 to "
        "20, and it may still grow."
    )
    if fits_hold(case):
        caption += (
            " Fits to experiments with aluminium spheres and thin aluminium plates at "
            f"{1e-3 * FIT_VELOCITIES[0]:g} to {1e-3 * FIT_VELOCITIES[1]:g} km/s: a "
            f"band of ±{100 * SCATTER:g} %, about which they scatter, not a target."
        )
    return Table(title, heads, list(rows), caption, numbers=True)


def _fits(case: Case, plate: Plate) -> list[tuple[str, str]]:
    """Return the bands of the fits, for a sphere that hits the plate."""
    sphere = fits_hold(case)
    if sphere is None:
        return []
    diameter, velocity = 2.0 * sphere.radius, abs(sphere.velocity)
    sound = case.body_models(plate).bulk_sound_speed
    fits = {
        "Maiden": maiden_diameter(diameter, plate.thickness, velocity, sound),
        "Nysmith": nysmith_diameter(diameter, plate.thickness, velocity),
    }
    return [
        (
            f"{name}’s fit",
            f"{1e3 * (1 - SCATTER) * size:.1f} {NONE} {1e3 * (1 + SCATTER) * size:.1f}",
        )
        for name, size in fits.items()
    ]
