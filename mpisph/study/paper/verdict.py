"""What a check comes to, and what all checks ask of a table's rows."""

from collections.abc import Iterable
from typing import Literal, NamedTuple

from mpisph.study.paper.claims_file import Try
from mpisph.study.table import Row

Word = Literal["reproduced", "in part", "not reproduced", "undecided", "not run"]

_UNITS = {"_mm": "mm", "_percent": "%", "_g": "g", "_km_per_s": "km/s"}


class Verdict(NamedTuple):
    """What a try has come to.

    Attributes
    ----------
    word : str
    figure : str
        The numbers behind it, for people.
    """

    word: Word
    figure: str


def word_of(all_of_it: bool, some_of_it: bool) -> Word:
    """Return the word for what is borne out in all, in part, or not at all."""
    if all_of_it:
        return "reproduced"
    return "in part" if some_of_it else "not reproduced"


def is_stable(row: Row) -> bool:
    """Say whether a run has come to its end."""
    return bool(row["status"] == "completed")


def figure_of(row: Row, column: str) -> float | None:
    """Return a figure of a stable run."""
    return row.get(column) if is_stable(row) else None


def limit_of(attempt: Try) -> float:
    """Return the limit of a try whose check needs one."""
    assert attempt.limit is not None, "load_claims asks for it"
    return attempt.limit


def unit_of(attempt: Try) -> str:
    """Return the unit that the columns' names end with."""
    for ending, unit in _UNITS.items():
        if all(column.endswith(ending) for column in attempt.columns):
            return f" {unit}"
    return ""


def span_text(values: Iterable[float]) -> str:
    """Return the smallest and the largest of some numbers, for people."""
    known = sorted(values)
    if not known:
        return "nothing"
    low, high = f"{known[0]:.1f}", f"{known[-1]:.1f}"
    return low if low == high else f"{low} to {high}"
