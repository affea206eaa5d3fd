"""Noh's problem: gas that streams to a plane, an axis or a point at one speed.

References
----------
W. F. Noh, J. Comp. Phys. 72 (1987) 78-120, section 5.
"""

import numpy as np
import numpy.typing as npt

from mpisph.verify.exact.riemann import GasState


def noh(
    distance: npt.ArrayLike, time: float, gamma: float, dimensions: int
) -> GasState:
    """Return the solution for a density and a speed of 1 at the start.

    Parameters
    ----------
    distance : array_like
        From the plane, axis or point, not negative.
    time : float
        More than zero.
    gamma : float
        Ratio of specific heats.
    dimensions : int
        1 for the plane, 2 for the axis, 3 for the point.

    Returns
    -------
    GasState
        Of the shape of `distance`; the velocity is that away from the middle.
    """
    x = np.asarray(distance, dtype=np.float64)
    behind = x < noh_shock(gamma) * time
    dense = ((gamma + 1.0) / (gamma - 1.0)) ** dimensions
    ahead = (1.0 + time / np.where(behind, 1.0, x)) ** (dimensions - 1)
    return GasState(
        np.where(behind, dense, ahead),
        np.where(behind, 0.0, -1.0),
        np.where(behind, 0.5 * (gamma - 1.0) * dense, 0.0),
    )


def noh_shock(gamma: float) -> float:
    """Return the speed of the shock, in all three geometries."""
    return 0.5 * (gamma - 1.0)
