"""The figure of a study over resolutions, made ready for `figures`."""

import math
import re
from collections.abc import Sequence
from typing import NamedTuple

from mpisph.study.axes import (
    SYMBOLS,
    axis_of,
    by_axes,
    exposures,
    measured_mm,
    same_time,
    times_drawn,
)
from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.table import CLOCKS, Row, columns, time_label


class ConvergenceLevels(NamedTuple):
    """A quantity of one variant at several resolutions.

    Attributes
    ----------
    name : str
        Of the variant.
    npr : list of float
        Resolutions.
    values : list of float or None
        In the unit of the quantity; None where there is none.
    measured : float or None
        In the same unit.
    """

    name: str
    npr: list[float]
    values: list[float | None]
    measured: float | None


class ConvergenceQuantity(NamedTuple):
    """A quantity of all variants, for a panel of the figure of convergence.

    Attributes
    ----------
    label : str
        A formula stands between dollar signs.
    unit : str
    levels : list of ConvergenceLevels
    """

    label: str
    unit: str
    levels: list[ConvergenceLevels]


def convergence_quantities(
    study: Study, spec: FigureSpec, rows: Sequence[Row]
) -> list[ConvergenceQuantity]:
    """Return what is drawn of quantities against resolution.

    They are those at the earliest exposure, by the last of the figure's clocks: R_b and
    L_b, outermost and robust, front velocity, mass of the cloud, and the hole's
    diameter where the table has it.

    Parameters
    ----------
    study : Study
    spec : FigureSpec
        Of kind ``convergence``.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    list of ConvergenceQuantity
        Those that any run has.
    """
    x, lines = axis_of(study, spec.x), axis_of(study, spec.lines)
    table = by_axes(rows, (x, lines))
    time = times_drawn(study, spec)[-1]
    found = []
    for label, unit, column, symbol in _convergence_columns(rows, spec, time):
        levels = []
        for line, name in zip(lines.values, lines.titles(), strict=True):
            cells = [table.get((at, line)) for at in x.values]
            values = [None if row is None else row.get(column) for row in cells]
            measured = _measured(study, line, time, symbol)
            levels.append(ConvergenceLevels(name, x.numbers(), values, measured))
        if any(value is not None for level in levels for value in level.values):
            found.append(ConvergenceQuantity(label, unit, levels))
    return found


def _convergence_columns(
    rows: Sequence[Row], spec: FigureSpec, time: float
) -> list[tuple[str, str, str, str]]:
    """Return label, unit, column and symbol, empty where nothing is measured."""
    where = f"{time_label(time)}{CLOCKS[spec.clocks[-1]]}"
    sizes = [
        (f"{SYMBOLS[q]}{text}", "mm", f"{q}_{where}{suffix}_mm", symbol)
        for q in spec.quantities
        for text, suffix, symbol in (("", "", q), (", robust", "_robust", ""))
    ]
    holes = [c for c in columns(rows) if re.fullmatch(r"hole_diameter_.*_mm", c)]
    return [
        *sizes,
        ("front velocity", "km/s", f"front_velocity_{where}_km_per_s", ""),
        ("mass of the cloud", "g", f"cloud_mass_{where}_g", ""),
        *(("diameter of the hole", "mm", hole, "") for hole in holes[:1]),
    ]


def _measured(study: Study, variant: Value, time: float, quantity: str) -> float | None:
    """Return what was measured of a variant [mm], if it was."""
    sizes = [
        measured_mm(exposure, quantity)
        for case, exposure in exposures(study)
        if quantity and case.variant == variant and same_time(exposure.time, time)
    ]
    return next((size for size in sizes if not math.isnan(size)), None)
