"""What the figures of studies share: axes, exposures, clocks, and rows by axes."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from mpisph.case.sections import Exposure
from mpisph.study.columns import CLOCKS, column, time_label
from mpisph.study.model import Study, StudyCase, Value
from mpisph.study.table import Row

Clock = Literal["nominal", "offset"]

SYMBOLS = {"R_b": "$R_b$", "L_b": "$L_b$"}
"""Quantities as formulas."""


class Axis(NamedTuple):
    """What an axis, the lines or the panels of a figure stand for.

    Attributes
    ----------
    name : str
        Column of the table; empty where nothing varies.
    label : str
        What it is called; empty for variants.
    values : tuple
        As in the table.
    names : tuple of str
        What the values are called.
    unit : str, optional
        Of the values; empty for SI units and pure numbers.
    """

    name: str
    label: str
    values: tuple[Value, ...]
    names: tuple[str, ...]
    unit: str = ""

    @property
    def numeric(self) -> bool:
        """Whether all values are numbers."""
        return all(
            isinstance(v, int | float) and not isinstance(v, bool) for v in self.values
        )

    @property
    def title(self) -> str:
        """The label, with the unit unless it names that itself."""
        named = not self.unit or self.label.endswith("]")
        return self.label if named else f"{self.label} [{self.unit}]"

    def titles(self) -> tuple[str, ...]:
        """Return the names; those of numbers with the label before them."""
        if not self.numeric:
            return self.names
        return tuple(f"{self.label} {name}" for name in self.names)

    def numbers(self) -> list[float]:
        """Return the values as numbers; categories are at whole numbers."""
        if not self.numeric:
            return [float(k) for k in range(len(self.values))]
        return [float(value) for value in self.values]


def axis_of(study: Study, name: str | None) -> Axis:
    """Return the axis that a parameter, ``variant`` or nothing is drawn along.

    Parameters
    ----------
    study : Study
    name : str or None
    """
    if name is None or (name == "variant" and not study.file.variants):
        return Axis("", "", ("",), ("",))
    if name == "variant":
        variants = study.file.variants
        labels = tuple(variant.label or variant.name for variant in variants)
        return Axis(name, "", tuple(variant.name for variant in variants), labels)
    (parameter,) = (p for p in study.file.parameters if p.name == name)
    label = parameter.label or parameter.name
    values = parameter.values
    if parameter.joined:  # in the order of a file, and perhaps several times
        values = tuple(dict.fromkeys(values))
        values = tuple(sorted(values)) if parameter.numeric else values
    names = tuple(_value_name(value, label) for value in values)
    return Axis(name, label, values, names, parameter.unit)


def _value_name(value: Value, label: str) -> str:
    if isinstance(value, bool):
        return f"{'with' if value else 'without'} {label}"
    return str(value)


def by_axes(rows: Sequence[Row], axes: Sequence[Axis]) -> dict[tuple[Value, ...], Row]:
    """Return the rows of a table by their values along some axes."""
    return {tuple(row.get(axis.name, "") for axis in axes): row for row in rows}


def has_ended(row: Row) -> bool:
    """Say whether a run has come to its end, or broken down."""
    return row["status"] in {"completed", "unstable"}


def is_unstable(row: Row | None) -> bool:
    """Say whether a run, if there is one, broke down."""
    return row is not None and row["status"] == "unstable"


def value_at(row: Row | None, column: str) -> float:
    """Return a value of a completed run, NaN where there is none."""
    if row is None or row["status"] != "completed" or row.get(column) is None:
        return float("nan")
    return float(row[column])


def size_column(quantity: str, time: float, clock: Clock, ending: str) -> str:
    """Return the column of a quantity at an exposure.

    Parameters
    ----------
    quantity : str
        ``R_b`` or ``L_b``.
    time : float
        Nominal [s].
    clock : str
    ending : str
        Such as ``mm`` or ``error_percent``.
    """
    return column(quantity, f"{time_label(time)}{CLOCKS[clock]}", ending)


def exposures(study: Study) -> list[tuple[StudyCase, Exposure]]:
    """Return all exposures of all cases of a study."""
    return [
        (case, exposure)
        for case in study.cases
        if case.case.measured is not None
        for exposure in case.case.measured.exposures
    ]


def measured_mm(exposure: Exposure, quantity: str) -> float:
    """Return a measured R_b or L_b [mm], NaN where there is none."""
    size = exposure.radius if quantity == "R_b" else exposure.length
    return float("nan") if size is None else 1e3 * size


def clock_offset(study: Study) -> float | None:
    """Return the clock offset of all cases [s], None where they differ."""
    offsets = {
        case.case.measured.clock_offset
        for case in study.cases
        if case.case.measured is not None
    }
    return offsets.pop() if len(offsets) == 1 else None


def clock_text(study: Study, clock: Clock) -> str:
    """Return what a reading of the clock is called in a figure."""
    if clock == "nominal":
        return "nominal exposure time"
    offset = clock_offset(study)
    if offset is None:
        return "with clock offset"
    return f"{1e6 * offset:+.3g} µs clock offset"


def time_text(study: Study, time: float, clock: Clock) -> str:
    """Return when an exposure is compared, after first contact."""
    offset = clock_offset(study) if clock == "offset" else 0.0
    if offset is None:
        return f"{1e6 * time:g} µs with clock offset"
    return f"{1e6 * (time + offset):g} µs"


def status_note(rows: Sequence[Row]) -> str:
    """Return how many runs there are, and how many are unstable or missing."""
    unstable = sum(row["status"] == "unstable" for row in rows)
    missing = sum(not has_ended(row) for row in rows)
    parts = [f"{len(rows)} runs"]
    parts += [f"{unstable} unstable"] * bool(unstable)
    parts += [f"{missing} missing"] * bool(missing)
    return f"{', '.join(parts)}."
