"""A verification as tables for people."""

from collections.abc import Sequence

from rich.markup import escape
from rich.table import Table

from mpisph.core.words import counted
from mpisph.verify.problem import Check, Problem
from mpisph.verify.record import verdict_word
from mpisph.verify.runner import Verdict

HEADS = ("quantity", "measured", "exact", "bound", "order", "verdict")


def cells(check: Check) -> tuple[str, ...]:
    """Return what a table says of a check, in the order of `HEADS`."""
    unit = f", {check.unit}" if check.unit else ""
    return (
        f"{check.quantity}{unit}",
        f"{check.measured:.5g}",
        f"{check.exact:.5g}",
        check.bound,
        "" if check.order is None else f"{check.order:.1f}",
        verdict_word(check.passed),
    )


def verdict_table(verdicts: Sequence[Verdict]) -> Table:
    """Return a table with a row for each check, or for why there is none."""
    table = Table()
    table.add_column("problem", no_wrap=True)
    for head in HEADS:
        number = head in {"measured", "exact", "bound", "order"}
        table.add_column(
            head,
            justify="right" if number else "left",
            no_wrap=head != "quantity",
            overflow="fold",
        )
    for verdict in verdicts:
        name = verdict.problem.name
        rows = [cells(check) for check in verdict.checks]
        if verdict.reason:
            rows = [(verdict.reason, "", "", "", "", verdict_word(False))]
        for row in rows:
            style = None if row[-1] == verdict_word(True) else "bold red"
            table.add_row(name, *map(escape, row), style=style)
            name = ""
        table.add_section()
    return table


def summary(verdicts: Sequence[Verdict]) -> str:
    """Return in a line how many problems passed."""
    passed = sum(verdict.passed for verdict in verdicts)
    failed = len(verdicts) - passed
    return f"{counted(len(verdicts), 'problem')}: {passed} passed, {failed} failed"


def problem_table(problems: Sequence[Problem]) -> Table:
    """Return a table of what problems there are, with their sources."""
    table = Table("problem", "what it is", "exact solution")
    for problem in problems:
        table.add_row(problem.name, problem.title, problem.source)
    return table
