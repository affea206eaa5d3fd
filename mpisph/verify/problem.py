"""What a verification problem is made of: runs to make, and what is checked on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from mpisph.analysis.opened_run import OpenedRun, OpenedSnapshot
from mpisph.case import Case
from mpisph.figures.style import Out

Array = npt.NDArray[Any]
"""One value for each particle, shape (n,)."""


class Check(NamedTuple):
    """A measured quantity beside the exact one.

    Attributes
    ----------
    quantity : str
    unit : str
        Of all numbers; empty for a ratio.
    measured, exact : float
    low, high : float
        It passes from the one to the other; infinite where there is no such bound.
    order : float or None
        Observed order of convergence in the particle spacing.
    """

    quantity: str
    unit: str
    measured: float
    exact: float
    low: float
    high: float
    order: float | None = None

    @classmethod
    def within(
        cls,
        quantity: str,
        measured: float,
        exact: float,
        tolerance: float,
        unit: str = "",
        order: float | None = None,
    ) -> Check:
        """Return a check that passes not farther than `tolerance` from `exact`."""
        low, high = exact - tolerance, exact + tolerance
        return cls(quantity, unit, float(measured), exact, low, high, order)

    @classmethod
    def at_most(
        cls,
        quantity: str,
        measured: float,
        high: float,
        exact: float = 0.0,
        unit: str = "",
        order: float | None = None,
    ) -> Check:
        """Return a check of what may not be larger than `high`, such as an error."""
        return cls(quantity, unit, float(measured), exact, -math.inf, high, order)

    @classmethod
    def at_least(
        cls,
        quantity: str,
        measured: float,
        low: float,
        exact: float,
        unit: str = "",
        order: float | None = None,
    ) -> Check:
        """Return a check of what may not be smaller than `low`, such as a peak."""
        return cls(quantity, unit, float(measured), exact, low, math.inf, order)

    @property
    def passed(self) -> bool:
        """Whether it is within the bounds; what is no number is not."""
        return bool(self.low <= self.measured <= self.high)

    @property
    def bound(self) -> str:
        """The bounds in words."""
        if self.low == -math.inf:
            return f"≤ {self.high:.4g}"
        if self.high == math.inf:
            return f"≥ {self.low:.4g}"
        return f"±{0.5 * (self.high - self.low):.3g}"


class Setup(NamedTuple):
    """A run to make.

    Attributes
    ----------
    label : str
        What tells it from the others of its problem, such as ``1/80``.
    case : Case
    particles : mapping of str to ndarray, optional
        Particles to start from, see `mpisph.run`.
    """

    label: str
    case: Case
    particles: Mapping[str, Array] | None = None


class Solved(NamedTuple):
    """A completed run.

    Attributes
    ----------
    label : str
        See `Setup`.
    run : OpenedRun
    """

    label: str
    run: OpenedRun

    @property
    def first(self) -> OpenedSnapshot:
        """The particles at the start; those at any time are in the same order."""
        return self.run.snapshots[0]

    @property
    def last(self) -> OpenedSnapshot:
        """The particles at the end."""
        return self.run.snapshots[-1]


class Problem(NamedTuple):
    """A problem with a known solution.

    Attributes
    ----------
    name : str
        As the command line knows it.
    title : str
        In a line.
    source : str
        Paper or book, with the equation, of the exact solution.
    setups : callable
        Returns the runs to make, the coarsest first, for whether they are to be quick:
        then all together take a second or two.
    check : callable
        Returns what is checked on all these runs, completed and in their order.
    draw : callable
        Draws a figure of them.
    caption : str
        What the figure shows.
    """

    name: str
    title: str
    source: str
    setups: Callable[[bool], Sequence[Setup]]
    check: Callable[[Sequence[Solved]], Sequence[Check]]
    draw: Callable[[Sequence[Solved], Out], None]
    caption: str


def observed_order(spacings: Sequence[float], errors: Sequence[float]) -> float | None:
    """Return the order with which errors fall, the slope in logarithms.

    Parameters
    ----------
    spacings, errors : sequence of float
        Of the same runs.

    Returns
    -------
    float or None
        None for a single run, and where an error is zero or no number.
    """
    size = np.abs(np.array(errors, dtype=np.float64))
    if size.size < 2 or not np.all(np.isfinite(size) & (size > 0.0)):
        return None
    return float(np.polyfit(np.log(spacings), np.log(size), 1)[0])
