"""What a page shows of a study: figures, ranges, claims, table."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

from mpisph.figures.embed import embed
from mpisph.report.page import Figure, Notice, Table
from mpisph.report.paper_tables import (
    Grid,
    agreement_table,
    best_table,
    grid_of,
    paper_table,
    ranges_text,
)
from mpisph.report.study_tables import (
    cases_table,
    convergence_table,
    provenance_table,
    setup_tables,
    trouble_tables,
)
from mpisph.study.columns import column_label
from mpisph.study.model import FigureSpec, Study, load_study
from mpisph.study.paper.best import best_sets
from mpisph.study.paper.checks import decide
from mpisph.study.paper.claims_file import Claim, Try, load_claims
from mpisph.study.paper.ranges import TOTALS, agreement
from mpisph.study.paper.verdict import Word
from mpisph.study.plots.axes import Clock, axis_of, clock_text
from mpisph.study.plots.convergence import convergence_panels
from mpisph.study.plots.draw import can_draw, draw_figure
from mpisph.study.store import CASES_FOLDER, STANDINGS, Standing, study_folder
from mpisph.study.table import TABLE_FILE, Row, collect

CLAIMS_FILE = "claims.toml"
"""Lies beside the study files."""

MOST_OPEN = 20
"""Rows of a table that is shown without being opened."""

_STANDING_BADGES: dict[Standing, str] = {
    "completed": "good",
    "unstable": "bad",
    "failed": "bad",
    "stopped": "warn",
    "running": "warn",
    "to do": "",
}

_WORD_BADGES: dict[Word, str] = {
    "reproduced": "good",
    "in part": "warn",
    "not reproduced": "bad",
    "undecided": "",
    "not run": "",
}

_CAPTIONS = {
    "lines": "Left or above: nominal times; right or below: with the clock offset. "
    "Crosses at the bottom of a panel: unstable runs.",
    "map": "A cell for each run: mean of the absolute errors of all measured figures.",
    "shots": "(computed − measured)/measured, for every measured figure.",
    "columns": "At the end of each run, unless a time is named. Crosses at the bottom, "
    "or hatched cells: unstable runs.",
    "convergence": "The axis is 1/NPR: the finest runs are on the left.",
}


class Badge(NamedTuple):
    """A word on a colour.

    Attributes
    ----------
    kind : str
        ``good``, ``bad``, ``warn`` or empty.
    text : str
    """

    kind: str
    text: str


class TryView(NamedTuple):
    """A try of a claim.

    Attributes
    ----------
    name : str
    badge : Badge
        The verdict.
    figure : str
        The numbers behind it.
    """

    name: str
    badge: Badge
    figure: str


class ClaimView(NamedTuple):
    """A claim with its tries, the first of which decides."""

    number: int
    text: str
    tries: list[TryView]
    finding: str


class StudyView(NamedTuple):
    """What the template shows of a study.

    Attributes
    ----------
    place : str
        Id on the page.
    name, title, source : str
        Of the study; the source may be empty.
    total : int
        Number of cases.
    standings : list of Badge
        How many cases stand how.
    notices : list of Notice
    setup : list of Table
        What is varied, fixed and measured.
    figures : list of Figure
    convergence : list of Table
        Extrapolated values, for each reading of the clock.
    ranges : Table or None
        Agreement with the paper's ranges as a whole.
    ranges_text : str
        How to read the grids.
    grids : list of Grid
        The ranges beside the paper's, for each reading of the clock.
    best : Table or None
        The best sets of parameters; None where the study does not ask for them.
    paper : Table
        Single figures of the paper beside the runs'.
    claims : list of ClaimView
        Those that look at this study.
    cases : Table
        The study's table.
    troubles : list of Table
        Cases that did not come to their end.
    provenance : Table
    """

    place: str
    name: str
    title: str
    source: str
    total: int
    standings: list[Badge]
    notices: list[Notice]
    setup: list[Table]
    figures: list[Figure]
    convergence: list[Table]
    ranges: Table | None
    ranges_text: str
    grids: list[Grid]
    best: Table | None
    paper: Table
    claims: list[ClaimView]
    cases: Table
    troubles: list[Table]
    provenance: Table


class _Loaded(NamedTuple):
    """A study with its table."""

    study: Study
    rows: list[Row]


def study_views(paths: Sequence[Path], root: Path) -> list[StudyView]:
    """Return what a page shows of studies.

    Parameters
    ----------
    paths : sequence of Path
        The study files.
    root : Path
        Folder of the runs; nothing is written into it.

    Returns
    -------
    list of StudyView
        In the order of `paths`.

    Raises
    ------
    MpisphError
        If a study, its claims or a file of a run cannot be understood.
    OSError
        If a file cannot be read.
    """
    studies = [load_study(path) for path in paths]
    loaded = [_Loaded(study, collect(study, root)) for study in studies]
    return [
        _study_view(item, loaded, f"study-{index}", root)
        for index, item in enumerate(loaded, 1)
    ]


def _study_view(
    item: _Loaded, loaded: Sequence[_Loaded], place: str, root: Path
) -> StudyView:
    study, rows = item
    figures = _figures(study, rows)
    found = [agreement(study, rows, clock) for clock in TOTALS]
    ranges = agreement_table(study, found) if found[0].cells else None
    sets = best_sets(study, rows, root) if study.file.clock_from else None
    table = study_folder(root, study) / TABLE_FILE
    files = {
        "study file": str(study.path),
        "runs": f"{root / CASES_FOLDER}, by the names in the column run of the table",
        "table with all columns": f"{table}; mpisph study collect writes it again",
    }
    return StudyView(
        place=place,
        name=study.name,
        title=study.file.title,
        source=study.file.source or "",
        total=len(rows),
        standings=_standings(rows),
        notices=list(_notices(study, rows, figures)),
        setup=setup_tables(study),
        figures=figures,
        convergence=_convergence(study, rows),
        ranges=ranges,
        ranges_text=ranges_text(study) if ranges else "",
        grids=[grid for a in found if (grid := grid_of(study, a)) is not None],
        best=None if sets is None else best_table(study, sets),
        paper=paper_table(study, rows),
        claims=_claims(study, loaded),
        cases=cases_table(study, rows),
        troubles=trouble_tables(study, rows),
        provenance=provenance_table(rows, files),
    )


def _standings(rows: Sequence[Row]) -> list[Badge]:
    found = Counter(row["status"] for row in rows)
    return [
        Badge(_STANDING_BADGES[standing], f"{found[standing]} {standing}")
        for standing in STANDINGS
        if found[standing]
    ]


def _notices(
    study: Study, rows: Sequence[Row], figures: Sequence[Figure]
) -> Iterator[Notice]:
    """Say what is missing, and what went wrong."""
    found = Counter(row["status"] for row in rows)
    todo, whole = found["to do"], len(rows)
    again = "mpisph study run continues the study."
    if todo == whole:
        yield Notice("warn", f"No case has been run yet: {again}")
    elif todo:
        yield Notice("warn", f"{_of(todo, whole)} not been run: {again}")
    if found["stopped"]:
        yield Notice("warn", f"{_of(found['stopped'], whole)} been stopped: {again}")
    if found["failed"]:
        text = f"{_of(found['failed'], whole)} failed; the reasons are given below."
        yield Notice("bad", text)
    if found["running"]:
        yield Notice("info", f"{found['running']} of {whole} cases are running.")
    if study.file.figure is not None and not figures:
        yield Notice("warn", "There is no figure yet: no run has results to draw.")


def _of(some: int, whole: int) -> str:
    return f"{some} of {whole} cases {'has' if some == 1 else 'have'}"


def _figures(study: Study, rows: Sequence[Row]) -> list[Figure]:
    """Draw the study's figure, by all readings of the clock."""
    figures = []
    for given in _by_clock(study):
        spec = given.file.figure
        if spec is not None and can_draw(given, rows):
            picture = embed(partial(draw_figure, given, rows))
            title = _figure_title(given, spec)
            kind = "columns" if study.drawn else spec.kind
            figures.append(Figure(title, picture, _CAPTIONS[kind]))
    return figures


def _by_clock(study: Study) -> list[Study]:
    """Return the study with figures that show both readings of the clock.

    One of kind ``convergence`` shows a reading alone.
    """
    spec = study.file.figure
    if spec is None:
        return []
    measured = [case.case.measured for case in study.cases]
    shifted = any(m is not None and m.clock_offset for m in measured)
    clocks: tuple[Clock, ...] = ("nominal", "offset") if shifted else ("nominal",)
    alone = spec.kind == "convergence" and not study.drawn
    sets = [(clock,) for clock in clocks] if alone else [clocks]
    figures = [spec.model_copy(update={"clocks": chosen}) for chosen in sets]
    files = [study.file.model_copy(update={"figure": figure}) for figure in figures]
    return [study._replace(file=file) for file in files]


def _figure_title(study: Study, spec: FigureSpec) -> str:
    labels = {name: axis_of(study, name).label or name for name in spec.axes().values()}
    sizes = " and ".join(spec.quantities)
    if study.drawn:
        sizes = ", ".join(column_label(name).replace("$", "") for name in study.drawn)
    match spec.kind:
        case "lines":
            return f"{sizes} over {labels[spec.x or '']}"
        case "map":
            x, y = labels[spec.x or ""], labels[spec.lines or ""]
            return f"{sizes if study.drawn else 'Total error'} over {x} and {y}"
        case "shots":
            return f"Errors of {sizes}"
        case _ if study.drawn:
            return f"{sizes} against resolution"
        case _:
            return f"Against resolution, {clock_text(study, spec.clocks[-1])}"


def _convergence(study: Study, rows: Sequence[Row]) -> list[Table]:
    """Return the extrapolated values of a study over resolutions."""
    tables = []
    for given in _by_clock(study):
        spec = given.file.figure
        if spec is not None and spec.kind == "convergence":
            panels = convergence_panels(given, spec, rows)
            clock = clock_text(given, spec.clocks[-1])
            title = "at the end of the run" if study.drawn else clock
            tables.append(convergence_table(panels, title[0].upper() + title[1:]))
    return [table for table in tables if table.rows]


def _claims(study: Study, loaded: Sequence[_Loaded]) -> list[ClaimView]:
    """Return the claims that look at a study, by the tables on this page."""
    path = study.path.with_name(CLAIMS_FILE)
    if not path.exists():
        return []
    tables = {
        item.study.name: item
        for item in loaded
        if item.study.path.parent.resolve() == path.parent.resolve()
    }
    studies = {name: item.study for name, item in tables.items()}
    return [
        _claim(claim, tables)
        for claim in load_claims(path, studies.get).claims
        if any(attempt.study == study.name for attempt in claim.tries)
    ]


def _claim(claim: Claim, tables: Mapping[str, _Loaded]) -> ClaimView:
    tries = [_try(attempt, tables.get(attempt.study)) for attempt in claim.tries]
    return ClaimView(claim.number, claim.text, tries, claim.finding)


def _try(attempt: Try, item: _Loaded | None) -> TryView:
    if item is None:
        text = f"looks at the study {attempt.study}, which is not on this page"
        return TryView(attempt.name, Badge("", "elsewhere"), text)
    verdict = decide(attempt, *item)
    return TryView(
        attempt.name, Badge(_WORD_BADGES[verdict.word], verdict.word), verdict.figure
    )
