"""Plates that hit each other, looked at layer by layer where the motion is plane.

A layer is all particles of a body that start at the same z. Only rings are averaged
that no wave from the rims has reached.
"""

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.analysis.opened_run import OpenedRun
from mpisph.case import Case, case_from_dict

FloatArray = npt.NDArray[np.float64]

PERFECT = {
    "thermal": "none",
    "strength": "elastic-plastic",
    "failure": "minimum-pressure",
    "ductile": "none",
}
"""Models of the scheme that exact solutions are for; no card's go before them."""


class Layers(NamedTuple):
    """Layers of a body at one time, the lowest first.

    Attributes
    ----------
    start : ndarray, shape (n,)
        z at the beginning [m].
    fields : mapping of str to ndarray, shape (n, rings)
        Of the rings that are looked at, by the names of the fields; ``stress`` is the
        compressive stress along z [Pa].
    """

    start: FloatArray
    fields: Mapping[str, FloatArray]

    def mean(self, name: str) -> FloatArray:
        """Return the mean of a field over the rings, each counted by its mass."""
        mass = self.fields["m"]
        mean: FloatArray = (mass * self.fields[name]).sum(axis=1) / mass.sum(axis=1)
        return mean


def plates(
    flyer: str,
    target: str,
    velocity: float,
    layers: int,
    spacing: float,
    radius: float,
    end: float,
    materials: Mapping[str, Any] | None = None,
    **scheme: Any,
) -> Case:
    """Return the case of two plates that touch at z = 0 when it begins.

    Parameters
    ----------
    flyer, target : str
        Materials.
    velocity : float
        Of the flyer [m/s].
    layers : int
        Of particles in each plate.
    spacing, radius : float
        [m].
    end : float
        Output is written at the start, at half of it and at it [s].
    materials : mapping, optional
        Their tables, where they are no cards.
    **scheme
        Settings other than the defaults and `PERFECT`.
    """
    thickness = layers * spacing
    plate = {"shape": "plate", "thickness": thickness, "radius": radius}
    return case_from_dict(
        {
            "title": f"{flyer} on {target} at {velocity:g} m/s",
            "bodies": [
                {
                    **plate,
                    "name": "flyer",
                    "material": flyer,
                    "position": -thickness,
                    "velocity": velocity,
                },
                {**plate, "name": "target", "material": target, "position": 0.0},
            ],
            "resolution": {"spacing": spacing, "nph": 1.5},
            "materials": materials or {},
            "scheme": {**PERFECT, **scheme},
            "time": {"end": end},
            "output": {"times": [0.5 * end, end], "figures": False},
        }
    )


def layers_of(run: OpenedRun, body: str, index: int, radius: float) -> Layers:
    """Return the layers of a body within a radius at the start.

    Parameters
    ----------
    run : OpenedRun
        Of `plates`.
    body : str
        Its name.
    index : int
        Number of the snapshot.
    radius : float
        [m].
    """
    first, now = run.snapshots[0], run.snapshots[index]
    chosen = first.body(body) & (first["r"] < radius)
    # The lattice is a whole one: the same rings in every layer.
    order = np.lexsort((first["r"][chosen], first["z"][chosen]))
    places = first["z"][chosen][order]
    spacing = run.case.spacing
    count = 1 + round(float(places[-1] - places[0]) / spacing)
    table = {
        name: values[chosen][order].reshape(count, -1) for name, values in now.items()
    }
    table["stress"] = table["P"] - table["S_zz"]
    return Layers(places.reshape(count, -1).mean(axis=1), table)
