"""The result of a run: ``result.json``, and the comparison with measurements."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

from pydantic import BaseModel, ConfigDict
from rich.table import Table

from mpisph.case import Case
from mpisph.case.sections import Exposure
from mpisph.case.times import same_time
from mpisph.diagnostics.cloud import (
    CloudFigure,
    CloudMeasure,
    cloud_size,
    compare,
    next_body,
)
from mpisph.diagnostics.condition import Condition
from mpisph.io.files import read_text, write_text
from mpisph.io.verdict import Verdict, WallRecord

RESULT_FILE = "result.json"

COMPARED_FIGURE: CloudFigure = "outermost"
"""Which figure of the computed cloud is printed beside the measured one."""

Ending = Literal["completed", "unstable", "stopped"]


class _Model(BaseModel):
    """JSON knows neither NaN nor infinity: they are written as strings."""

    model_config = ConfigDict(frozen=True, extra="forbid", ser_json_inf_nan="strings")


class CloudRecord(_Model):
    """The cloud at a requested time: zero where there is none, NaN once it arrived."""

    time: float
    """[s]."""
    radius: float
    """R_b by the outermost particle [m]."""
    length: float
    """L_b by the foremost particle [m]."""
    radius_robust: float
    """R_b by the mass quantile [m]."""
    length_robust: float
    """L_b by the mass quantile [m]."""
    front_velocity: float
    """Axial velocity of the foremost particle [m/s]."""
    mass: float
    """[kg]."""
    reason: str | None = None
    """Why there is no measure, where all of it is NaN."""

    @classmethod
    def of(cls, time: float, measure: CloudMeasure, case: Case) -> "CloudRecord":
        """Return the record of a measure of a case taken at `time` [s]."""
        reason, hit = None, next_body(case)
        if math.isnan(measure.mass) and hit is not None:
            reason = f"the cloud has reached {hit.name}"
        return cls(time=time, **measure._asdict(), reason=reason)

    @property
    def measure(self) -> CloudMeasure:
        """The measure that the record was made of."""
        return CloudMeasure(**self.model_dump(exclude={"time", "reason"}))


class Comparison(_Model):
    """One exposure beside the computed cloud, by one reading of the clock."""

    source: str
    """Where the measurement comes from."""
    clock: Literal["nominal", "offset"]
    """Whether `time` is the exposure's own or has the case's offset added."""
    nominal_time: float
    """Time that the exposure is quoted with [s]."""
    time: float
    """Time after first contact that is compared [s]."""
    outcome: Literal["compared", "not reached", "arrived"]
    """Whether the run came as far as `time`, and the cloud not to the next body."""
    figure: CloudFigure
    """Which figure of the computed cloud is compared."""
    measured_radius: float | None
    """[m]."""
    measured_length: float | None
    """[m]."""
    radius: float | None = None
    """Computed R_b [m]."""
    length: float | None = None
    """Computed L_b [m]."""
    radius_error_percent: float | None = None
    """Computed over measured R_b, less 100 %."""
    length_error_percent: float | None = None
    """Computed over measured L_b, less 100 %."""


class BodyRecord(_Model):
    """The matter of a body at the end; None where its material has no such model."""

    name: str
    """Of the body."""
    mass: float
    """[kg]."""
    molten: float | None
    """Share of the mass that is molten at the end."""
    broken: float | None
    """Share of the mass that is broken at the end: of damage 1."""
    momentum_z: float
    """Axial momentum [kg m/s]."""
    kinetic_energy: float
    """[J]."""
    internal_energy: float
    """[J]."""


def body_records(case: Case, conditions: Sequence[Condition]) -> tuple[BodyRecord, ...]:
    """Return the records of all bodies, in order.

    There are none where no matter can melt or break, unless there is a shield.

    Parameters
    ----------
    case : Case
    conditions : sequence of Condition
        One for each body.
    """
    records = []
    for body, found in zip(case.bodies, conditions, strict=True):
        fields = case.body_models(body).fields
        molten = found.molten if "melt" in fields else None
        broken = found.broken if "damage" in fields else None
        sums = found._asdict() | {"molten": molten, "broken": broken}
        records.append(BodyRecord(name=body.name, **sums))
    known = any(x.molten is not None or x.broken is not None for x in records)
    known = known or case.shield is not None
    return tuple(records) if known else ()


class Conservation(_Model):
    """Changes of what should be conserved, relative to initial values."""

    mass_error: float
    """At the end."""
    momentum_z_error: float | None
    """At the end; axial momentum. None where planes take momentum up."""
    energy_error_final: float
    """At the end; kinetic and internal energy."""
    energy_error_max: float
    """Largest magnitude during the run."""


class Timing(_Model):
    """What the run cost."""

    ranks: int
    """Number of ranks."""
    steps: int
    """Number of steps."""
    wall: float
    """Time on the wall clock [s]."""
    step_ms: float
    """Per step, snapshots left out [ms]."""
    interaction_ns: float
    """Rank time per directed interaction, snapshots left out [ns]."""
    timers: dict[str, float]
    """Time in each phase, on the rank that spent most in it [s]."""
    first_step: float | None = None
    """Unix time at which the first step was done [s]."""


class Result(_Model):
    """What a run ended with."""

    title: str
    """Title of the case."""
    status: Ending
    """How the run ended; no file is written of one that was stopped."""
    reason: str | None = None
    """Why it did not complete, such as ``energy_drift``."""
    detail: str | None = None
    """The figures behind the reason, in words."""
    step: int
    """Steps made when the run ended."""
    time: float
    """Time reached [s]."""
    particle: int | None = None
    """Id of the offending particle, where there is one."""
    particles: int
    """Number of particles."""
    clouds: tuple[CloudRecord, ...]
    """The cloud at each requested time that was reached."""
    cloud_arrival: float | None = None
    """When the cloud came to the next body, where its measures end [s]."""
    lowest_energy: float | None = None
    """Lowest specific internal energy of a particle during the run [J/kg]."""
    comparisons: tuple[Comparison, ...]
    """Every exposure, at the nominal and at the offset time."""
    bodies: tuple[BodyRecord, ...] = ()
    """Every body at the end, where models say what melts or breaks."""
    walls: tuple[WallRecord, ...] = ()
    """The wall of a shield at each output time that was reached."""
    verdict: Verdict | None = None
    """Whether the wall of a shield holds; None in other cases."""
    conservation: Conservation
    """Conservation errors."""
    timing: Timing
    """Cost."""
    versions: dict[str, str]
    """Versions of the software."""
    revision: str
    """Revision of the source."""
    damage: tuple[str, ...] = ()
    """Files that were found damaged or missing when the run was resumed, and could not
    be written again."""


def write_result(folder: Path, result: Result) -> Path:
    """Write ``result.json``; call it on one rank.

    Parameters
    ----------
    folder : Path
        Folder of the run.
    result : Result

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    path = folder / RESULT_FILE
    write_text(path, result.model_dump_json(indent=2) + "\n")
    return path


def read_result(path: Path) -> Result:
    """Read a file that `write_result` wrote.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is not a result.
    """
    return Result.model_validate_json(read_text(path))


def make_comparisons(
    case: Case, clouds: Sequence[CloudRecord]
) -> tuple[Comparison, ...]:
    """Set every exposure of a case beside the computed clouds.

    Parameters
    ----------
    case : Case
    clouds : sequence of CloudRecord
        At the requested times that were reached.

    Returns
    -------
    tuple of Comparison
        For each exposure the nominal time and, where the case has an offset of
        the clock, the time with it added. Empty without measurements.
    """
    if case.measured is None:
        return ()
    offset = case.measured.clock_offset
    clocks: list[Literal["nominal", "offset"]] = ["nominal", "offset"]
    return tuple(
        _compare_at(exposure, clock, exposure.time + shift, figure, clouds)
        for exposure in case.measured.exposures
        for clock, shift in zip(clocks, (0.0, offset), strict=True)
        if clock == "nominal" or offset != 0.0
        for figure in get_args(CloudFigure)
    )


def _compare_at(
    exposure: Exposure,
    clock: Literal["nominal", "offset"],
    time: float,
    figure: CloudFigure,
    clouds: Sequence[CloudRecord],
) -> Comparison:
    """Compare one exposure with the cloud at `time`."""
    found = [c for c in clouds if same_time(c.time, time)]
    comparison = Comparison(
        source=exposure.source,
        clock=clock,
        nominal_time=exposure.time,
        time=time,
        outcome=_outcome(found),
        figure=figure,
        measured_radius=exposure.radius,
        measured_length=exposure.length,
    )
    if comparison.outcome != "compared":
        return comparison
    measure = found[0].measure
    radius, length = cloud_size(measure, figure)
    errors = compare(measure, exposure, figure)
    return comparison.model_copy(
        update={
            "radius": radius,
            "length": length,
            "radius_error_percent": _percent(errors.radius),
            "length_error_percent": _percent(errors.length),
        }
    )


def _outcome(
    found: Sequence[CloudRecord],
) -> Literal["compared", "not reached", "arrived"]:
    if not found:
        return "not reached"
    return "compared" if found[0].reason is None else "arrived"


def _percent(fraction: float | None) -> float | None:
    return None if fraction is None else 100.0 * fraction


def comparison_table(result: Result) -> Table:
    """Return the comparison with the measurements, for the end of a run.

    Parameters
    ----------
    result : Result

    Returns
    -------
    rich.table.Table
        One row per exposure and clock, in mm and %. It has no rows where
        nothing was measured.
    """
    table = Table(
        title="Debris cloud beside the experiment, in mm",
        caption=(
            f"Computed: {COMPARED_FIGURE} particle of the cloud. The nominal "
            "exposure time, and that time with the clock offset added."
        ),
    )
    table.add_column("exposure")
    table.add_column("compared at")
    for name in ("R_b", "L_b"):
        for text in (f"{name} exp.", f"{name} comp.", "error"):
            table.add_column(text, justify="right")
    for c in result.comparisons:
        if c.figure != COMPARED_FIGURE:
            continue
        missing = {"arrived": "cloud arrived"}.get(c.outcome, "not reached")
        table.add_row(
            f"{c.nominal_time * 1e6:g} µs",
            f"{c.time * 1e6:.2f} µs ({c.clock})",
            *_cells(c.measured_radius, c.radius, c.radius_error_percent, missing),
            *_cells(c.measured_length, c.length, c.length_error_percent, missing),
        )
    return table


def bodies_table(result: Result) -> Table:
    """Return how much of each body is molten and broken, for the end of a run.

    Parameters
    ----------
    result : Result

    Returns
    -------
    rich.table.Table
        One row per body. It has none where no model says what melts or breaks.
    """
    table = Table(title="Matter at the end")
    table.add_column("body")
    for name in (
        "mass in g",
        "molten",
        "broken",
        "momentum in kg m/s",
        "kinetic energy in J",
        "internal energy in J",
    ):
        table.add_column(name, justify="right")
    for body in result.bodies:
        shares = (share_text(x, "-") for x in (body.molten, body.broken))
        sums = (body.momentum_z, body.kinetic_energy, body.internal_energy)
        numbers = (f"{x:.4g}" for x in sums)
        table.add_row(body.name, f"{1e3 * body.mass:.4g}", *shares, *numbers)
    return table


def verdict_table(result: Result) -> Table:
    """Return the figures of a shield's wall at the end, for the end of a run.

    Parameters
    ----------
    result : Result
        With a verdict on a wall.
    """
    verdict = result.verdict
    assert verdict is not None, "only a shield has one"
    table = Table(title="The wall at the end", show_header=False)
    table.add_column("figure")
    table.add_column("value", justify="right")
    for name, text in wall_figures(verdict):
        table.add_row(name, text)
    return table


def wall_figures(verdict: Verdict) -> list[tuple[str, str]]:
    """Return the figures behind a verdict, each with its name and value as text."""
    wall = verdict.wall
    if wall is None:
        return []
    rest = verdict.rest_time
    return [
        ("damage over its critical value", f"{verdict.damage:.3g}"),
        ("tilt of the rear face along a thickness", f"{wall.shear:.3g}"),
        ("hole", f"{1e3 * wall.hole:.3g} mm"),
        ("sound share of any way through", f"{100 * wall.ligament:.0f} %"),
        ("sound share straight through", f"{100 * wall.sound_share:.0f} %"),
        ("bulge", f"{1e3 * wall.bulge:.3g} mm"),
        ("crater depth", f"{1e3 * wall.crater_depth:.3g} mm"),
        ("crater diameter", f"{1e3 * wall.crater_diameter:.3g} mm"),
        ("come off the rear face", f"{1e3 * wall.detached:.3g} g"),
        ("its mean velocity", f"{wall.detached_velocity:.3g} m/s"),
        ("its momentum", f"{wall.detached_momentum:.3g} kg m/s"),
        ("fastest sound way through", f"{wall.velocity:.3g} m/s"),
        ("at rest from", "not yet" if rest is None else f"{1e6 * rest:.3g} us"),
        ("verdict a sixth of the time earlier", verdict.earlier),
    ]


def share_text(share: float | None, unknown: str) -> str:
    """Return a share in %, or what stands for one that is not known."""
    if share is None or math.isnan(share):
        return unknown
    return f"{100.0 * share:.1f} %"


def _cells(
    measured: float | None, computed: float | None, error: float | None, missing: str
) -> tuple[str, str, str]:
    """Return measured and computed sizes [m] and the error [%] as text."""
    return (
        "-" if measured is None else f"{measured * 1e3:.1f}",
        missing if computed is None else f"{computed * 1e3:.1f}",
        "-" if error is None else f"{error:+.1f} %",
    )
