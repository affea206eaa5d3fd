"""The figure of a study over resolutions, made ready for `figures`."""

import math
from collections.abc import Sequence

from mpisph.analysis.convergence import converge
from mpisph.case.times import same_time
from mpisph.figures.convergence import ConvergencePanel, ConvergenceSeries
from mpisph.study.model import FigureSpec, Study, Value
from mpisph.study.plots.axes import (
    SYMBOLS,
    Clock,
    axis_of,
    by_axes,
    exposures,
    measured_mm,
    size_column,
    time_text,
    value_at,
)
from mpisph.study.table import CLOCKS, Row, time_label


def convergence_panels(
    study: Study, spec: FigureSpec, rows: Sequence[Row]
) -> list[ConvergencePanel]:
    """Return what is drawn of quantities against resolution.

    They are those at the earliest exposure, by the last of the figure's clocks: R_b and
    L_b, outermost and robust, front velocity, mass of the cloud, and the hole.

    Parameters
    ----------
    study : Study
    spec : FigureSpec
        Of kind ``convergence``.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    list of ConvergencePanel
        Of the quantities that any run has.
    """
    x, lines = axis_of(study, spec.x), axis_of(study, spec.lines)
    table = by_axes(rows, (x, lines))
    panels = []
    for label, unit, column, measured in _quantities(study, spec):
        series = []
        for line, name in zip(lines.values, lines.titles(), strict=True):
            values = [value_at(table.get((at, line)), column) for at in x.values]
            result = converge(x.numbers(), values)
            series.append(ConvergenceSeries(name, result, measured.get(line)))
        if any(math.isfinite(v) for s in series for v in s.convergence.values):
            panels.append(ConvergencePanel(label, unit, series))
    return panels


def _quantities(
    study: Study, spec: FigureSpec
) -> list[tuple[str, str, str, dict[Value, float]]]:
    """Return label, unit, column, and what was measured of each variant."""
    time = study.times(spec.exposures)[0]
    clock: Clock = spec.clocks[-1]
    where = f"{time_label(time)}{CLOCKS[clock]}"
    found = []
    for q in spec.quantities:
        sizes = _measured(study, time, q)
        column, robust = (size_column(q, time, clock, e) for e in ("mm", "robust_mm"))
        at = f"{SYMBOLS[q]} at {time_text(study, time, clock)}"
        found.append((f"{at}, outermost", "mm", column, sizes))
        found.append((f"{at}, robust", "mm", robust, sizes))
    found.append(("front velocity", "km/s", f"front_velocity_{where}_km_per_s", {}))
    found.append(("mass of the cloud", "g", f"cloud_mass_{where}_g", {}))
    found.append(("hole between the faces", "mm", f"hole_{where}_mm", {}))
    found.append(("hole through the lips", "mm", f"hole_opening_{where}_mm", {}))
    return found


def _measured(study: Study, time: float, quantity: str) -> dict[Value, float]:
    """Return what was measured of each variant [mm]."""
    sizes = {
        case.variant: measured_mm(exposure, quantity)
        for case, exposure in exposures(study)
        if same_time(exposure.time, time)
    }
    return {name: size for name, size in sizes.items() if not math.isnan(size)}
