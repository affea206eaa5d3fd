"""The page of a verification."""

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from mpisph.core.words import grouped
from mpisph.figures.embed import embed_file
from mpisph.io.files import write_text
from mpisph.io.provenance import git_revision, versions
from mpisph.report.page import NONE, Figure, Notice, Table, render
from mpisph.verify.record import verdict_word
from mpisph.verify.runner import Verdict
from mpisph.verify.tables import HEADS, cells, summary

PAGE_FILE = "verify.html"


class ProblemView(NamedTuple):
    """What the template shows of a problem.

    Attributes
    ----------
    name, title, source : str
    passed : bool
    why : str
        What failed, in short.
    notices : list of Notice
        Why there is nothing to check.
    rows : list of tuple of str
        The checks, in the order of `HEADS`.
    figures : list of Figure
    runs : Table
    """

    name: str
    title: str
    source: str
    passed: bool
    why: str
    notices: list[Notice]
    rows: list[tuple[str, ...]]
    figures: list[Figure]
    runs: Table


def write_page(folder: Path, verdicts: Sequence[Verdict]) -> None:
    """Write `PAGE_FILE` into the folder of a verification; on rank 0.

    Raises
    ------
    OSError
        If a file cannot be read or written.
    """
    html = render(
        "verify.html",
        "mpisph.verify",
        title="Verification of mpisph",
        summary=summary(verdicts),
        passed=all(verdict.passed for verdict in verdicts),
        good=verdict_word(True),
        bad=verdict_word(False),
        heads=HEADS,
        problems=[_view(verdict) for verdict in verdicts],
        provenance=Table(
            "Provenance",
            ("", ""),
            [("revision", git_revision()), *versions().items()],
        ),
    )
    write_text(folder / PAGE_FILE, html)


def _view(verdict: Verdict) -> ProblemView:
    problem, path = verdict.problem, verdict.figure
    picture = None if path is None else embed_file(path)
    return ProblemView(
        name=problem.name,
        title=problem.title,
        source=problem.source,
        passed=verdict.passed,
        why="unstable" if verdict.reason else "; ".join(verdict.failed),
        notices=[Notice("bad", verdict.reason)] if verdict.reason else [],
        rows=[tuple(c or NONE for c in cells(check)) for check in verdict.checks],
        figures=[] if picture is None else [Figure(problem.caption, picture)],
        runs=Table(
            "",
            ("run", "particles", "steps", "wall time, s"),
            [
                (r.label, grouped(r.particles), grouped(r.steps), f"{r.wall:.1f}")
                for r in verdict.runs
            ],
            numbers=True,
        ),
    )
