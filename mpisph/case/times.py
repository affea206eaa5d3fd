"""The times at which a case asks for output."""

from __future__ import annotations

import math
from collections.abc import Iterable

from mpisph.case.sections import Exposure, Measured, Output

__all__ = [
    "exposure_times",
    "merge_times",
    "periodic_times",
    "requested_times",
    "same_time",
]

_ALIKE = 1e-6
# Relative; output times that agree to rounding have been merged into one.

# Times nearer to each other than this fraction of the run are one and the same.
_SAME_TIME = 1e-9


def same_time(one: float, other: float) -> bool:
    """Say whether two times are the same but for rounding."""
    return math.isclose(one, other, rel_tol=_ALIKE)


def exposure_times(exposure: Exposure, measured: Measured) -> tuple[float, float]:
    """Return the nominal time of an exposure, and that with the clock offset [s]."""
    return exposure.time, exposure.time + measured.clock_offset


def requested_times(output: Output, measured: Measured | None) -> list[float]:
    """Return the times that are named one by one.

    Parameters
    ----------
    output : Output
        Section with the snapshot times.
    measured : Measured or None
        Section with the exposures, whose nominal and offset times both count.

    Returns
    -------
    list of float
        Times [s], unsorted, repeats possible.
    """
    times = list(output.times)
    if measured is not None:
        for exposure in measured.exposures:
            times += exposure_times(exposure, measured)
    return times


def periodic_times(every: float | None, end: float) -> list[float]:
    """Return the multiples of `every` up to `end` [s]."""
    if every is None:
        return []
    count = math.floor(end / every * (1.0 + _SAME_TIME))
    # Twelve digits drop the rounding of the product: 5 x 1e-6 becomes 5e-6.
    return [float(f"{k * every:.12g}") for k in range(1, count + 1)]


def merge_times(times: Iterable[float], end: float) -> tuple[float, ...]:
    """Return the distinct times in (0, end], sorted, with `end` as the last.

    Times that agree to rounding are merged, so that no step has to be of the
    order of the rounding error.
    """
    gap = _SAME_TIME * end
    merged: list[float] = []
    for time in sorted(times):
        if gap < time < end - gap and (not merged or time - merged[-1] > gap):
            merged.append(time)
    return (*merged, end)
