"""The page of runs and studies."""

import math
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from mpisph.case import Case
from mpisph.case.contact import time_origin
from mpisph.case.sections import Exposure
from mpisph.case.times import same_time
from mpisph.core.words import counted, grouped
from mpisph.figures.cloud import draw_cloud
from mpisph.figures.dots import find_shadings
from mpisph.figures.embed import embed
from mpisph.figures.fields import choose_fields, condition_fields
from mpisph.figures.history import (
    HistoryFigure,
    RunHistory,
    draw_history,
    history_figures,
    shield_figures,
)
from mpisph.figures.movie import PANEL, Frame
from mpisph.figures.shield import draw_shield
from mpisph.figures.style import body_colour
from mpisph.figures.view import View, choose_view, common_view, only_finite
from mpisph.figures.wall import draw_wall, reason_text
from mpisph.io.files import write_text
from mpisph.io.snapshot import read_snapshot
from mpisph.io.stored_run import StoredRun, read_runs
from mpisph.io.verdict import Outcome
from mpisph.report.analysis import ANALYSES, analysis_tables, has_debris
from mpisph.report.page import Figure, Notice, Table, render
from mpisph.report.run_tables import (
    bodies_table,
    cloud_table,
    comparison_table,
    condition_table,
    conservation_table,
    materials_table,
    program_text,
    provenance_table,
    runs_table,
    setup_table,
    shares_table,
    timing_table,
    us,
    wall_table,
)
from mpisph.report.study_page import MOST_OPEN, StudyView, study_views
from mpisph.viewer import page as viewer

REPORT_FILE = "report.html"

PLAYED_PARTICLES = 20_000
"""Particles of a run that plays in the page, at most."""

PLAYED_SHARE = 0.3
"""What runs that play in a report take, of what a page that only plays them may."""

MOST_PANELS = 24
"""Small pictures of a run; of more snapshots some are chosen at even distances."""

_OUTCOMES: dict[Outcome, tuple[str, str]] = {
    "holds": ("The wall holds", "good"),
    "perforated": ("The wall is perforated", "bad"),
    "detached spall": ("Spall comes off the wall", "bad"),
    "undecided": ("Undecided", "warn"),
}
# What a page says of a verdict, and what kind of news that is.

_CUTS = "Bumper, cloud and wall"
_CUTS_CAPTION = (
    "Cuts through the axis, mirrored about it, all in one scale. What is thrown back "
    "and what flies past the wall may lie outside."
)
_WALL = "The wall close by"
_WALL_CAPTION = (
    "Grey lines: the original faces. Dotted: the edge of the hole, or else the deepest "
    "place of the crater and the highest of the bulge. Velocities are along the axis, "
    "those of the impact positive."
)
_LIMITS = (
    "The computation is axisymmetric: every fragment off the axis is a ring, so a lone "
    "solid fragment that hits the wall beside the axis cannot be represented, and a "
    "wall that holds here may still be holed by one."
)
# In one sentence, what the verdict cannot know.

_EXPOSED = "Cloud, plate and ejecta at the exposures"

_BADGES = {"completed": "good", "unstable": "bad", "failed": "bad", "killed": "bad"}


class Colour(NamedTuple):
    """What a colour of the small pictures stands for.

    Attributes
    ----------
    name : str
        Of a body.
    value : str
        As CSS writes it.
    """

    name: str
    value: str


class Debris(NamedTuple):
    """What is shown of the debris at one time.

    Attributes
    ----------
    title : str
    figures : list of Figure
    tables : list of Table
    """

    title: str
    figures: list[Figure]
    tables: list[Table]


class ShieldView(NamedTuple):
    """What is shown of a shield before all else.

    Attributes
    ----------
    outcome, kind, reason : str
        The verdict in words, what kind of news it is, and what decides it.
    tables : list of Table
        The wall; momentum and energy of the bodies.
    cuts, wall : list of Figure
        Cuts through the shield; the wall close by. None without snapshots.
    history : list of Figure
        How the wall comes to the verdict.
    limits : str
        What an axisymmetric computation cannot show.
    """

    outcome: str
    kind: str
    reason: str
    tables: list[Table]
    cuts: list[Figure]
    wall: list[Figure]
    history: list[Figure]
    limits: str


class RunView(NamedTuple):
    """What the template shows of a run.

    Attributes
    ----------
    place : str
        Id on the page.
    name, title, state, badge, verdict : str
        Folder, title of the case, how the run stands, and that as a kind and in words.
    notices : list of Notice
        What a reader must not miss.
    shield : ShieldView or None
        Verdict, wall and pictures of a shield; None of other cases.
    viewer : View or None
        The run, to be played; None without snapshots.
    bodies : Table
    setup : list of Table
        Materials, resolution and scheme.
    cloud : Table or None
        R_b and L_b; None without measurements.
    condition : Table
        What is molten and broken at the end, as far as models say it.
    condition_figures : list of Figure
        Damage and temperature at the end, likewise.
    pictures_title : str
    pictures : list of list of Figure
        Rows of large pictures: an exposure at its nominal time and with the offset.
    panels : list of Figure
        Small pictures of other snapshots.
    panels_text : str
        What their axes are, and how many are left out.
    colours : list of Colour
        Of the bodies in them.
    history : list of Figure
    analysis : list of Debris
    costs : list of Table
        Conservation and time; none of a run that has not ended.
    program : str
        Version, revision and ranks.
    provenance : Table
        All versions.
    case_text : str
        The case file.
    """

    place: str
    name: str
    title: str
    state: str
    badge: str
    verdict: str
    notices: list[Notice]
    shield: ShieldView | None
    viewer: viewer.View | None
    bodies: Table
    setup: list[Table]
    cloud: Table | None
    condition: Table
    condition_figures: list[Figure]
    pictures_title: str
    pictures: list[list[Figure]]
    panels: list[Figure]
    panels_text: str
    colours: list[Colour]
    history: list[Figure]
    analysis: list[Debris]
    costs: list[Table]
    program: str
    provenance: Table
    case_text: str


class _Shown(NamedTuple):
    """A snapshot that is shown large."""

    path: Path
    time: float
    exposure: Exposure | None
    title: str


def write_report(
    folders: Sequence[Path],
    out: Path,
    studies: Sequence[Path] = (),
    root: Path = Path("runs"),
) -> Path:
    """Write one HTML page of runs and studies.

    Parameters
    ----------
    folders : sequence of Path
        Folders of runs, in any state.
    out : Path
        The page; its folder is made where missing.
    studies : sequence of Path, optional
        Study files; they stand above the runs.
    root : Path, optional
        Folder of the studies' runs and tables.

    Returns
    -------
    Path
        `out`.

    Raises
    ------
    MpisphError
        If a folder holds no run, or one whose files cannot be understood; if a study
        or its claims cannot.
    OSError
        If a file cannot be read or written.
    """
    runs = read_runs(folders)
    placed = [(run, f"run-{index}") for index, run in enumerate(runs, 1)]
    tables = [runs_table(placed), comparison_table(placed)] if len(runs) > 1 else []
    views = [_run_view(run, place, len(placed)) for run, place in placed]
    varied = study_views(studies, root)
    titles = [s.title for s in varied] + [s.title for s in views]
    html = render(
        "runs.html",
        title=titles[0] if len(titles) == 1 else _page_title(varied, views),
        tables=[table for table in tables if table is not None],
        studies=varied,
        runs=views,
        library=viewer.library() if any(s.viewer for s in views) else "",
        most_open=MOST_OPEN,
    )
    out.parent.mkdir(parents=True, exist_ok=True)
    write_text(out, html)
    return out


def _page_title(varied: Sequence[StudyView], views: Sequence[RunView]) -> str:
    """Return how many studies and runs a page shows."""
    studies = "1 study" if len(varied) == 1 else f"{len(varied)} studies"
    kinds = [studies] * bool(varied) + [counted(len(views), "run")] * bool(views)
    return f"{' and '.join(kinds)} of mpisph"


def _run_view(run: StoredRun, place: str, runs: int) -> RunView:
    """Return what the page shows of a run, one of so many."""
    shown = _large(run)
    large = {item.path for item in shown}
    small = _small(run, large)
    # Of what is pictured alone: a run may have very many snapshots.
    paths = [*large, *(path for path, _ in small)]
    view = common_view(paths, run.case) if paths else None
    panels = [] if view is None else _panels(run.case, small, view)
    ended = run.result is not None
    judged = run.case.shield is not None and not run.comparisons
    exposed = any(item.exposure is not None for item in shown)
    return RunView(
        place=place,
        name=run.name,
        title=run.case.title,
        state=run.state,
        badge=_BADGES.get(run.state, "warn"),
        verdict=_verdict(run),
        notices=_notices(run),
        shield=_shield_view(run),
        viewer=_played(run, runs) if run.snapshots else None,
        bodies=bodies_table(run.case),
        setup=[setup_table(run), materials_table(run.case)],
        cloud=cloud_table(run) if run.comparisons else None,
        condition=condition_table(run),
        condition_figures=_condition_figures(run),
        pictures_title=_EXPOSED if exposed else "Particles",
        pictures=[] if judged else _pictures(run.case, shown, view),
        panels=panels,
        panels_text=_panels_text(len(small), len(run.snapshots) - len(large)),
        colours=[
            Colour(body.name, body_colour(index))
            for index, body in enumerate(run.case.bodies)
        ],
        history=_history(run),
        analysis=_analysis(run.case, _analysed(shown, _arrival(run))),
        costs=[conservation_table(run), timing_table(run)] if ended else [],
        program=program_text(run),
        provenance=provenance_table(run),
        case_text=run.case_text,
    )


def _shield_view(run: StoredRun) -> ShieldView | None:
    """Return the verdict on a shield with all that tells why."""
    if run.case.shield is None:
        return None
    data = RunHistory.of(run)
    verdict = data.verdict
    tables = [wall_table(verdict)] if verdict else []
    cuts, wall = [], []
    if run.snapshots:
        cuts.append(Figure(_CUTS, embed(partial(draw_shield, run)), _CUTS_CAPTION))
        wall.append(Figure(_WALL, embed(partial(draw_wall, run)), _WALL_CAPTION))
    outcome, kind = "The wall is not judged yet", "unknown"
    reason = "The run has not ended."
    if verdict is not None:
        outcome, kind = _OUTCOMES[verdict.outcome]
        reason = reason_text(verdict)
        reason = reason[0].upper() + reason[1:].rstrip(".") + "."
    return ShieldView(
        outcome=outcome,
        kind=kind,
        reason=reason,
        tables=[*tables, shares_table(run)],
        cuts=cuts,
        wall=wall,
        history=[_history_figure(item, data) for item in shield_figures(data)],
        limits=_LIMITS,
    )


def _played(run: StoredRun, runs: int) -> viewer.View:
    """Return the run to be played; that of a shield by damage and speed."""
    first = read_snapshot(run.snapshots[0][0]).arrays
    names = ("damage", "speed") if run.case.shield and "damage" in first else ()
    chosen = choose_fields(names, ())
    shown = viewer.shown_run(run, chosen, PLAYED_PARTICLES, PLAYED_SHARE / runs)
    return viewer.make_view([run], [shown], chosen, within=True)


def _large(run: StoredRun) -> list[_Shown]:
    """Return the snapshots at the exposures, or else the last and one before it.

    That is the last that shows the whole cloud, or one halfway.
    """
    measured = run.case.measured
    shown = []
    if measured is not None:
        offset = measured.clock_offset
        clocks = [(0.0, "nominal time"), (offset, f"clock offset {us(offset)}")]
        for exposure in measured.exposures:
            for shift, words in clocks if offset else clocks[:1]:
                title = f"Exposure at {1e6 * exposure.time:g} µs, {words}"
                shown += [
                    _Shown(path, time, exposure, title)
                    for path, time in run.snapshots
                    if same_time(time, exposure.time + shift)
                ]
    if not shown:
        arrival = _arrival(run)
        whole = [s for s in run.snapshots if s[1] < arrival]
        first = run.snapshots[len(run.snapshots) // 2 : -1][:1]
        if len(whole) < len(run.snapshots):
            first = whole[-1:]
        chosen = [*first, *run.snapshots[-1:]]
        shown = [_Shown(path, time, None, "") for path, time in chosen]
    return [item._replace(title=item.title + _after(item, run.case)) for item in shown]


def _arrival(run: StoredRun) -> float:
    """Return when the cloud has reached the next body [s]; infinite if it has not."""
    if not run.history.size:
        return math.inf
    after = np.isnan(run.history["cloud_length"])
    return float(run.history["time"][after].min(initial=math.inf))


def _after(item: _Shown, case: Case) -> str:
    when = f"{us(item.time)} {time_origin(case.bodies, case.boundary)}"
    return f": {when}" if item.title else when


def _pictures(case: Case, shown: list[_Shown], view: View | None) -> list[list[Figure]]:
    """Return large pictures in one view, those of an exposure in one row."""
    rows: list[list[Figure]] = []
    for index, item in enumerate(shown):
        draw = partial(draw_cloud, item.path, case, exposure=item.exposure, view=view)
        figure = Figure(item.title, embed(draw))
        if index and shown[index - 1].exposure is item.exposure:
            rows[-1].append(figure)
        else:
            rows.append([figure])
    return rows


def _condition_figures(run: StoredRun) -> list[Figure]:
    """Return a picture of damage and temperature at the end, where models give them."""
    chosen = condition_fields(run.case)
    if not chosen or not run.snapshots:
        return []
    path, time = run.snapshots[-1]
    snapshot = only_finite(read_snapshot(path))
    view = choose_view(snapshot, run.case, None)
    shadings = find_shadings(chosen, [snapshot], view, run.case)
    draw = partial(draw_cloud, path, run.case, view=view, shadings=shadings)
    what = " and ".join(each.field.label for each in chosen).capitalize()
    when = f"{us(time)} {time_origin(run.case.bodies, run.case.boundary)}"
    return [Figure(f"{what}, {when}", embed(draw))]


def _small(run: StoredRun, large: set[Path]) -> list[tuple[Path, float]]:
    """Return the snapshots that are shown small, at even distances."""
    others = [(path, time) for path, time in run.snapshots if path not in large]
    return others[:: max(math.ceil(len(others) / MOST_PANELS), 1)]


def _panels(case: Case, chosen: list[tuple[Path, float]], view: View) -> list[Figure]:
    """Return small pictures of snapshots, all in one view."""
    frame = Frame(case, view, PANEL)
    figures = []
    for path, time in chosen:
        frame.show(read_snapshot(path))
        figures.append(Figure(us(time), embed(frame.save)))
    return figures


def _panels_text(shown: int, of: int) -> str:
    """Return how to read the small pictures, if there are any."""
    if not shown:
        return ""
    left_out = f"; {shown} of {of} are shown" if shown < of else ""
    return (
        "All in one scale, axial position to the right and radius upwards, in mm"
        f"{left_out}. Grey lines: original rear faces of plates; hatched: behind rigid "
        "planes."
    )


def _history(run: StoredRun) -> list[Figure]:
    data = RunHistory.of(run)
    return [_history_figure(item, data) for item in history_figures(data)]


def _history_figure(item: HistoryFigure, data: RunHistory) -> Figure:
    return Figure(item.title, embed(partial(draw_history, item, data)), item.caption)


def _analysis(case: Case, shown: list[_Shown]) -> list[Debris]:
    """Return the analyses of the snapshots shown that have a cloud."""
    found = []
    for item in shown:
        snapshot = only_finite(read_snapshot(item.path))
        if not has_debris(snapshot.arrays, case):
            continue
        figures = [
            Figure(a.title, embed(partial(a.draw, snapshot, case)), a.caption)
            for a in ANALYSES
        ]
        found.append(Debris(item.title, figures, analysis_tables(snapshot, case)))
    return found


def _analysed(shown: list[_Shown], arrival: float) -> list[_Shown]:
    """Return one snapshot for each exposure: that with the offset, where there is.

    After the cloud has reached the next body there is nothing to analyse.
    """
    last = {id(item.exposure): item for item in shown if item.time < arrival}
    return list(last.values())


def _verdict(run: StoredRun) -> str:
    """Return in a line how far the run came, and how near the experiment."""
    result, resolution = run.result, run.case.resolution
    npr = "" if resolution.npr is None else f"NPR {resolution.npr}, "
    size = f"{npr}NPH {resolution.nph:g}"
    if run.particles is not None:
        size = f"{grouped(run.particles)} particles ({size})"
    if result is None:
        step, end = grouped(run.status.step), us(run.case.end_time)
        reached = f"step {step}, {us(run.status.time)} of {end}."
    else:
        wall = f"{result.timing.wall:.1f} s on {counted(result.timing.ranks, 'rank')}"
        reached = f"{grouped(result.step)} steps to {us(result.time)} in {wall}."
    return " ".join([f"{size}, {reached}", *_nearness(run)])


def _nearness(run: StoredRun) -> Iterator[str]:
    """Say how large the errors are, if anything was measured."""
    worst: dict[str, float] = {}
    for c in run.comparisons:
        for error in (c.radius_error_percent, c.length_error_percent):
            if error is not None and c.figure == "outermost":
                worst[c.clock] = max(worst.get(c.clock, 0.0), abs(error))
    if worst:
        words = {"nominal": "at the nominal times", "offset": "with the clock offset"}
        parts = [f"{worst[c]:.1f} % {words[c]}" for c in words if c in worst]
        yield f"Largest error of R_b and L_b (outermost): {', '.join(parts)}."
    elif run.comparisons:
        yield "No measured exposure was reached."


def _notices(run: StoredRun) -> list[Notice]:
    """Return what a reader must not miss."""
    found = [Notice("warn", f"The run warned: {text}") for text in run.warnings]
    if not run.snapshots:
        found.append(Notice("warn", "There are no snapshots, and so no pictures."))
    if len(run.history) < 2:
        found.append(Notice("warn", "The history has no lines to draw."))
    if run.case.shield is not None and not run.comparisons:
        return [*_trouble(run), *found]
    if run.result is not None and run.result.cloud_arrival is not None:
        when = us(run.result.cloud_arrival)
        text = f"At {when} the cloud has reached the next body: its measures end there."
        found.append(Notice("info", text))
    if not run.comparisons:
        text = "The case names no measurements to compare with."
        found.append(Notice("info", text))
    return [*_trouble(run), *found]


def _trouble(run: StoredRun) -> Iterator[Notice]:
    """Say why a run has not ended as it should."""
    result, reason = run.result, run.status.reason
    because = f" ({reason})" if reason else ""
    match run.state:
        case "unstable" if result is not None:
            who = "" if result.particle is None else f", particle {result.particle}"
            yield Notice(
                "bad",
                f"Unstable ({result.reason}) at step {grouped(result.step)}, "
                f"{us(result.time)}{who}: {result.detail}. What the page shows is what "
                "was computed until then.",
            )
        case "stopped" | "failed" | "killed":
            kind = "warn" if run.state == "stopped" else "bad"
            how = "failed" if run.state == "failed" else f"was {run.state}"
            text = f"The run {how}{because}; mpisph resume continues it."
            yield Notice(kind, text)
        case "running":
            yield Notice("info", f"The run is in progress, as of {run.status.updated}.")
