"""The tables on a run's page, in mm, km/s, us and GPa."""

import math
from collections.abc import Sequence
from datetime import datetime

from mpisph.case import Case
from mpisph.case.profiles import PROFILES
from mpisph.case.sections import Exposure, TimeStepping
from mpisph.case.shapes.shape import millimetres
from mpisph.core.words import counted, grouped
from mpisph.diagnostics.cloud import CloudFigure
from mpisph.io.result import Comparison, Result, share_text
from mpisph.io.stored_run import StoredRun
from mpisph.io.verdict import Verdict
from mpisph.physics.models import described
from mpisph.physics.response import KINDS, MaterialModels
from mpisph.report.page import NONE, Link, Table

Row = tuple[str | Link, ...]

OFFSET_TEXT = (
    "Exposure times are those of the experiment's clock, whose zero is not the moment "
    "of first contact. Each exposure is therefore compared twice: at its nominal time, "
    "as if there were no difference, and with the case's clock offset added."
)

_SMOOTHING = {
    "axisymmetric": "axisymmetric, eq (21) corrected",
    "classic": "classic, eq (20)",
    "fixed": "fixed",
    "printed": "eq (21) to the letter",
}

_PAIR_FORMS = {
    "consistent": "match the continuity equation",
    "lee2003": "as in eqs (5) and (6)",
}

_KIND_NAMES = {
    "eos": "equation of state",
    "porosity": "porosity",
    "thermal": "temperature",
    "strength": "strength",
    "failure": "failure in tension",
    "ductile": "ductile failure",
}
assert _KIND_NAMES.keys() == KINDS.keys()

_PHASES = {"output": "snapshots and checkpoints"}


def particle_count(run: StoredRun) -> str:
    """Return the number of particles; a dash where it is not known."""
    return NONE if run.particles is None else grouped(run.particles)


def signed(percent: float | None) -> str:
    """Return an error [%], always with a sign; a dash for none."""
    if percent is None:
        return NONE
    return f"{percent:+.1f}\u00a0%".replace("-", "\u2212")


def small(fraction: float) -> str:
    """Return a relative error."""
    return "0" if fraction == 0.0 else f"{fraction:.1e}".replace("-", "\u2212")


def mm(length: float | None) -> str:
    """Return a length [m] of a cloud in mm; a dash for none."""
    return NONE if length is None else f"{1e3 * length:.1f}"


def us(time: float) -> str:
    """Return a time [s] in us."""
    return f"{1e6 * time:.2f} µs"


def bodies_table(case: Case) -> Table:
    """Return the bodies: shape, size, velocity, material."""
    profiles = [
        key
        for key in PROFILES
        if any(getattr(body, key) not in {0.0, None} for body in case.bodies)
    ]
    rows: list[Row] = [
        (
            body.name,
            f"{body.label()}, {body.describe()}",
            f"{body.velocity / 1e3:g}",
            body.material,
            KINDS["eos"][case.body_models(body).names["eos"]].label,
            *(_profile(getattr(body, key)) for key in profiles),
        )
        for body in case.bodies
    ]
    heads = (
        *("body", "shape", "velocity [km/s]", "material", "equation of state"),
        *(f"{key.replace('_', ' ')} [{PROFILES[key].unit}]" for key in profiles),
    )
    return Table("Bodies", heads, rows)


def _profile(value: float | str | None) -> str:
    """Return a number or an expression; a dash for none."""
    if value is None:
        return NONE
    return value if isinstance(value, str) else f"{value:g}"


def materials_table(case: Case) -> Table:
    """Return the models of the materials and their constants, a column each."""
    used = case.material_table
    materials = [case.materials[models.material] for models in used]
    rows: list[Row] = [
        ("what it is", *(material.description or NONE for material in materials)),
        ("density ρ₀", *(f"{material.rho0:g} kg/m³" for material in materials)),
    ]
    for kind, name in _KIND_NAMES.items():
        rows.append((name, *(_model(models, kind) for models in used)))
    heads = ("", *(models.material for models in used))
    return Table("Materials", heads, rows, "Sources are given in the case file below.")


def _model(models: MaterialModels, kind: str) -> str:
    """Return the model of one kind that a material is used with, and its constants."""
    model = KINDS[kind][models.names[kind]]
    if model.constants is None:
        return model.label
    numbers = described(models.constants[model.name])
    return f"{model.label}: " + ", ".join(
        f"{name.replace('_', ' ')} {_number(value, unit)}"
        for name, value, unit in numbers
    )


def _number(value: float | str, unit: str) -> str:
    """Return a constant in the unit of a workshop."""
    if isinstance(value, str):
        return value
    if unit in {"Pa", "J/kg"}:
        for factor, prefix in ((1e9, "G"), (1e6, "M")):
            if factor <= abs(value) < math.inf:
                return f"{value / factor:g}\u00a0{prefix}{unit}"
    return f"{value:g}\u00a0{unit}" if unit else f"{value:g}"


def setup_table(run: StoredRun) -> Table:
    """Return resolution, scheme switches, time step and the cloud's definition."""
    case, scheme = run.case, run.case.scheme
    resolution, viscosity, heat = case.resolution, scheme.viscosity, scheme.heat
    spacing = f"spacing {millimetres(case.spacing)}"
    if resolution.npr is not None:
        spacing = f"NPR {resolution.npr}, along {resolution.reference}: {spacing}"
    smoothing = (
        f"NPH {resolution.nph:g}: {millimetres(case.smoothing_length)} at the start"
    )
    rows: list[Row] = [
        ("particle spacing", spacing),
        ("particles", particle_count(run)),
        ("smoothing length", f"{smoothing}; {_SMOOTHING[scheme.smoothing]}"),
        (
            "artificial viscosity",
            f"α {viscosity.alpha:g}, β {viscosity.beta:g}, ε {viscosity.epsilon:g}; "
            f"{viscosity.form} form",
        ),
        (
            "artificial heat",
            f"g₁ {heat.g1:g}, g₂ {heat.g2:g}" if heat.enabled else "off",
        ),
        (
            "kernel",
            f"Gaussian, cut at {scheme.kappa:g} h; a ring "
            f"{'acts' if scheme.self_term else 'does not act'} on itself",
        ),
        ("pair forces", _PAIR_FORMS[scheme.pair_form]),
        *(
            ("rigid plane", f"z = {millimetres(plane)}")
            for plane in case.boundary.planes
            if math.isfinite(plane)
        ),
        ("time step", _step(case.time)),
        ("end of the run", us(case.end_time)),
    ]
    return Table("Resolution and scheme", ("", ""), rows + _cloud_rows(case))


def _step(time: TimeStepping) -> str:
    if time.step == "fixed":
        return f"fixed, {1e9 * (time.dt or 0.0):g} ns"
    most = f", at most {1e9 * time.dt:g} ns" if time.dt else ""
    return f"automatic, {time.cfl:g} of the stability limits{most}"


def _cloud_rows(case: Case) -> list[Row]:
    """Return what counts as the cloud, where there is a plate for it to leave."""
    measured = case.measured
    if measured is None or case.measured_plate is None:
        return []
    return [
        (
            "cloud",
            f"behind the rear face of {case.measured_plate.name}, moving faster than "
            f"{measured.min_velocity_fraction:g} of the impact velocity",
        ),
        ("clock offset", us(measured.clock_offset)),
    ]


def cloud_table(run: StoredRun) -> Table:
    """Return R_b and L_b, measured and computed, at both readings of the clock."""
    measured = run.case.measured
    quantile = measured.quantile if measured else 1.0
    by_clock: dict[tuple[str, float, float], dict[CloudFigure, Comparison]] = {}
    for c in run.comparisons:
        by_clock.setdefault((c.source, c.nominal_time, c.time), {})[c.figure] = c
    rows: list[Row] = []
    for found in by_clock.values():
        outermost, robust = found["outermost"], found["robust"]
        rows.append(
            (
                _when(outermost),
                mm(outermost.measured_radius),
                _with_error(outermost, "radius"),
                _with_error(robust, "radius"),
                mm(outermost.measured_length),
                _with_error(outermost, "length"),
                _with_error(robust, "length"),
            )
        )
    twice = any(c.clock == "offset" for c in run.comparisons)
    when = OFFSET_TEXT if twice else "Compared at the nominal times: no clock offset."
    caption = (
        f"Sizes in mm, with the error. {when} Outermost: by the cloud's outermost "
        f"particle; robust: within which {100 * quantile:g} % of its mass lies. "
        f"Measured: {'; '.join(dict.fromkeys(c.source for c in run.comparisons))}."
    )
    kinds = ("measured", "outermost", "robust")
    heads = [f"{name} {kind}" for name in ("R_b", "L_b") for kind in kinds]
    return Table("", ("exposure", *heads), rows, caption, numbers=True)


def _when(comparison: Comparison) -> str:
    """Return an exposure and how the clock was read."""
    nominal = f"{1e6 * comparison.nominal_time:g} µs"
    if comparison.clock == "nominal":
        return f"{nominal}, nominal"
    shift = 1e6 * (comparison.time - comparison.nominal_time)
    return f"{nominal} {shift:+.2f} µs, offset".replace("+", "+ ").replace(
        "-", "\u2212 "
    )


def condition_table(run: StoredRun) -> Table:
    """Return how much of each body is molten and broken at the end.

    Without rows of a run that has not ended, and where no model says such.
    """
    rows: list[Row] = [
        (
            body.name,
            f"{1e3 * body.mass:.4g}",
            share_text(body.molten, NONE),
            share_text(body.broken, NONE),
        )
        for body in (run.result.bodies if run.result else ())
    ]
    caption = (
        "At the end, in shares of the body's mass. Broken: its damage is 1, it bears "
        "neither tension nor shear. A dash: the material has no such model."
    )
    heads = ("body", "mass [g]", "molten", "broken")
    return Table("", heads, rows, caption, numbers=True)


def wall_table(verdict: Verdict) -> Table:
    """Return what is measured on the wall of a shield at the end.

    Without rows where the run broke down before anything was measured.
    """
    wall = verdict.wall
    if wall is None:
        return Table("The wall at the end", ("", ""), [])
    rest = NONE if verdict.rest_time is None else us(verdict.rest_time)
    off = wall.detached > 0.0
    rows: list[Row] = [
        ("damage over the critical one", f"{verdict.damage:.2f}"),
        ("hole in the sound wall, diameter", _size(wall.hole)),
        (
            "sound ligament, least share of a way through",
            f"{100 * wall.ligament:.0f} %",
        ),
        ("sound straight through, least share", f"{100 * wall.sound_share:.0f} %"),
        ("tilt of the rear face along a thickness", f"{wall.shear:.3f}"),
        ("bulge of the rear face", _size(wall.bulge)),
        ("crater, depth", _size(wall.crater_depth)),
        ("crater, diameter", _size(wall.crater_diameter)),
        ("come off the rear face, mass", _milligrams(wall.detached) if off else "none"),
        ("its axial velocity", f"{wall.detached_velocity:.0f} m/s" if off else NONE),
        ("its axial momentum", _momentum_text(wall.detached_momentum) if off else NONE),
        ("fastest sound way through the wall", f"{wall.velocity:.0f} m/s"),
        ("at rest from", rest),
        ("verdict a sixth of the time earlier", verdict.earlier),
    ]
    caption = (
        "A dash: there is none. At rest: from then on the bulge stays as it is at the "
        "end."
    )
    return Table("The wall at the end", ("", ""), rows, caption, numbers=True)


def _size(length: float) -> str:
    """Return a length [m] in mm, or that there is none."""
    return f"{1e3 * length:.2f} mm" if length > 0.0 else "none"


def _milligrams(mass: float) -> str:
    return f"{1e6 * mass:.3g} mg" if mass < 1e-3 else f"{1e3 * mass:.3g} g"


def _momentum_text(momentum: float) -> str:
    return f"{1e3 * momentum:.3g} mN s".replace("-", "\u2212")


def shares_table(run: StoredRun) -> Table:
    """Return momentum and energies of each body of a shield at the end."""
    bodies = run.result.bodies if run.result else ()
    whole = sum(body.momentum_z for body in bodies)
    rows: list[Row] = [
        (
            body.name,
            f"{1e3 * body.mass:.4g}",
            f"{1e3 * body.momentum_z:.4g}".replace("-", "\u2212"),
            f"{100 * body.momentum_z / whole:.1f}".replace("-", "\u2212"),
            f"{1e-3 * body.kinetic_energy:.3g}",
            f"{1e-3 * body.internal_energy:.3g}".replace("-", "\u2212"),
        )
        for body in bodies
    ]
    caption = (
        "At the end: mass, axial momentum and its share of the whole, energies. What "
        "is thrown back counts with its body."
    )
    heads = (
        "body", "mass [g]", "momentum [mN s]", "share [%]", "kinetic [kJ]",
        "internal [kJ]",
    )  # fmt: skip
    title = "Momentum and energy by body"
    return Table(title, heads, rows, caption, numbers=True)


def _momentum(error: float | None) -> list[Row]:
    return [] if error is None else [("axial momentum", small(error))]


def conservation_table(run: StoredRun) -> Table:
    """Return the errors of what should be conserved; of a run that has a result."""
    assert run.result is not None, "a run that has ended"
    c = run.result.conservation
    rows: list[Row] = [
        ("mass", small(c.mass_error)),
        *_momentum(c.momentum_z_error),
        ("total energy", small(c.energy_error_final)),
        ("total energy, largest during the run", small(c.energy_error_max)),
        *_lowest_energy(run.result),
    ]
    caption = "Changes since the start, relative to the initial values."
    return Table("Conservation", ("quantity", "error"), rows, caption, numbers=True)


def _lowest_energy(result: Result) -> list[Row]:
    """Return how far internal energies fell below zero, where that is known."""
    lowest = result.lowest_energy
    if lowest is None:
        return []
    text = "0" if lowest == 0.0 else f"{1e-6 * lowest:.3g} MJ/kg".replace("-", "\u2212")
    return [("lowest internal energy of a particle", text)]


def timing_table(run: StoredRun) -> Table:
    """Return what the run took, and where; of a run that has a result."""
    assert run.result is not None, "a run that has ended"
    t = run.result.timing
    known = sum(t.timers.values())
    rows: list[Row] = [
        (_PHASES.get(name, name), f"{spent:.2f}", f"{100 * spent / t.wall:.0f} %")
        for name, spent in sorted(t.timers.items(), key=lambda item: -item[1])
    ]
    if t.wall > known:
        rest = t.wall - known
        rows.append(("everything else", f"{rest:.2f}", f"{100 * rest / t.wall:.0f} %"))
    rows.append(("whole run", f"{t.wall:.2f}", "100 %"))
    slowest = ", of which the slowest counts" * (t.ranks > 1)
    caption = (
        f"{grouped(t.steps)} steps on {counted(t.ranks, 'rank')}{slowest}; "
        f"{t.step_ms:.3g} ms a step, {t.interaction_ns:.3g} ns a directed interaction."
    )
    return Table("Time", ("phase", "s", "share"), rows, caption, numbers=True)


def program_text(run: StoredRun) -> str:
    """Return with what, on how many ranks, in how many starts and when a run ran."""
    made, status = run.provenance, run.status
    version = f"mpisph {made.get('mpisph', '')}".strip()
    if made.get("revision"):
        version += f", revision {made['revision'][:12]}"
    starts = f" in {status.starts} starts" * (status.starts > 1)
    ended = f"{datetime.fromisoformat(status.updated):%d %B %Y, %H:%M %Z}"
    return f"{version}, on {counted(status.ranks, 'rank')}{starts}, {ended}"


def provenance_table(run: StoredRun) -> Table:
    """Return the versions and the revision of the program."""
    rows: list[Row] = [
        ("revision of mpisph" if name == "revision" else name, text)
        for name, text in run.provenance.items()
    ]
    status = run.status
    rows += [("ranks", str(status.ranks)), ("starts", str(status.starts))]
    rows += [("last started", status.started), ("last update", status.updated)]
    return Table("", ("", ""), rows)


def runs_table(runs: Sequence[tuple[StoredRun, str]]) -> Table:
    """Return runs side by side.

    Parameters
    ----------
    runs : sequence of (StoredRun, str)
        With the ids of their places on the page.

    Returns
    -------
    Table
    """
    return Table(
        "The runs",
        ("run", "state", "particles", "NPR", "NPH", "α, β", "steps", "time reached",
         "energy error", "wall time [s]"),
        [_run_row(run, place) for run, place in runs],
        numbers=True,
    )  # fmt: skip


def _run_row(run: StoredRun, place: str) -> Row:
    case, result = run.case, run.result
    viscosity = case.scheme.viscosity
    return (
        Link(run.name, place),
        run.state,
        particle_count(run),
        str(case.resolution.npr or NONE),
        f"{case.resolution.nph:g}",
        f"{viscosity.alpha:g}, {viscosity.beta:g}",
        grouped(result.step if result else run.status.step),
        us(result.time if result else run.status.time),
        small(result.conservation.energy_error_max) if result else NONE,
        f"{result.timing.wall:.1f}" if result else NONE,
    )


def comparison_table(runs: Sequence[tuple[StoredRun, str]]) -> Table | None:
    """Return the runs' R_b and L_b side by side; None where nothing was measured.

    Parameters
    ----------
    runs : sequence of (StoredRun, str)
        With the ids of their places on the page.

    Returns
    -------
    Table or None
    """
    rows = [
        _exposure_row(run, place, exposure)
        for run, place in runs
        if run.case.measured is not None
        for exposure in run.case.measured.exposures
    ]
    if not rows:
        return None
    kinds = ("measured", "nominal", "offset")
    heads = [f"{name} {kind}" for name in ("R_b", "L_b") for kind in kinds]
    caption = (
        f"Outermost particles, in mm, with the error. {OFFSET_TEXT} A dash: not "
        "reached, or not measured."
    )
    return Table(
        "Comparison with the experiment",
        ("run", "exposure", *heads),
        rows,
        caption,
        numbers=True,
    )


def _exposure_row(run: StoredRun, place: str, exposure: Exposure) -> Row:
    found = {
        c.clock: c
        for c in run.comparisons
        if c.figure == "outermost"
        and (c.nominal_time, c.source) == (exposure.time, exposure.source)
    }
    row: Row = (Link(run.name, place), f"{1e6 * exposure.time:g} µs")
    for name in ("radius", "length"):
        row += (mm(getattr(exposure, name)),)
        row += tuple(_with_error(found.get(c), name) for c in ("nominal", "offset"))
    return row


def _with_error(comparison: Comparison | None, name: str) -> str:
    """Return a computed size in mm with its error; a dash where it was not reached."""
    size = getattr(comparison, name, None)
    if size is None:
        return NONE
    error = getattr(comparison, f"{name}_error_percent")
    return mm(size) if error is None else f"{mm(size)} ({signed(error)})"
