"""The tables on a study's page, in mm, us, g and %."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mpisph.core.words import counted, grouped
from mpisph.report.page import NONE, Link, Table
from mpisph.report.run_tables import mm, small
from mpisph.study.columns import column_label
from mpisph.study.model import Parameter, Study, Value
from mpisph.study.paper.ranges import TOTALS, RangeClock
from mpisph.study.plots.axes import Clock, axis_of, exposures, size_column
from mpisph.study.plots.convergence import ConvergencePanel, ConvergenceSeries
from mpisph.study.store import Standing
from mpisph.study.table import Row

Cells = tuple[str | Link, ...]

_EVEN = 5
# Numbers at even distances are listed up to here; more are told by their step.

_PLAIN = ("R_b_mm", "L_b_mm", "front_velocity_km_per_s", "cloud_mass_g", "hole_mm")
# Columns of a study without measurements.

_PLAIN_CAPTION = "At the end of each completed run; sizes by the outermost particle."
_CAPTION = (
    "Sizes in mm by the cloud’s outermost particle, in brackets the error against "
    "the measurement in %; a total error is the mean of the absolute errors of all "
    "measured figures. Offset: at the exposure time with the case’s clock offset "
    "added; fitted: with the offset that suits this run best. A dash: not reached, "
    "or not measured."
)


def setup_tables(study: Study) -> list[Table]:
    """Return what is varied, what is fixed, and what was measured.

    Parameters
    ----------
    study : Study

    Returns
    -------
    list of Table
        Those that have rows.
    """
    tables = [
        Table("Parameters", ("", "key", "values"), list(_parameter_rows(study))),
        _variants_table(study),
        Table("In all cases", ("", ""), list(_fixed_rows(study))),
        _measured_table(study),
    ]
    return [table for table in tables if table.rows]


def _parameter_rows(study: Study) -> Iterator[Cells]:
    for p in study.file.parameters:
        yield label_of(p), p.key, _values(p)
        for derived in study.file.derived:
            if derived.parameter == p.name:
                factor = "" if derived.factor == 1.0 else f"{derived.factor:g} times "
                yield "", derived.key, f"{factor}the same"


def label_of(parameter: Parameter) -> str:
    """Return what a parameter is called, with its unit."""
    label = (parameter.label or parameter.name).replace(" = ", "\u00a0=\u00a0")
    named = not parameter.unit or label.endswith("]")
    return label if named else f"{label} [{parameter.unit}]"


def _values(parameter: Parameter) -> str:
    """Return a parameter's values; long lists by their step, or by their number."""
    if parameter.joined:
        return _values_of_rows(parameter)
    if parameter.numeric and len(parameter.values) > _EVEN:
        numbers = np.array(parameter.values, dtype=float)
        steps = np.diff(numbers)
        if np.allclose(steps, steps[0], rtol=1e-9, atol=0.0):
            first, last = parameter.values[0], parameter.values[-1]
            return f"{first} to {last} in steps of {steps[0]:g} ({len(numbers)})"
    return ", ".join(map(value_text, parameter.values))


def _values_of_rows(parameter: Parameter) -> str:
    """Return the different values in the rows of a file."""
    found = list(dict.fromkeys(parameter.values))
    if parameter.numeric and len(found) > _EVEN:
        numbers = [float(value) for value in found]
        return f"{min(numbers):g} to {max(numbers):g} ({len(found)} values)"
    more = len(found) - _EVEN
    shown = ", ".join(map(value_text, found[:_EVEN]))
    return f"{shown} and {more} more" if more > 0 else shown


def value_text(value: Value) -> str:
    """Return a setting's value for people; a dash where a row has none."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value) or NONE


def _variants_table(study: Study) -> Table:
    rows: list[Cells] = [
        (
            variant.label or variant.name,
            variant.base or study.file.base or NONE,
            _settings(variant.set) or NONE,
        )
        for variant in study.file.variants
    ]
    title = "Variants, each with all values of the parameters"
    named = title if study.file.parameters else "Variants"
    return Table(named, ("variant", "base case", "settings"), rows)


def _settings(given: dict[str, Value]) -> str:
    texts = [
        f"{key}{' removed' if value == '' else f' = {_set_text(value)}'}"
        for key, value in given.items()
    ]
    return "; ".join(texts)


def _set_text(value: Value) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return str(value) if value != "" else "removed"


def _fixed_rows(study: Study) -> Iterator[Cells]:
    if study.file.base is not None:
        yield "base case", study.file.base
    for key, value in study.file.set.items():
        yield key, _set_text(value)


def _measured_table(study: Study) -> Table:
    """Return the measured exposures; once where they are the same in all variants."""
    found: dict[str, dict[tuple[Any, ...], None]] = {}
    for case, e in exposures(study):
        row = (e.time, e.radius, e.length, e.source)
        found.setdefault(case.variant, {})[row] = None
    alike = len({tuple(lines) for lines in found.values()}) == 1
    names = variant_names(study)
    rows: list[Cells] = [
        (
            "all cases" if alike else names[variant],
            f"{1e6 * time:g} µs",
            mm(radius),
            mm(length),
            source,
        )
        for variant, lines in list(found.items())[: 1 if alike else None]
        for time, radius, length, source in lines
    ]
    return Table("Measured", ("", "exposure", "R_b [mm]", "L_b [mm]", "source"), rows)


def variant_names(study: Study) -> dict[str, str]:
    """Return what the variants are called, by name; empty for none."""
    return {"": ""} | {v.name: v.label or v.name for v in study.file.variants}


def settings_text(study: Study, row: Row) -> str:
    """Return which case of the study a row is, such as ``4-1283, NPH 2.0``.

    Parameters
    ----------
    study : Study
    row : dict
        Of the study's table, or the settings alone.
    """
    axes = [axis_of(study, p.name) for p in study.file.parameters]
    titles = [
        title.replace(f"{axis.label} ", f"{axis.label} = ", 1)
        if "=" in axis.label and axis.numeric
        else title
        for axis in axes
        for value, title in zip(axis.values, axis.titles(), strict=True)
        if value == row[axis.name]
    ]
    variant = variant_names(study).get(str(row.get("variant", "")), "")
    return ", ".join([variant] * bool(variant) + titles) or "base case"


def cases_table(study: Study, rows: Sequence[Row]) -> Table:
    """Return the study's table as a reader wants it.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    Table
        A row for each case. What no run has, has no column.
    """
    sizes = list(_sizes(study, rows))
    plain = [] if sizes else [name for name in _PLAIN if _any(rows, name)]
    totals = [clock for clock in TOTALS if _any(rows, TOTALS[clock])]
    heads = ["case", *["variant"] * bool(study.file.variants)]
    heads += [label_of(p) for p in study.file.parameters]
    heads += ["state", *(f"total error {clock} [%]" for clock in totals)]
    heads += ["fitted offset [µs]"] * ("fitted" in totals)
    heads += [f"{q} {1e6 * t:g} µs {clock}" for q, t, clock in sizes]
    heads += [column_label(name).replace("$", "") for name in plain]
    ended = _any(rows, "steps")
    heads += ["energy error", "steps"] * ended
    cells = [_case_row(study, row, [*sizes, *plain], totals, ended) for row in rows]
    caption = _PLAIN_CAPTION if plain else _CAPTION
    words = tuple(k for k, head in enumerate(heads) if head in {"variant", "state"})
    return Table("", tuple(heads), cells, caption * ended, numbers=True, words=words)


def _any(rows: Sequence[Row], column: str) -> bool:
    return any(row.get(column) is not None for row in rows)


def _sizes(study: Study, rows: Sequence[Row]) -> Iterator[tuple[str, float, Clock]]:
    """Return quantity, exposure and clock of the columns that any run has."""
    clocks: tuple[Clock, ...] = ("nominal", "offset")
    for time in study.times():
        for quantity in ("R_b", "L_b"):
            for clock in clocks:
                if _any(rows, size_column(quantity, time, clock, "mm")):
                    yield quantity, time, clock


def _case_row(
    study: Study,
    row: Row,
    sizes: Sequence[tuple[str, float, Clock] | str],
    totals: Sequence[RangeClock],
    ended: bool,
) -> Cells:
    cells = [str(row["case"])]
    if study.file.variants:
        cells.append(variant_names(study)[row["variant"]])
    cells += [value_text(row[p.name]) for p in study.file.parameters]
    cells.append(row["status"])
    cells += [number(row.get(TOTALS[clock]), ".1f") for clock in totals]
    if "fitted" in totals:
        cells.append(number(row.get("fitted_offset_us"), ".2f"))
    cells += [
        number(row.get(what), ".3g") if isinstance(what, str) else size_text(row, *what)
        for what in sizes
    ]
    if ended:
        steps = row.get("steps")
        cells.append(_energy(row.get("energy_error")))
        cells.append(NONE if steps is None else grouped(steps))
    return tuple(cells)


def size_text(row: Row, quantity: str, time: float, clock: Clock) -> str:
    """Return a size of a run in mm with its error."""
    size = row.get(size_column(quantity, time, clock, "mm"))
    error = row.get(size_column(quantity, time, clock, "error_percent"))
    if size is None:
        return NONE
    return f"{size:.1f}" if error is None else f"{size:.1f} ({error_text(error)})"


def error_text(percent: float | None) -> str:
    """Return an error [%] with its sign; the head or the caption has the unit."""
    return number(percent, "+.1f")


def number(value: float | None, form: str) -> str:
    """Return a number with a minus sign as is printed; a dash for none."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:{form}}".replace("-", "\u2212")


def _energy(value: float | None) -> str:
    return NONE if value is None or not math.isfinite(value) else small(value)


def convergence_table(panels: Sequence[ConvergencePanel], title: str) -> Table:
    """Return the figures at each resolution, and what they tend to.

    Parameters
    ----------
    panels : sequence of ConvergencePanel
        From `convergence_panels`.
    title : str
    """
    series = [s for panel in panels for s in panel.series]
    levels = sorted({float(x) for s in series for x in s.convergence.npr})
    rows = [
        _convergence_row(panel, s, levels)
        for panel in panels
        for s in panel.series
        if s.convergence.values.size
    ]
    heads = (
        "quantity", "case", *(f"NPR {level:g}" for level in levels), "behaviour", "p",
        "extrapolated", "GCI", "measured",
    )  # fmt: skip
    caption = (
        "p: observed order of the finest three resolutions. Extrapolated: Richardson’s "
        "value at infinite resolution, none where the changes do not decrease "
        "steadily. GCI: grid convergence index, the uncertainty of the finest value "
        "relative to it; of values that diverge it is no bound."
    )
    words = (1, heads.index("behaviour"))
    return Table(title, heads, rows, caption, numbers=True, words=words)


def _convergence_row(
    panel: ConvergencePanel, s: ConvergenceSeries, levels: Sequence[float]
) -> Cells:
    c = s.convergence
    values = dict(zip(map(float, c.npr), map(float, c.values), strict=True))
    order = number(c.order, ".2f")
    if math.isfinite(c.order_used) and c.order_used != c.order:
        word = "limited to" if math.isfinite(c.order) else "assumed"
        order = f"{order}, {word} {c.order_used:g}".removeprefix(f"{NONE}, ")
    return (
        f"{panel.quantity.replace('$', '')} [{panel.unit}]",
        s.name or NONE,
        *(_scaled(values.get(level), panel.scale) for level in levels),
        c.kind,
        order,
        _scaled(c.extrapolated, panel.scale),
        NONE if math.isnan(c.gci) else f"{c.gci:.1f}\u00a0%",
        _scaled(s.measured, panel.scale),
    )


def _scaled(value: float | None, scale: float) -> str:
    text = number(None if value is None else scale * value, "#.4g")
    return text.removesuffix(".")


def trouble_tables(study: Study, rows: Sequence[Row]) -> list[Table]:
    """Return the cases that did not come to their end, by state and reason.

    Parameters
    ----------
    study : Study
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    list of Table
        The most frequent reason first within each state.
    """
    order: tuple[Standing, ...] = ("failed", "unstable", "stopped")
    groups: dict[tuple[str, str], list[Row]] = {}
    for row in rows:
        if row["status"] in order:
            groups.setdefault((row["status"], row["reason"] or ""), []).append(row)
    ranked = sorted(
        groups.items(), key=lambda item: (order.index(item[0][0]), -len(item[1]))
    )
    heads = ("case", "settings", "run", "steps", "time reached [µs]")
    tables = []
    for (status, reason), found in ranked:
        because = f" ({reason})" if reason else ""
        cases = counted(len(found), "case")
        lines: list[Cells] = [
            (
                str(row["case"]),
                settings_text(study, row),
                row["run"],
                NONE if row.get("steps") is None else grouped(row["steps"]),
                number(row.get("time_us"), ".2f"),
            )
            for row in found
        ]
        title = f"{cases} {status}{because}"
        tables.append(Table(title, heads, lines, numbers=True, words=(1, 2)))
    return tables


def provenance_table(rows: Sequence[Row], files: dict[str, str]) -> Table:
    """Return which program made the runs, what they took, and where files lie.

    Parameters
    ----------
    rows : sequence of dict
        From `collect`.
    files : dict
        What files are called, by what they are.
    """
    made: dict[str, set[str]] = {}
    wall: dict[str, float] = {}
    for row in rows:
        if row.get("version") is not None:
            name = f"mpisph {row['version']}"
            if row.get("revision"):
                name += f", revision {row['revision'][:12]}"
            made.setdefault(name, set()).add(row["run"])
            wall[row["run"]] = row["wall_s"]
    lines: list[Cells] = list(files.items())
    programs = [
        f"{name} ({counted(len(runs), 'run')})"
        for name, runs in sorted(made.items(), key=lambda item: -len(item[1]))
    ]
    if programs:
        lines.append(("program", "; ".join(programs)))
        lines.append(("time of all runs", _spent(math.fsum(wall.values()))))
    return Table("", ("", ""), lines)


def _spent(seconds: float) -> str:
    """Return a time in the unit that suits it."""
    if seconds > 3600.0:
        return f"{seconds / 3600:.1f} h"
    return f"{seconds / 60:.0f} min" if seconds > 120.0 else f"{seconds:.0f} s"
