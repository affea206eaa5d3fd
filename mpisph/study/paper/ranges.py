"""Which settings stay below an error, beside the ranges that a source gives."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, NamedTuple

from mpisph.io.files import write_text
from mpisph.study.model import PaperRange, Study
from mpisph.study.store import study_folder
from mpisph.study.table import Row, write_rows

RANGES_FILE = "ranges.csv"
RANGES_TEXT_FILE = "ranges.md"

RangeClock = Literal["nominal", "offset", "fitted"]

TOTALS: dict[RangeClock, str] = {
    "nominal": "total_error_percent",
    "offset": "total_error_offset_percent",
    "fitted": "total_error_fitted_percent",
}
"""Column of the total error for each reading of the clock."""


class RangeCell(NamedTuple):
    """A combination of settings for which the paper gives a range of one more.

    Attributes
    ----------
    at : dict
        The combination, by parameter, as in the table.
    ours : str
        Values whose total error is below the limit, such as ``2.5-7.0``, ``3.5-``,
        ``1.0, 2.0-3.0`` or ``none``.
    paper : str
        The paper's range, written alike.
    both, ours_only, paper_only, neither : int
        Values below the limit here and in the paper, here alone, there alone, and
        nowhere. Those without a run are in none of them.
    """

    at: dict[str, float]
    ours: str
    paper: str
    both: int
    ours_only: int
    paper_only: int
    neither: int

    @property
    def alike(self) -> int:
        """Number of values that are judged alike."""
        return self.both + self.neither

    @property
    def compared(self) -> int:
        """Number of values that are compared."""
        return self.alike + self.ours_only + self.paper_only


class Agreement(NamedTuple):
    """How far the settings below the limit are those of the paper.

    Attributes
    ----------
    clock : str
        The reading of the clock.
    cells : tuple of RangeCell
        In the order of the paper's ranges.
    """

    clock: RangeClock
    cells: tuple[RangeCell, ...]

    @property
    def alike(self) -> int:
        """Number of settings that are judged alike, over all cells."""
        return sum(cell.alike for cell in self.cells)

    @property
    def compared(self) -> int:
        """Number of settings that are compared, over all cells."""
        return sum(cell.compared for cell in self.cells)

    @property
    def fraction(self) -> float:
        """Fraction of the settings that are judged alike; NaN without any."""
        return self.alike / self.compared if self.compared else math.nan


def agreement(study: Study, rows: Sequence[Row], clock: RangeClock) -> Agreement:
    """Compare the settings with an error below the limit with the paper's ranges.

    The ends of a range belong to it, though Lee's table 5 prints ``5.0 < alpha``: the
    authors choose 5.0 as an example from that very range, and a range that begins
    above 9.5, the last value of their grid, would be empty. An unstable run is not
    below the limit.

    Parameters
    ----------
    study : Study
        With ranges of a paper.
    rows : sequence of dict
        From `collect`.
    clock : str
        ``fitted`` takes each run's own offset; where none could be fitted, the run is
        not compared.

    Returns
    -------
    Agreement
        Without cells where the study has no ranges.
    """
    cells = [_cell(study, rows, clock, wanted) for wanted in study.file.paper.ranges]
    return Agreement(clock, tuple(cells))


def _cell(
    study: Study, rows: Sequence[Row], clock: RangeClock, wanted: PaperRange
) -> RangeCell:
    parameter = str(study.file.paper.parameter)
    limit = float(study.file.paper.limit_percent or 0.0)
    here = sorted(
        (row for row in rows if all(row[k] == v for k, v in wanted.at.items())),
        key=lambda row: float(row[parameter]),
    )
    found = [(row[parameter], _below(row, clock, limit)) for row in here]
    pairs = [
        (ours, in_range(value, wanted)) for value, ours in found if ours is not None
    ]
    return RangeCell(
        at={name: here[0][name] if here else at for name, at in wanted.at.items()},
        ours=_pieces(found),
        paper=range_text(wanted),
        both=pairs.count((True, True)),
        ours_only=pairs.count((True, False)),
        paper_only=pairs.count((False, True)),
        neither=pairs.count((False, False)),
    )


def _below(row: Mapping[str, Any], clock: RangeClock, limit: float) -> bool | None:
    """Say whether a run's error is below the limit; None where nothing is known."""
    if row["status"] == "unstable":
        return False
    total = row.get(TOTALS[clock])
    return None if total is None else bool(total < limit)


def in_range(value: float, given: PaperRange) -> bool:
    """Say whether a value is in a paper's range; its ends are."""
    if given.low is None and given.high is None:
        return False
    above = given.low is None or value >= given.low
    return above and (given.high is None or value <= given.high)


def range_text(given: PaperRange) -> str:
    """Return a paper's range as text."""
    if given.low is None and given.high is None:
        return "none"
    ends = ["" if end is None else str(end) for end in (given.low, given.high)]
    return "-".join(ends)


def _pieces(found: Sequence[tuple[float, bool | None]]) -> str:
    """Return the values that are below the limit as ranges, in order.

    A piece that reaches the last value is open, as the paper's are. A value that is
    not known ends a piece.
    """
    if all(below is None for _, below in found):
        return "not known"
    pieces: list[list[float]] = []
    previous = False
    for value, below in found:
        if below and previous:
            pieces[-1].append(value)
        elif below:
            pieces.append([value])
        previous = bool(below)
    texts = [
        str(piece[0]) if len(piece) == 1 else f"{piece[0]}-{piece[-1]}"
        for piece in pieces
    ]
    if previous:
        texts[-1] = f"{pieces[-1][0]}-"
    return ", ".join(texts) or "none"


def ranges_markdown(study: Study, agreements: Sequence[Agreement]) -> str:
    """Return a Markdown table of the ranges of all readings of the clock.

    Parameters
    ----------
    study : Study
    agreements : sequence of Agreement
        At least one, of the same study.

    Returns
    -------
    str
        A row for each cell, with the number of values that are judged alike in
        brackets, and a last row with all of them.
    """
    labels = {p.name: p.label or p.name for p in study.file.parameters}
    names = list(agreements[0].cells[0].at)
    head = [*(labels[name] for name in names), "paper", *(a.clock for a in agreements)]
    lines = [head, ["---"] * len(head)]
    for cells in zip(*(a.cells for a in agreements), strict=True):
        own = [f"{c.ours} ({c.alike}/{c.compared})" for c in cells]
        at = [str(cells[0].at[name]) for name in names]
        lines.append([*at, cells[0].paper, *own])
    totals = [f"{a.alike}/{a.compared} = {100 * a.fraction:.0f} %" for a in agreements]
    lines.append(["all", *[""] * len(names), *totals])
    paper = study.file.paper
    intro = (
        f"Values of {labels[str(paper.parameter)]} with a total error below "
        f"{paper.limit_percent:g} %; in brackets, how many of the values compared are "
        "on the same side as in the paper.\n\n"
    )
    return intro + "".join(f"| {' | '.join(line)} |\n" for line in lines)


def write_ranges(study: Study, root: Path, rows: Sequence[Row]) -> Path | None:
    """Write the ranges beside the paper's, as CSV and as Markdown.

    Parameters
    ----------
    study : Study
    root : Path
        See `store`.
    rows : sequence of dict
        From `collect`.

    Returns
    -------
    Path or None
        The CSV file, with a row for each cell and reading of the clock; None where the
        paper gives no ranges.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    if not study.file.paper.ranges:
        return None
    agreements = [agreement(study, rows, clock) for clock in TOTALS]
    counts = ("both", "ours_only", "paper_only", "neither")
    lines = [
        {**cell.at, "clock": a.clock, "paper": cell.paper, "ours": cell.ours}
        | {name: getattr(cell, name) for name in counts}
        for a in agreements
        for cell in a.cells
    ]
    out = study_folder(root, study) / RANGES_FILE
    write_rows(out, lines)
    write_text(out.with_name(RANGES_TEXT_FILE), ranges_markdown(study, agreements))
    return out
