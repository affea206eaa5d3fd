"""The page of an assessment: shares right, confusion, figure, misses with pictures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

from mpisph.core.words import counted
from mpisph.figures.cloud import FIGURES_FOLDER
from mpisph.figures.embed import embed, embed_file
from mpisph.figures.wall import WALL_FILE, draw_wall
from mpisph.io.files import write_text
from mpisph.io.snapshot import read_series
from mpisph.io.stored_run import read_run
from mpisph.report.page import Figure, Notice, Table, render
from mpisph.report.study_page import MOST_OPEN
from mpisph.report.study_tables import provenance_table
from mpisph.study.assess.cases import STUDY_FILE, Assessment
from mpisph.study.assess.outcome import TABLE_FILE, Assessed
from mpisph.study.assess.scatter import can_draw, draw_scatter
from mpisph.study.assess.scores import misses, score
from mpisph.study.assess.summary import (
    Sheet,
    all_sheet,
    confusion_sheet,
    misses_sheet,
    shares_sheet,
    sources_sheet,
    stand_in_sheet,
    undecided_sheet,
)
from mpisph.study.table import Row

__all__ = ["PAGE_FILE", "write_page"]

PAGE_FILE = "assess.html"

MOST_PICTURES = 24
"""Misses that are shown with a picture, the worst first."""

_CAPTION = (
    "A mark for each test: above the line the computed verdict is that the wall fails, "
    "right of the dashed line the equation’s is. Triangles (failed in the test) should "
    "stand above, circles (held) below. Marks at the edge lie beyond it."
)


def write_page(made: Assessment, tests: Sequence[Assessed], root: Path) -> Path:
    """Write the page into the folder of an assessment.

    Parameters
    ----------
    made : Assessment
    tests : sequence of Assessed
        From `assess`.
    root : Path
        Folder of the study and its runs.

    Returns
    -------
    Path
        The page.

    Raises
    ------
    OSError
        If a file cannot be read or written.
    """
    wrong = misses(tests)
    pictures = [
        figure
        for item in wrong[:MOST_PICTURES]
        if (figure := _picture(item)) is not None
    ]
    figures = []
    if can_draw(tests):
        picture = embed(partial(draw_scatter, tests))
        figures = [Figure("Damage of the walls against d/d_c", picture, _CAPTION)]
    files = {
        "study": f"{root / STUDY_FILE}, with a case for each test",
        "table with all figures": str(root / TABLE_FILE),
    }
    html = render(
        "assess.html",
        title=made.study.file.title,
        verdict=_verdict(tests),
        notices=list(_notices(tests)),
        shares=_table(shares_sheet(tests)),
        confusion=_table(confusion_sheet(tests), titled=True),
        sources=_table(sources_sheet(tests), titled=True),
        figures=figures,
        misses=_table(misses_sheet(tests)),
        pictures=pictures,
        undecided=_table(undecided_sheet(tests)),
        alloys=_table(stand_in_sheet(tests), titled=True),
        provenance=provenance_table([_made_by(t) for t in tests], files),
        settings=_settings(made),
        tests=_table(all_sheet(tests)),
        most_open=MOST_OPEN,
    )
    write_text(root / PAGE_FILE, html)
    return root / PAGE_FILE


def _table(sheet: Sheet, titled: bool = False) -> Table:
    """Return a table; those below a heading of their own need no title."""
    return Table(
        sheet.title if titled else "",
        sheet.heads,
        list(sheet.rows),
        sheet.caption,
        numbers=len(sheet.words) < len(sheet.heads) - 1,
        words=sheet.words,
    )


def _verdict(tests: Sequence[Assessed]) -> str:
    """Return the share of right verdicts as a sentence."""
    found = score(tests)
    if not found.tests:
        return "Nothing has been computed yet."
    return (
        f"{found.right} of {counted(found.tests, 'test')} come out right "
        f"({100.0 * found.share:.1f} %), {found.wrong} wrong, {found.undecided} are "
        f"undecided. Christiansen’s equation is right on {found.equation_right} "
        f"({100.0 * found.equation_share:.1f} %)."
    )


def _notices(tests: Sequence[Assessed]) -> Iterator[Notice]:
    """Say what is missing, and what went wrong."""
    counts = {
        standing: sum(test.standing == standing for test in tests)
        for standing in ("to do", "stopped", "running", "failed", "unstable", "refused")
    }
    waiting = counts["to do"] + counts["stopped"] + counts["running"]
    if waiting:
        text = "mpisph assess continues where it was stopped."
        yield Notice("warn", f"{counted(waiting, 'run')} not at an end: {text}")
    for standing, words in (
        ("failed", "failed"),
        ("unstable", "broke down"),
        ("refused", "cannot be computed"),
    ):
        if counts[standing]:
            text = f"{counted(counts[standing], 'test')} {words}: see Undecided."
            yield Notice("bad" if standing == "failed" else "info", text)
    doubtful = sum(bool(test.warnings) for test in tests)
    if doubtful:
        text = f"with a warning: see the column warnings of {TABLE_FILE}."
        yield Notice("info", f"{counted(doubtful, 'test')} {text}")


def _picture(item: Assessed) -> Figure | None:
    """Return a picture of the wall; None where the run has no snapshots."""
    folder, test = item.folder, item.test
    if folder is None:
        return None
    result = "failed in the test" if test.failed else "held in the test"
    damage = "" if item.damage is None else f", damage {item.damage:.2f}"
    title = f"Row {test.row}, {test.name}: {result}, computed: {item.outcome}{damage}"
    drawn = folder / FIGURES_FOLDER / WALL_FILE
    if drawn.exists():
        return Figure(title, embed_file(drawn), item.reason)
    if not any(path.exists() for path, _ in read_series(folder)):
        return None
    return Figure(title, embed(partial(draw_wall, read_run(folder))), item.reason)


def _made_by(item: Assessed) -> Row:
    run = None if item.folder is None else item.folder.name
    return {
        "version": item.version,
        "revision": item.revision,
        "run": run,
        "wall_s": item.seconds,
    }


def _settings(made: Assessment) -> Table:
    """Return what is set in all cases."""
    given = made.study.file.set
    rows = [
        (key, str(value).lower() if isinstance(value, bool) else str(value))
        for key, value in given.items()
    ]
    return Table("In all cases", ("", ""), list(rows))
