"""Rods that hit a rigid, frictionless wall, the plane z = 0, from below."""

from collections.abc import Mapping
from typing import Any

from mpisph.analysis.opened_run import OpenedSnapshot
from mpisph.analysis.ring_sections import ring_sections
from mpisph.case import Case, case_from_dict
from mpisph.case.plausibility import LARGEST_CFL

VISCOSITY = 0.1, 0.5
"""Coefficients alpha and beta: shocks are weak, and viscous heat is to be small."""


def rod_case(
    title: str,
    radius: float,
    length: float,
    count: int,
    velocity: float,
    end: float,
    material: str,
    constants: Mapping[str, Any],
) -> Case:
    """Return the case of a rod that hits the wall.

    Parameters
    ----------
    title : str
    radius, length : float
        [m].
    count : int
        Particles along the radius.
    velocity : float
        [m/s].
    end : float
        [s].
    material : str
        A card or a name of its own.
    constants : mapping of str to Any
        Its table in the case.
    """
    alpha, beta = VISCOSITY
    rod = {
        "name": "rod",
        "shape": "cylinder",
        "radius": radius,
        "length": length,
        "position": -length,
        "velocity": velocity,
        "material": material,
    }
    return case_from_dict(
        {
            "title": title,
            "bodies": [rod],
            "boundary": {"z_max": 0.0},
            "materials": {
                material: {"failure": "none", "ductile": "none", **constants}
            },
            "resolution": {"spacing": radius / count, "nph": 1.5},
            "scheme": {
                "viscosity": {"alpha": alpha, "beta": beta},
                "heat": {"enabled": False},
            },
            "time": {"end": end, "cfl": LARGEST_CFL},
            "output": {"figures": False},
        }
    )


def rod_length(at: OpenedSnapshot, spacing: float) -> float:
    """Return the length of a rod [m]; its free end keeps the spacing [m]."""
    return 0.5 * spacing - float(at["z"].min())


def foot_diameter(at: OpenedSnapshot, spacing: float) -> float:
    """Return the diameter of a rod within a spacing [m] of the wall [m]."""
    outer = ring_sections(at.arrays).outer
    return 2.0 * float(outer[at["z"] > -spacing].max())
