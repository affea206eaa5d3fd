"""What a source claims, and whether the studies bear it out."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

from rich.table import Table

from mpisph.study.model import Study, load_study
from mpisph.study.paper.checks import decide
from mpisph.study.paper.claims_file import Claim, Try, load_claims
from mpisph.study.paper.verdict import Verdict
from mpisph.study.table import Row, collect

MARKDOWN_HEAD = "| claim | verdict | figure |\n|---|---|---|\n"


class Answer(NamedTuple):
    """A claim with the verdict of each of its tries."""

    claim: Claim
    verdicts: tuple[Verdict, ...]


def answer_claims(path: Path, root: Path) -> list[Answer]:
    """Decide all claims of a file by the runs there are.

    Parameters
    ----------
    path : Path
        The file; the studies lie beside it.
    root : Path
        Folder of the runs.

    Returns
    -------
    list of Answer

    Raises
    ------
    CaseError
        If the file or one of its studies is not sound.
    """

    @cache
    def study_of(name: str) -> Study:
        return load_study(path.with_name(f"{name}.toml"))

    @cache
    def table_of(name: str) -> list[Row]:
        return collect(study_of(name), root)

    return [
        Answer(
            claim,
            tuple(decide(t, study_of(t.study), table_of(t.study)) for t in claim.tries),
        )
        for claim in load_claims(path, study_of).claims
    ]


def as_table(answers: Sequence[Answer]) -> Table:
    """Return the verdicts for a terminal."""
    table = Table(title="The paper's claims", show_lines=True)
    for name in ("claim", "verdict", "figure"):
        table.add_column(name)
    for claim, verdicts in answers:
        pairs = list(zip(claim.tries, verdicts, strict=True))
        table.add_row(
            f"{claim.number}. {claim.text}",
            "\n".join(f"{attempt.name}: {verdict.word}" for attempt, verdict in pairs),
            "\n".join(verdict.figure for _, verdict in pairs),
        )
    return table


def as_markdown(answers: Sequence[Answer]) -> str:
    """Return the verdicts as a table in Markdown, and below it what was found."""
    lines = []
    for claim, verdicts in answers:
        first, *others = zip(claim.tries, verdicts, strict=True)
        lines.append(_line(f"{claim.number}. {claim.text}", *first))
        lines += [_line("", *other) for other in others]
    findings = [f"- {c.number}: {c.finding}\n" for c, _ in answers if c.finding]
    return MARKDOWN_HEAD + "".join(lines) + "\n" * bool(findings) + "".join(findings)


def _line(text: str, attempt: Try, verdict: Verdict) -> str:
    return f"| {text} | {attempt.name}: **{verdict.word}** | {verdict.figure} |\n"
