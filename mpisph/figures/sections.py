"""The section that a particle has in a picture.

It loads nothing that draws, so that every viewer can use it.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from mpisph.analysis.ring_sections import ring_sections
from mpisph.case import Case
from mpisph.case.profiles import sampled_densities
from mpisph.core.particles import FloatArray


def section_area(arrays: Mapping[str, npt.NDArray[Any]], case: Case) -> FloatArray:
    """Return the area that the section of each particle takes of a picture.

    A ring of mass m and density rho has the section ``m/(2 pi r_m rho)`` in the r-z
    plane, with the mean radius r_m of `ring_sections` (R1). At the start of a run that
    is the cell of its lattice; it is bounded at the axis, and shrinks as matter flies
    apart. Matter thinner than at rest has the section that its mass has at rest: there
    is nothing between the drops of a spray or the shreds of a gas, and dots as large as
    what they spread over would hide all else.

    Parameters
    ----------
    arrays : mapping of str to ndarray
        ``m`` [kg], ``r`` [m], ``rho`` [kg/m3] and ``body``, each of shape (n,), as in
        `Snapshot.arrays`.
    case : Case
        A body that is given a density of its own, less than that of its material at
        rest, is at rest at the least one of it.

    Returns
    -------
    ndarray, shape (n,)
        [m2].
    """
    rho = np.maximum(arrays["rho"], rest_densities(case)[arrays["body"]])
    area: FloatArray = ring_sections({**arrays, "rho": rho}).side ** 2
    return area


def rest_densities(case: Case) -> FloatArray:
    """Return for each body the density below which its matter counts as spread [kg/m3].

    That of its material at rest, or the least one that it is given.
    """
    found = []
    for body in case.bodies:
        rest = case.body_models(body).rest_density
        found.append(min(rest, float(sampled_densities(body, rest).min())))
    return np.array(found)
