"""The offset between a run's clock and the experiment's.

A run counts time from first contact; the experiment's nominal exposure times do not
(their zero lies about a microsecond later). One offset is fitted on a shot that was
exposed twice, and then applied unchanged to the others, for which it is a prediction.

Its uncertainty has two parts. The numerical one is what the offset moves with the
resolution. The other is how far the figures disagree about it: each of R_b and L_b at
each exposure asks for an offset of its own. Both R_b and L_b are those of outermost
particles (see `convergence`).
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt
from rich.table import Table

from mpisph.analysis.convergence import Convergence, converge, explain
from mpisph.case import Body, Case
from mpisph.case.partial_case import default_reference
from mpisph.core.errors import MpisphError
from mpisph.core.particles import FloatArray
from mpisph.io.history import HISTORY_FILE, read_history
from mpisph.io.result import RESULT_FILE, read_result
from mpisph.io.run_folder import known_status

T = TypeVar("T")

PREDICTIONS = (
    "The offset is fitted on this shot alone. It goes unchanged into the cases of the "
    "other shots: nothing of them is fitted, their R_b and L_b are predictions."
)
"""What the offset is to other shots; said wherever it is shown."""

_GRID = 4097
# Offsets of one look at the sum of squares; each look is at two steps of the last.

_FINEST = 1e-10
# Step of the last look [s]. Exposures are quoted to 1 us.

_AT_THE_END = 1e-9
# Offsets as near as this to the last that a run covers may lie beyond it [s].


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
    beyond : ndarray of bool, shape (figures,)
        Whether the run ends before a figure reaches what was measured: its separate
        offset is then a lower bound.
    names : tuple of str
        What each figure is.
    """

    offset: float
    errors: FloatArray
    separate: FloatArray
    beyond: npt.NDArray[np.bool_]
    names: tuple[str, ...]

    @property
    def rms(self) -> float:
        """Root of the mean square of the relative errors."""
        return float(np.sqrt((self.errors**2).mean()))


class ClockRun(NamedTuple):
    """A run that the clock was fitted on.

    Attributes
    ----------
    folder : Path
    case : Case
    npr : float
        Particles along the radius of the case's reference body.
    particles : int
    history : structured ndarray
        From `history.read_history`.
    fit : ClockFit
    """

    folder: Path
    case: Case
    npr: float
    particles: int
    history: npt.NDArray[Any]
    fit: ClockFit


class ClockConclusion(NamedTuple):
    """The offset that runs of several resolutions speak for.

    Attributes
    ----------
    run : ClockRun
        The one whose offset is taken.
    offset : float
        [s].
    numerical : float
        Numerical uncertainty [s]; NaN from one run.
    figures : float
        Standard deviation of the run's separate offsets [s]; NaN from one figure.
    spread : float
        Largest less smallest offset of all runs [s].
    finest : ClockRun
    convergence : Convergence
        Of the offset with NPR.
    """

    run: ClockRun
    offset: float
    numerical: float
    figures: float
    spread: float
    finest: ClockRun
    convergence: Convergence


class ClockFigure(NamedTuple):
    """One measured size of the cloud.

    Attributes
    ----------
    name : str
        Such as ``R_b at 6 us``.
    time : float
        Nominal time of the exposure [s].
    measured : float
        [m].
    column : str
        Where a history has it.
    """

    name: str
    time: float
    measured: float
    column: str


def clock_figures(case: Case) -> tuple[ClockFigure, ...]:
    """Return what was measured of the cloud of a case, exposure by exposure."""
    exposures = case.measured.exposures if case.measured else ()
    return tuple(
        ClockFigure(f"{name} at {e.time * 1e6:g} us", e.time, measured, column)
        for e in exposures
        for name, measured, column in (
            ("R_b", e.radius, "cloud_radius"),
            ("L_b", e.length, "cloud_length"),
        )
        if measured is not None
    )


def clock_errors(
    history: npt.NDArray[Any], case: Case, offsets: FloatArray
) -> FloatArray:
    """Return the relative errors of a run at given offsets of the clock.

    Parameters
    ----------
    history : structured ndarray
        From `history.read_history`.
    case : Case
    offsets : ndarray, shape (n,)
        [s].

    Returns
    -------
    ndarray, shape (figures, n)
        Computed over measured size, less one; linear between the lines of the
        history.
    """
    history = _before_arrival(history)
    time = history["time"]
    return np.array(
        [
            np.interp(f.time + offsets, time, history[f.column]) / f.measured - 1.0
            for f in clock_figures(case)
        ]
    )


def _before_arrival(history: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return the lines before the cloud came to a body behind the plate."""
    return history[np.isfinite(history["cloud_length"])] if history.size else history


def covered_offsets(history: npt.NDArray[Any], case: Case) -> tuple[float, float]:
    """Return the least and the largest offset that a run covers [s].

    With the least the first exposure falls on first contact, with the largest the
    last one on the end of the run, or on the cloud's arrival at the next body.

    Raises
    ------
    ValueError
        If the case has no exposures, or if the run is too short for any offset.
    """
    figures = clock_figures(case)
    if not figures:
        raise ValueError("the case has no measured exposure to fit the clock on")
    times = [f.time for f in figures]
    history = _before_arrival(history)
    low = -min(times)
    high = float(history["time"][-1]) - max(times) if history.size else low
    if high <= low:
        raise ValueError("the run ends before the last exposure")
    return low, high


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
    low, high = covered_offsets(history, case)

    def cost(which: slice, offsets: FloatArray) -> FloatArray:
        errors = clock_errors(history, case, offsets)[which]
        return np.asarray((errors**2).sum(axis=0))

    best = _least(partial(cost, slice(None)), low, high)
    if best >= high - _AT_THE_END:
        raise ValueError(
            f"the best offset lies beyond the end of the run: let it run past "
            f"{history['time'][-1] * 1e6:.2f} us"
        )
    figures = clock_figures(case)
    each = [slice(k, k + 1) for k in range(len(figures))]
    separate = np.array([_least(partial(cost, one), low, high) for one in each])
    return ClockFit(
        offset=best,
        errors=clock_errors(history, case, np.array([best]))[:, 0],
        separate=separate,
        beyond=separate >= high - _AT_THE_END,
        names=tuple(f.name for f in figures),
    )


def _least(cost: Callable[[FloatArray], FloatArray], low: float, high: float) -> float:
    """Return where a function is least, by looks that close in on it.

    A history has corners where another particle becomes the outermost, so the looks
    do not rely on derivatives. Their size does not depend on the run's length.
    """
    while True:
        grid = np.linspace(low, high, _GRID)
        best = int(np.argmin(cost(grid)))
        if grid[1] - grid[0] <= _FINEST:
            return float(grid[best])
        low, high = grid[max(best - 1, 0)], grid[min(best + 1, _GRID - 1)]


def clock_run(folder: Path, case: Case) -> ClockRun:
    """Read a completed run and fit the clock on it.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    case : Case
        Its case.

    Returns
    -------
    ClockRun

    Raises
    ------
    MpisphError
        If the run is not complete, or if the clock cannot be fitted on it.
    OSError
        If a file cannot be read.
    """
    status = known_status(folder)
    state = status.state if status else "not begun"
    if status is None or state != "completed":
        reached = f", t = {status.time * 1e6:.2f} us" if status else ""
        raise MpisphError(
            f"{folder}: not a completed run ({state}{reached}); the clock needs the "
            "whole of it"
        )
    history = _read(folder / HISTORY_FILE, read_history)
    particles = _read(folder / RESULT_FILE, read_result).particles
    last = int(history["step"][-1]) if history.size else 0
    if last < status.step - case.output.history_every:
        raise MpisphError(
            f"{folder / HISTORY_FILE} is damaged: it ends at step {last}, the run at "
            f"step {status.step}"
        )
    try:
        fit = fit_clock(history, case)
    except ValueError as error:
        raise MpisphError(f"{folder}: {error}") from error
    return ClockRun(folder, case, _npr(case), particles, history, fit)


def _read(path: Path, read: Callable[[Path], T]) -> T:
    """Read a file of a run, and name it where it is damaged."""
    try:
        return read(path)
    except ValueError as error:
        raise MpisphError(f"{path}: damaged: {error}") from error


def _reference(case: Case) -> Body:
    """Return the body whose radius NPR counts particles along."""
    name = case.resolution.reference or default_reference(case.bodies)
    return next((b for b in case.bodies if b.name == name), case.bodies[0])


def _npr(case: Case) -> float:
    """Return NPR, also where the case gives the spacing."""
    return case.resolution.npr or _reference(case).reference_radius / case.spacing


def conclude(runs: Sequence[ClockRun], npr: float | None = None) -> ClockConclusion:
    """Take one run's offset, and say how uncertain it is.

    Its numerical uncertainty is that of the finest run: with three or more runs from
    `convergence.converge`, with two half of their spread. An offset of a coarser run
    is as much more uncertain as it differs from the finest one's.

    Parameters
    ----------
    runs : sequence of ClockRun
        Of one shot, that differ in resolution alone; in any order.
    npr : float, optional
        The resolution whose offset is taken; by default the finest.

    Returns
    -------
    ClockConclusion

    Raises
    ------
    MpisphError
        If the runs do not belong together, or if none has that resolution.
    """
    runs = sorted(runs, key=lambda run: run.npr)
    _check_alike(runs)
    finest = runs[-1]
    chosen = [run for run in runs if npr is None or math.isclose(run.npr, npr)]
    if not chosen:
        found = ", ".join(f"{run.npr:g}" for run in runs)
        raise MpisphError(f"no run at NPR {npr:g}; they are at {found}")
    run = chosen[-1]
    offsets = [r.fit.offset for r in runs]
    convergence = converge([r.npr for r in runs], offsets)
    spread = max(offsets) - min(offsets)
    numerical = convergence.uncertainty if len(runs) > 2 else 0.5 * spread
    numerical += abs(run.fit.offset - finest.fit.offset)
    separate = run.fit.separate
    return ClockConclusion(
        run=run,
        offset=run.fit.offset,
        numerical=numerical if len(runs) > 1 else math.nan,
        figures=float(separate.std(ddof=1)) if separate.size > 1 else math.nan,
        spread=spread,
        finest=finest,
        convergence=convergence,
    )


def _check_alike(runs: Sequence[ClockRun]) -> None:
    """Check that runs, in order of NPR, are of one shot and differ in NPR alone."""
    first = runs[0]
    for before, run in pairwise(runs):
        if clock_figures(run.case) != clock_figures(first.case):
            raise MpisphError(
                f"{run.folder}: a run of another shot than {first.folder}: other sizes "
                "of the cloud were measured"
            )
        ours, theirs = _beside_resolution(run.case), _beside_resolution(first.case)
        differing = [key for key in ours if ours[key] != theirs[key]]
        if differing:
            raise MpisphError(
                f"{run.folder}: differs from {first.folder} in {', '.join(differing)}; "
                "the runs may differ in resolution alone"
            )
        if run.npr == before.npr:
            raise MpisphError(
                f"{run.folder}: has NPR {run.npr:g}, as {before.folder} has; name one "
                "run for each resolution"
            )


def _beside_resolution(case: Case) -> dict[str, object]:
    """Return what must be the same in runs whose offsets are compared."""
    definition = case.measured and case.measured.min_velocity_fraction
    return {
        "bodies": case.bodies,
        "materials": case.materials,
        "scheme": case.scheme,
        "resolution.reference": _reference(case).name,
        "resolution.nph": case.resolution.nph,
        "measured.plate": case.measured and case.measured.plate,
        "measured.min_velocity_fraction": definition,
    }


def clock_table(runs: Sequence[ClockRun]) -> Table:
    """Return a table of the fits, a row for each run in order of NPR.

    Parameters
    ----------
    runs : sequence of ClockRun
        Of one shot.

    Returns
    -------
    rich.table.Table
    """
    table = Table(
        title="Offset of the experiment's clock",
        caption=(
            "Offset: least squares of the relative errors of all figures. For each "
            "figure the error left, and below it the offset that it alone would ask "
            "for. R_b, L_b: outermost particles."
        ),
        show_lines=True,
    )
    names = runs[0].fit.names
    for name in ("NPR", "particles", "offset", *names):
        heading = name.replace(" at ", "\nat ").replace(" us", " µs")
        table.add_column(heading, justify="right")
    for run in sorted(runs, key=lambda run: run.npr):
        fit = run.fit
        cells = [
            f"{100.0 * error:+.1f} %\n{'>' * bool(over)}{alone * 1e6:.2f} µs"
            for error, alone, over in zip(
                fit.errors, fit.separate, fit.beyond, strict=True
            )
        ]
        offset = f"{fit.offset * 1e6:.2f} µs"
        table.add_row(f"{run.npr:g}", f"{run.particles}", offset, *cells)
    return table


def conclusion_text(conclusion: ClockConclusion) -> str:
    """Return the offset with both parts of its uncertainty, for people."""
    c = conclusion
    which = "the finest" if c.run is c.finest else "as asked"
    many = len(c.convergence.npr) > 1
    head = f"clock offset {c.offset * 1e6:.2f} µs, of NPR {c.run.npr:g}"
    return "\n".join(
        [
            f"{head} ({which})" if many else head,
            f"  numerical         {_numerical_text(c)}",
            f"  figure to figure  {_figures_text(c)}",
            PREDICTIONS,
        ]
    )


def _numerical_text(c: ClockConclusion) -> str:
    levels = len(c.convergence.npr)
    if levels == 1:
        return "unknown from one run; name runs at other NPR beside it"
    text = f"±{c.numerical * 1e6:.2f} µs: "
    if c.run is not c.finest:
        apart = abs(c.offset - c.finest.fit.offset) * 1e6
        own = c.numerical * 1e6 - apart
        text += f"{apart:.2f} µs off NPR {c.finest.npr:g}, and its {own:.2f} µs: "
    if levels == 2:
        return text + f"half of the spread of two runs, {c.spread * 1e6:.2f} µs"
    text += f"grid convergence index ({explain(c.convergence)})"
    if math.isfinite(c.convergence.extrapolated):
        text += f"; extrapolated {c.convergence.extrapolated * 1e6:.2f} µs"
    return text + f"; spread of {levels} runs {c.spread * 1e6:.2f} µs"


def _figures_text(c: ClockConclusion) -> str:
    count = c.run.fit.separate.size
    if count == 1:
        return "unknown from one figure"
    least = "at least " * bool(c.run.fit.beyond.any())
    return (
        f"±{c.figures * 1e6:.2f} µs: {least}the standard deviation of {count} "
        "separate offsets"
    )
