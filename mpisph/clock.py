"""The offset between a run's clock and the experiment's.

A run counts time from first contact; the experiment's nominal exposure times do not
(their zero lies about a microsecond later). One offset is fitted on a shot that was
exposed twice, and then applied unchanged to the others.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.case import Case
from mpisph.particles import FloatArray

SEARCH_STEP = 1e-9
"""The offset is searched on a grid of this step [s]; exposures are quoted to 1 us."""


class ClockFit(NamedTuple):
    """The fitted offset and what it leaves.

    Attributes
    ----------
    offset : float
        Added to the nominal exposure times [s].
    errors : ndarray, shape (figures,)
        Relative errors of R_b and L_b, exposure by exposure, at the offset.
    separate : ndarray, shape (figures,)
        The offset that each figure alone would ask for [s]: their spread is the
        uncertainty of the fit.
    names : tuple of str
        What each figure is.
    """

    offset: float
    errors: FloatArray
    separate: FloatArray
    names: tuple[str, ...]


def fit_clock(history: npt.NDArray[Any], case: Case) -> ClockFit:
    """Fit the offset that makes the relative errors' sum of squares least.

    Parameters
    ----------
    history : structured ndarray
        From `history.read_history`: the cloud at every step.
    case : Case
        With measured exposures.

    Returns
    -------
    ClockFit

    Raises
    ------
    ValueError
        If the case has no exposures, or if the best offset lies at the end of what the
        run covers.
    """
    exposures = case.measured.exposures if case.measured else ()
    figures = [
        (f"{name} at {e.time * 1e6:g} us", e.time, measured, column)
        for e in exposures
        for name, measured, column in (
            ("R_b", e.radius, "cloud_radius"),
            ("L_b", e.length, "cloud_length"),
        )
        if measured is not None
    ]
    if not figures:
        raise ValueError("the case has no measured exposure to fit the clock on")
    time = history["time"]
    earliest = min(e.time for e in exposures)
    latest = max(e.time for e in exposures)
    offsets = np.arange(-earliest, time[-1] - latest, SEARCH_STEP)
    errors = np.array(
        [
            np.interp(nominal + offsets, time, history[column]) / measured - 1.0
            for _, nominal, measured, column in figures
        ]
    )
    if offsets.size == 0:
        raise ValueError("the run ends before the last exposure")
    best = int(np.argmin((errors**2).sum(axis=0)))
    if best == offsets.size - 1:
        raise ValueError(
            f"the best offset lies beyond the end of the run: let it run past "
            f"{time[-1] * 1e6:.2f} us"
        )
    return ClockFit(
        offset=float(offsets[best]),
        errors=errors[:, best],
        separate=offsets[np.abs(errors).argmin(axis=1)],
        names=tuple(name for name, *_ in figures),
    )
